"""Checks of the contraindications and limits of the loaded run's shoulder, before a motion and while the arm is played.

Decision record 0034 gives the reasons.
"""

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Final
from uuid import UUID

from fastapi.concurrency import run_in_threadpool

from kata.actor import by_program
from kata.api import texts
from kata.audit.audit_log import AuditLog
from kata.audit.entries import entry
from kata.clinic.contraindications import service as contraindications
from kata.clinic.episodes import service as episodes
from kata.clinic.episodes.limits import DoctorLimits, of_episode
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device.ipc_messages import Pause
from kata.errors import ProblemError
from kata.motion.axes import Side
from kata.station.schemas import EventLive, TextKey
from kata.station.station import Station

_EVERY_S: Final = 0.5
"""Interval between checks while the arm is played."""

log = logging.getLogger(__name__)


async def require_allowed(station: Station, cache: OfflineCache, database: Database) -> None:
    """Check the contraindications of the loaded run's shoulder once more: one may have been recorded after the load. A doctor may also have
    changed the limits with which the run was checked.

    The cached record is used, so that no motion waits for the database. The cache learns a change at this station at once, and one of another
    computer within seconds. Only a restricted record, which is never cached, is read from the database.

    :raises ProblemError: 409 after a change of the limits, and as in :func:`kata.clinic.contraindications.service.check`.
    """
    occupation = station.occupation
    if occupation is None or occupation.session_id is None or occupation.side is None:
        return
    known = cache.find_session(occupation.session_id)
    if known:
        contraindications.check(known.banner.contraindications_of(occupation.side))
        # All recordings of a shoulder have the limits of its episode. Right after the load, the cache may have none.
        allowed = (recording.allowed for recording in known.recordings.values() if recording.side == occupation.side)
        _require_same_limits(occupation.limits, next(allowed, None))
    else:
        with suppress(DatabaseUnavailableError):
            await run_in_threadpool(
                _require_allowed, database, occupation.patient.id, occupation.side, occupation.limits
            )


def _require_allowed(database: Database, patient_id: UUID, side: Side, limits: object) -> None:
    with database.read() as session:
        contraindications.require_none(session, patient_id, side)
        episode = episodes.open_episode(session, patient_id, side)
        _require_same_limits(limits, of_episode(episode) if episode else None)


def _require_same_limits(loaded: object, now: DoctorLimits | None) -> None:
    if loaded is not None and now is not None and now != loaded:
        raise ProblemError(409, "limits_changed", texts.LIMITS_CHANGED_SINCE_LOAD(), texts.RETURN_AND_LOAD_AGAIN())


@asynccontextmanager
async def pausing_playbacks(
    station: Station, cache: OfflineCache, database: Database, audit_log: AuditLog
) -> AsyncIterator[None]:
    """While the context lasts, pause a playback that a contraindication would not allow to start."""
    watching = asyncio.create_task(_watch(station, cache, database, audit_log), name="contraindications")
    try:
        yield
    finally:
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)


async def _watch(station: Station, cache: OfflineCache, database: Database, audit_log: AuditLog) -> None:
    while True:
        await asyncio.sleep(_EVERY_S)
        # Pause is allowed only while the arm is played.
        if station.refusal("pause") is not None:
            continue
        try:
            await require_allowed(station, cache, database)
        except ProblemError as problem:
            await _pause(station, audit_log, problem)
        except Exception:
            # The next check may succeed, and the apparatus must remain usable.
            log.exception("the contraindications of a playback could not be checked")


async def _pause(station: Station, audit_log: AuditLog, problem: ProblemError) -> None:
    refusal = await station.command(Pause())
    log.warning("playback paused: %s: %s", problem.code, refusal.code if refusal else "done")
    if refusal is not None:
        return
    message = texts.PAUSED_BY_CONTRAINDICATION(reason=problem.message)
    key = TextKey.of(message)
    station.publish(EventLive(number=1, code="contraindication_pause", message=message, message_key=key, at=utc_now()))
    with by_program("pause_contraindicated", station.info.name):
        audit_log.record_at_once(entry("pause_contraindicated", "done", detail={"why": problem.code}))
