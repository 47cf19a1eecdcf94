"""Exchange the states of all the clinic's stations through the database that their services share.

On PostgreSQL the services use NOTIFY, which reaches current listeners and stores nothing. On SQLite there is one station. Sending
and listening use a connection each, so that no request waits for them. While the database is unavailable, the states of the other
stations are missing and this station's own state stays current.
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
from kata.station.fleet import SILENT_AFTER_S, Roster, StationReport, StationStatus, as_json, state_of
from kata.station.lease import ClockReading
from kata.station.station import Station

log = logging.getLogger(__name__)

_CHANNEL: Final = "kata_stations"
_AT_LEAST_EVERY_S: Final = 1.0
_RECONNECT_AFTER_S: Final = 1.0
_STATEMENT_LIMIT_S: Final = 3.0


def _now() -> ClockReading:
    return ClockReading(time.monotonic(), datetime.now(UTC))


@dataclass
class Fleet:
    """The stations as this service knows them. Use it only from the service's event loop."""

    station: Station
    database: Database
    names: Callable[[], list[str]]
    """Returns the names of the registered stations; queries the database."""
    now: Callable[[], ClockReading] = _now
    service: UUID = field(default_factory=uuid4)
    changes: int = 0
    """Incremented by every received state."""

    def __post_init__(self) -> None:
        """Start with an empty roster."""
        self._roster = Roster(self.station.info.name)
        self._waiting: set[asyncio.Event] = set()

    def statuses(self) -> list[StationStatus]:
        """Return the states of all stations, this one first."""
        return self._roster.statuses(self.now())

    def register(self, names: list[str]) -> None:
        """Add registered stations."""
        self._roster.register(names)

    async def refresh(self) -> None:
        """Read the registered stations from the database. Known stations stay if it does not answer."""
        try:
            self.register(await asyncio.to_thread(self.names))
        except Exception as error:
            log.info("the list of stations could not be refreshed: %s", error)

    async def wait_for_change(self, limit_s: float) -> None:
        """Wait for the next received state, at most ``limit_s`` seconds."""
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
    async def exchange_states(self) -> AsyncIterator[None]:
        """Send this station's state and receive the others' while the context lasts."""
        shared = self.database.url.get_backend_name() == "postgresql"
        tasks = [asyncio.create_task(self._store_own_reports(), name="own station")]
        if shared:
            tasks += [
                asyncio.create_task(self._with_connection(self._send), name="send own state"),
                asyncio.create_task(self._with_connection(self._listen), name="receive stations"),
            ]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def _own_report(self) -> StationReport:
        return state_of(self.station.info, self.station.live(), self.service)

    def take(self, state: StationReport) -> None:
        """Store a state that has just arrived."""
        self._roster.take(state, self.now())
        self.changes += 1
        for event in self._waiting:
            event.set()

    async def _store_own_reports(self) -> None:
        async for state in self._own_reports():
            self.take(state)

    async def _own_reports(self) -> AsyncIterator[StationReport]:
        """Yield this station's state at once when more than its progress has changed, and at least every second."""
        last: StationReport | None = None
        until_s = 0.0
        with self.station.subscribed() as heard:
            while True:
                heard.changed.clear()
                heard.waiting.clear()
                heard.overflown = False
                state, now_s = self._own_report(), time.monotonic()
                if last is None or now_s >= until_s or state.without_progress != last.without_progress:
                    last, until_s = state, now_s + _AT_LEAST_EVERY_S
                    yield state
                with suppress(TimeoutError):
                    async with asyncio.timeout(max(0.01, until_s - time.monotonic())):
                        await heard.changed.wait()

    async def _with_connection(self, work: Callable[[Any], Any]) -> None:
        """Run ``work`` on a separate connection. Reconnect after a lost connection."""
        # Only installations with PostgreSQL have this package.
        import psycopg

        while True:
            try:
                arguments: dict[str, Any] = dict(self.database.writer.dialect.create_connect_args(self.database.url)[1])
                arguments |= {"connect_timeout": int(_STATEMENT_LIMIT_S), "application_name": "kata fleet"}
                async with asyncio.timeout(2 * _STATEMENT_LIMIT_S):
                    connection = await psycopg.AsyncConnection.connect(**arguments, autocommit=True)
                try:
                    await work(connection)
                finally:
                    await connection.close()
            except (psycopg.Error, OSError, TimeoutError) as error:
                log.info("the exchange with the other stations is interrupted: %s", error)
            await asyncio.sleep(_RECONNECT_AFTER_S)

    async def _send(self, connection: Any) -> None:
        async for state in self._own_reports():
            await _in_time(connection, "SELECT pg_notify(%s, %s)", (_CHANNEL, as_json(state)))

    async def _listen(self, connection: Any) -> None:
        await _in_time(connection, f"LISTEN {_CHANNEL}", ())
        await self.refresh()
        while True:
            heard = False
            async for notice in connection.notifies(timeout=SILENT_AFTER_S):
                heard = True
                self._receive(notice.payload)
            # Listening returns this service's own notifications too, so silence means a lost connection.
            if not heard:
                raise TimeoutError("no notification received")

    def _receive(self, payload: str) -> None:
        try:
            state = StationReport.model_validate_json(payload)
        except ValidationError as error:
            # Another version of Kata sent it. Its station is shown as silent.
            log.warning("the state of another station could not be decoded: %s", error.errors(include_input=False)[:1])
            return
        if state.service != self.service:
            self.take(state)


async def _in_time(connection: Any, statement: str, values: tuple[str, ...]) -> None:
    """Execute a statement, or close the connection after the limit. A cancel request would wait for the same slow server."""
    execution = asyncio.ensure_future(connection.execute(statement, values))
    try:
        done, _ = await asyncio.wait({execution}, timeout=_STATEMENT_LIMIT_S)
        if not done:
            raise TimeoutError("the database takes too long to answer")
        await execution
    finally:
        if not execution.done():
            await connection.close()
            execution.cancel()
            await asyncio.gather(execution, return_exceptions=True)
