"""Is the service alive, and can a session begin here: for watchdogs, containers and proxies. Told to anybody, so it tells of nobody."""

import asyncio
import logging
from importlib.metadata import version
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Depends, Request
from sqlalchemy import text

from kata.api import texts
from kata.database.availability import DATABASE_AWAY
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheDatabase, TheStation
from kata.errors import ProblemError
from kata.station import texts as station_texts
from kata.types import Schema

log = logging.getLogger(__name__)
router = APIRouter(prefix="/health", tags=["health"])

_ANSWERS_WITHIN_S: Final = 1.0


class Alive(Schema):
    """The service answers."""

    status: Literal["alive"] = "alive"


class Ready(Schema):
    """A session can begin here."""

    status: Literal["ready"] = "ready"
    version: str
    database: Literal["sqlite", "postgresql"]


class Probe:
    """Asks the database whether it is there, once at a time: one that hangs keeps one thread waiting, however often it is asked."""

    def __init__(self, database: Database, limit_s: float = _ANSWERS_WITHIN_S) -> None:
        """``limit_s``: whoever asks waits for so long, in seconds."""
        self._database = database
        self._limit_s = limit_s
        self._asking: asyncio.Task[bool] | None = None

    async def answers(self) -> bool:
        """Whether it does, in time."""
        if self._asking is None or self._asking.done():
            self._asking = asyncio.create_task(asyncio.to_thread(self._ask), name="database probe")
        done, _ = await asyncio.wait({self._asking}, timeout=self._limit_s)
        return bool(done) and self._asking.result()

    def _ask(self) -> bool:
        try:
            with self._database.read() as session:
                session.execute(text("SELECT 1"))
        except Exception as error:
            log.info("the database does not answer: %s", error)
            return False
        return True


async def _probe(request: Request) -> Probe:
    probe: Probe = request.app.state.probe
    return probe


@router.get("/live")
async def get_health_live() -> Alive:
    """The service is there: whoever gets no answer may start it anew. It is there without database and apparatus, too: a session that
    goes on is not to be ended for want of them.
    """
    return Alive()


@router.get("/ready", responses=PROBLEMS.of(503))
async def get_health_ready(
    database: TheDatabase, station: TheStation, probe: Annotated[Probe, Depends(_probe)]
) -> Ready:
    """Database and device process answer: a session can begin. 503 while they do not; what goes on goes on all the same."""
    if not await probe.answers():
        raise ProblemError(503, DATABASE_AWAY, texts.DATABASE_UNANSWERED(), texts.WHAT_GOES_ON_CONTINUES())
    if station.live().device != "running":
        raise ProblemError(503, "device_offline", station_texts.DEVICE_OFFLINE(), texts.RESTARTS_AUTOMATICALLY())
    return Ready(version=version("kata"), database="sqlite" if database.file else "postgresql")
