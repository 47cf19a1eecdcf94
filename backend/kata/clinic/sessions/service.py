"""What is done with sessions and runs. Commits nothing: the request does."""

from datetime import timedelta
from uuid import UUID, uuid4

import numpy as np
from sqlalchemy import func, select, update
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.patients import service as patients
from kata.clinic.problems import ProblemError, not_found
from kata.clinic.recordings import service as recordings
from kata.clinic.sessions.schemas import (
    Comparison,
    MotorTracking,
    Run,
    RunStop,
    Session,
    SessionPatient,
    SessionSummary,
    SessionUpdate,
)
from kata.clinic.sessions.tables import SAMPLE_COLUMNS, MotorTrackingRow, RunRow, RunSamplesRow, SessionRow
from kata.database import arrays
from kata.database.base import utc_now
from kata.device.journal import PHASE_PLAYING, Journal
from kata.device.messages import LOAD_LEVELS
from kata.motion.tracking import compare


def begin(session: DatabaseSession, patient_id: UUID) -> SessionRow:
    """Begin a session; the patient's one that is still open goes on instead.

    :raises ProblemError: 404; 409 for an archived patient.
    """
    patient = patients.get(session, patient_id)
    if patient.archived_at:
        raise ProblemError(409, "archived", f"{patient.name} is archived.", "Restore the patient's record first.")
    unended = select(SessionRow).where(SessionRow.patient_id == patient_id, SessionRow.ended_at.is_(None))
    row = session.scalars(unended.order_by(SessionRow.started_at.desc())).first()
    if row is None:
        row = SessionRow(id=uuid4(), patient_id=patient_id, started_at=utc_now(), ended_at=None, note="")
        session.add(row)
        session.flush()
        session.refresh(row)
    return row


def get(session: DatabaseSession, session_id: UUID) -> SessionRow:
    """One session.

    :raises ProblemError: 404.
    """
    row = session.get(SessionRow, session_id)
    if row is None:
        raise not_found("session")
    return row


def find(session: DatabaseSession, *, patient_id: UUID | None, limit: int, offset: int) -> tuple[list[SessionRow], int]:
    """Sessions, newest first; and how many there are in all."""
    query = select(SessionRow)
    if patient_id:
        query = query.where(SessionRow.patient_id == patient_id)
    total = session.scalar(select(func.count()).select_from(query.with_only_columns(SessionRow.id).subquery())) or 0
    rows = session.scalars(query.order_by(SessionRow.started_at.desc()).limit(limit).offset(offset))
    return list(rows), total


def end(session: DatabaseSession, session_id: UUID) -> SessionRow:
    """End a session, once.

    :raises ProblemError: 404; 409 while a run in it has not ended.
    """
    row = get(session, session_id)
    if any(run.outcome == "loaded" for run in row.runs):
        raise ProblemError(
            409, "run_not_ended", "A playback in this session has not ended.", "End it first, or stop it."
        )
    row.ended_at = row.ended_at or utc_now()
    return row


def change(session: DatabaseSession, session_id: UUID, given: SessionUpdate) -> SessionRow:
    """Change the note.

    :raises ProblemError: 404.
    """
    row = get(session, session_id)
    if given.note is not None:
        row.note = given.note
    return row


def get_run(session: DatabaseSession, run_id: UUID) -> RunRow:
    """One run.

    :raises ProblemError: 404.
    """
    row = session.get(RunRow, run_id)
    if row is None:
        raise not_found("run")
    return row


def begin_run(session: DatabaseSession, session_id: UUID, recording_id: UUID, load_level: int = LOAD_LEVELS) -> RunRow:
    """Write down that a recording is about to be played.

    :raises ProblemError: 404; 409 when the session has ended, or the recording is another patient's or archived.
    """
    visit = get(session, session_id)
    recording = recordings.get(session, recording_id)
    if visit.ended_at:
        raise ProblemError(409, "session_ended", "This session has ended.", "Begin a new one.")
    if recording.patient_id != visit.patient_id:
        raise ProblemError(
            409, "other_patient", "This recording was taught to another patient.", "Choose one of this patient's own."
        )
    if recording.archived_at:
        raise ProblemError(409, "archived", "This recording is archived.", "Restore it first, or choose another.")
    row = RunRow(
        id=uuid4(),
        session_id=session_id,
        recording_id=recording_id,
        started_at=utc_now(),
        ended_at=None,
        outcome="loaded",
        stop_code=None,
        stop_message=None,
        rate_hz=None,
        load_level=load_level,
        samples=None,
    )
    session.add(row)
    session.flush()
    session.refresh(row)
    return row


def keep_run(session: DatabaseSession, journal: Journal) -> RunRow | None:
    """Complete a run from its journal; one that is complete already is left alone.

    :returns: the run; None when nobody knows it.
    """
    row = session.get(RunRow, UUID(journal.id))
    if row is None or row.ended_at:
        return row
    lasted_ns = int(journal.t_ns[-1]) - journal.started_ns if len(journal.t_ns) else 0
    row.ended_at = journal.started_at + timedelta(seconds=lasted_ns / 1e9)
    row.outcome = journal.end.reason if journal.end else "interrupted"
    row.stop_code = journal.end.cause_code if journal.end else None
    row.stop_message = journal.end.cause_message if journal.end else None
    row.rate_hz = journal.rate_hz
    if len(journal.t_ns):
        times_s = (journal.t_ns - journal.t_ns[0]) / 1e9
        columns = {
            name: getattr(journal, name) for name in ("phase", "path_s", "setpoint_deg", "measured_deg", "torque_nm")
        }
        session.add(RunSamplesRow(run_id=row.id, data=arrays.encode({"time_s": times_s, **columns}, SAMPLE_COLUMNS)))
    played = journal.phase == PHASE_PLAYING
    if np.any(played):
        taught = recordings.samples(session, row.recording_id)
        compared = compare(taught.times_s, taught.angles_deg, journal.path_s[played], journal.measured_deg[played])
        row.samples = compared.samples
        row.tracking = [
            MotorTrackingRow(
                motor=motor.motor,
                peak_deg=motor.peak_deg,
                peak_at_s=motor.peak_at_s,
                rmse_deg=motor.rmse_deg,
                start_deg=motor.start_deg,
            )
            for motor in compared.motors
        ]
    session.flush()
    return row


def give_up_unended(session: DatabaseSession, run_id: UUID | None = None) -> int:
    """At start, with every journal imported: a run that still has not ended has lost its journal too.

    ``run_id``: at any time, for the one whose journal holds nothing.

    :returns: how many there were.
    """
    lost = update(RunRow).where(RunRow.outcome == "loaded").values(outcome="interrupted", ended_at=RunRow.started_at)
    if run_id:
        lost = lost.where(RunRow.id == run_id)
    return int(session.connection().execute(lost).rowcount)


def figure_blobs(session: DatabaseSession, run_id: UUID) -> tuple[bytes, bytes]:
    """What the run's figures are drawn from: the samples of its recording and its own.

    :raises ProblemError: 404; 409 when nothing was played.
    """
    row = get_run(session, run_id)
    if row.samples is None:
        raise ProblemError(409, "nothing_played", "Nothing was played in this run.", "There is nothing to compare.")
    own = session.get(RunSamplesRow, run_id)
    return recordings.samples_blob(session, row.recording_id), own.data if own else b""


def as_run(row: RunRow) -> Run:
    """As it goes out."""
    motors = [MotorTracking.model_validate(motor) for motor in row.tracking]
    return Run(
        id=row.id,
        session_id=row.session_id,
        recording_id=row.recording_id,
        recording_name=row.recording.name,
        started_at=row.started_at,
        ended_at=row.ended_at,
        outcome=row.outcome,
        stop=RunStop(code=row.stop_code, message=row.stop_message or "") if row.stop_code else None,
        rate_hz=row.rate_hz,
        load_level=row.load_level,
        comparison=Comparison(samples=row.samples, motors=motors) if row.samples else None,
    )


def as_session(row: SessionRow) -> Session:
    """As it goes out."""
    return Session(
        id=row.id,
        patient=SessionPatient.model_validate(row.patient),
        started_at=row.started_at,
        ended_at=row.ended_at,
        note=row.note,
        runs=[as_run(run) for run in row.runs],
    )


def as_summary(row: SessionRow) -> SessionSummary:
    """As it goes out in a list."""
    return SessionSummary(
        id=row.id,
        patient=SessionPatient.model_validate(row.patient),
        started_at=row.started_at,
        ended_at=row.ended_at,
        runs=len(row.runs),
        stops=sum(run.outcome == "stopped" for run in row.runs),
    )
