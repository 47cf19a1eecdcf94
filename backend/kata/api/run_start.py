"""Begins a run at the station: its records are written first, then the device loads it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal
from uuid import UUID

from fastapi import Depends
from fastapi.concurrency import run_in_threadpool
from sqlalchemy.orm import Session

from kata.api.errors import refused
from kata.clinic.episodes.limits import DoctorLimits, MotorLimits
from kata.clinic.event_spool import EventSpool
from kata.clinic.sessions import runs
from kata.clinic.sessions.offline_sessions import OfflineSessions
from kata.clinic.sessions.router import TheEventSpool, TheOfflineSessions
from kata.clinic.sessions.schemas import Run
from kata.database.availability import DatabaseUnavailableError
from kata.database.engine import Database
from kata.dependencies import TheDatabase
from kata.device import ipc_messages
from kata.motion.edit import Motion
from kata.motion.ilc import Correction
from kata.station.lease import Browser
from kata.station.live_end_range import LiveEndRange
from kata.station.schemas import PatientRef
from kata.station.snapshot_tracker import Occupation
from kata.station.station import NO_ANSWER, Station
from kata.types import Side


@dataclass(frozen=True)
class StartedRun:
    """A run that is recorded and that the device may load."""

    run: Run
    motion: Motion
    learned: Correction | None
    side: Side
    limits: MotorLimits
    allowed: DoctorLimits
    patient: PatientRef
    end_range: LiveEndRange | None = None
    """None if no end-range time is prescribed."""
    without_database: bool = False


@dataclass(frozen=True)
class RunStores:
    """Stores of runs: the database, the spool and the offline sessions."""

    database: Database
    event_spool: EventSpool
    offline_sessions: OfflineSessions


async def _run_stores(
    database: TheDatabase, event_spool: TheEventSpool, offline_sessions: TheOfflineSessions
) -> RunStores:
    return RunStores(database, event_spool, offline_sessions)


TheRunStores = Annotated[RunStores, Depends(_run_stores)]


@contextmanager
def writing(
    database: Database, event_spool: EventSpool, kind: Literal["run", "teaching"]
) -> Iterator[tuple[Session, list[UUID]]]:
    """Open a session as :meth:`Database.write` does. The caller appends the id of a new run or teaching to the list.

    If the database is lost during the commit, the row may exist although the device never began. This function then records that the run or
    teaching has not begun.
    """
    began: list[UUID] = []
    try:
        with database.write() as session:
            yield session, began
    except DatabaseUnavailableError:
        for id_ in began:
            event_spool.put_not_begun(kind, id_)
        raise


async def send_load(
    station: Station,
    stores: RunStores,
    operator: Browser | None,
    started: StartedRun,
    command: ipc_messages.Load,
    changes: tuple[str, ...],
) -> Run:
    """Let the device load a run that is recorded. ``changes``: what the page shows of how it differs from the recording.

    :raises ProblemError: when the device refuses. The run is then removed.
    """
    run = started.run
    occupation = Occupation(
        id=str(run.id),
        patient=started.patient,
        recording_name=run.recording_name,
        session_id=run.session_id,
        changes=changes,
        end_range=started.end_range,
        side=started.side,
        limits=started.allowed,
        duration_known=command.end_feel is None and not command.self_paced,
    )
    never_begun = partial(stores.event_spool.put_not_begun, "run", run.id)
    refusal = await station.command(command, occupation, by=operator, refused_late=never_begun)
    if refusal:
        if refusal.code != NO_ANSWER:
            await run_in_threadpool(_forget_run, stores, started)
        raise refused(refusal)
    return run


def _forget_run(stores: RunStores, started: StartedRun) -> None:
    """Remove a run that the device refused."""
    if started.without_database:
        # This is queued behind the record of the run's beginning, which may not be delivered yet.
        stores.event_spool.put_not_begun("run", started.run.id)
        stores.offline_sessions.finish_run(started.run.id, None)
        return
    try:
        with stores.database.write() as session:
            runs.remove_refused(session, started.run.id)
    except DatabaseUnavailableError:
        stores.event_spool.put_not_begun("run", started.run.id)
