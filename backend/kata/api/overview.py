"""All the clinic's stations: each service tells the others what its station does, through the database that they share.

On PostgreSQL by NOTIFY, which reaches whoever listens at that moment and is written down nowhere; on SQLite there is the one
station. A service tells, and listens, on a connection each of its own, so that no request waits for either: a database that is away
leaves the others silent, and this station's own state as it is.
"""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Final
from uuid import UUID, uuid4

from pydantic import ValidationError

from kata.database.engine import Database
from kata.station.lease import Moment
from kata.station.overview import SILENT_AFTER_S, Roster, StationShown, StationTold, encoded, state_of
from kata.station.station import Station

log = logging.getLogger(__name__)

_CHANNEL: Final = "kata_stations"
_AT_LEAST_EVERY_S: Final = 1.0
_AGAIN_S: Final = 1.0
_LIMIT_S: Final = 3.0
"""So long the database may take for one word."""


def _now() -> Moment:
    return Moment(time.monotonic(), datetime.now(UTC))


@dataclass
class Overview:
    """The stations as this service knows them. Lives in its event loop."""

    station: Station
    database: Database
    names: Callable[[], list[str]]
    """Of the stations that are registered; asks the database."""
    now: Callable[[], Moment] = _now
    service: UUID = field(default_factory=uuid4)
    changes: int = 0
    """Counts up whenever somebody has said something."""

    def __post_init__(self) -> None:
        """Nobody has been heard yet."""
        self._roster = Roster(self.station.info.name)
        self._waiting: set[asyncio.Event] = set()

    def shown(self) -> list[StationShown]:
        """Every station, this one first."""
        return self._roster.shown(self.now())

    def register(self, names: list[str]) -> None:
        """These are registered by now."""
        self._roster.register(names)

    async def refresh(self) -> None:
        """Look who is registered by now; without the database, whoever was known stays."""
        try:
            self.register(await asyncio.to_thread(self.names))
        except Exception as error:
            log.info("which stations there are is not known anew: %s", error)

    async def changed(self, limit_s: float) -> None:
        """Until somebody has said something, or so many seconds have passed."""
        event = asyncio.Event()
        self._waiting.add(event)
        try:
            async with asyncio.timeout(limit_s):
                await event.wait()
        except TimeoutError:
            pass
        finally:
            self._waiting.discard(event)

    @asynccontextmanager
    async def going_on(self) -> AsyncIterator[None]:
        """While the context lasts, this station tells, and hears the others."""
        shared = self.database.url.get_backend_name() == "postgresql"
        tasks = [asyncio.create_task(self._watch_own(), name="own station")]
        if shared:
            tasks += [
                asyncio.create_task(self._again_and_again(self._tell), name="stations told"),
                asyncio.create_task(self._again_and_again(self._listen), name="stations heard"),
            ]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def _own(self) -> StationTold:
        return state_of(self.station.info, self.station.live(), self.service)

    def take(self, state: StationTold) -> None:
        """A station has said this, and it has arrived now; from the event loop."""
        self._roster.take(state, self.now())
        self.changes += 1
        for event in self._waiting:
            event.set()

    async def _watch_own(self) -> None:
        async for state in self._news():
            self.take(state)

    async def _news(self) -> AsyncIterator[StationTold]:
        """The own state: at once when more than its progress has changed, and at least every second."""
        told: StationTold | None = None
        until_s = 0.0
        with self.station.subscribed() as heard:
            while True:
                heard.changed.clear()
                heard.waiting.clear()
                heard.overflown = False
                state, now_s = self._own(), time.monotonic()
                if told is None or now_s >= until_s or state.steady != told.steady:
                    told, until_s = state, now_s + _AT_LEAST_EVERY_S
                    yield state
                with suppress(TimeoutError):
                    async with asyncio.timeout(max(0.01, until_s - time.monotonic())):
                        await heard.changed.wait()

    async def _again_and_again(self, work: Callable[[Any], Any]) -> None:
        """With a connection of its own, and a new one when it is lost."""
        # Only a clinic on PostgreSQL has it installed.
        import psycopg

        while True:
            try:
                given: dict[str, Any] = dict(self.database.writer.dialect.create_connect_args(self.database.url)[1])
                given |= {"connect_timeout": int(_LIMIT_S), "application_name": "kata overview"}
                async with asyncio.timeout(2 * _LIMIT_S):
                    connection = await psycopg.AsyncConnection.connect(**given, autocommit=True)
                try:
                    await work(connection)
                finally:
                    await connection.close()
            except (psycopg.Error, OSError, TimeoutError) as error:
                log.info("the other stations are not heard, or do not hear this one: %s", error)
            await asyncio.sleep(_AGAIN_S)

    async def _tell(self, connection: Any) -> None:
        async for state in self._news():
            await _in_time(connection, "SELECT pg_notify(%s, %s)", (_CHANNEL, encoded(state)))

    async def _listen(self, connection: Any) -> None:
        await _in_time(connection, f"LISTEN {_CHANNEL}", ())
        await self.refresh()
        while True:
            heard = False
            async for notice in connection.notifies(timeout=SILENT_AFTER_S):
                heard = True
                self._hear(notice.payload)
            # It hears itself, too: a connection on which nothing comes is none.
            if not heard:
                raise TimeoutError("nothing comes")

    def _hear(self, payload: str) -> None:
        try:
            state = StationTold.model_validate_json(payload)
        except ValidationError as error:
            # Of another version. Its station is silent then, which is the truth: nobody here understands it.
            log.warning("what a station says is not understood: %s", error.errors(include_input=False)[:1])
            return
        if state.service != self.service:
            self.take(state)


async def _in_time(connection: Any, statement: str, values: tuple[str, ...]) -> None:
    """Not by cancelling it, which would ask the same server: a connection that takes too long is given up."""
    asking = asyncio.ensure_future(connection.execute(statement, values))
    try:
        done, _ = await asyncio.wait({asking}, timeout=_LIMIT_S)
        if not done:
            raise TimeoutError("the database takes too long")
        await asking
    finally:
        if not asking.done():
            await connection.close()
            asking.cancel()
            await asyncio.gather(asking, return_exceptions=True)
