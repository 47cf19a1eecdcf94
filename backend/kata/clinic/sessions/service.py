"""What is done with sessions and runs. Commits nothing: the request does."""

import logging
from dataclasses import asdict, replace
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID, uuid4

import numpy as np
from sqlalchemy import select, update
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import overview
from kata.clinic.figures import RunParts, Window
from kata.clinic.patients import service as patients
from kata.clinic.problems import ProblemError, check_version, not_found
from kata.clinic.programmes import played as counting
from kata.clinic.recordings import service as recordings
from kata.clinic.sessions import ending, learning, phases, plans
from kata.clinic.sessions.schemas import (
    Addendum,
    CheckAnswer,
    Comparison,
    EndReason,
    MotionTracking,
    MotorTracking,
    Run,
    RunStop,
    Session,
    SessionPatient,
    SessionUpdate,
)
from kata.clinic.sessions.tables import (
    SAMPLE_COLUMNS,
    SAMPLES,
    MotionTrackingRow,
    MotorTrackingRow,
    RunRow,
    SessionRow,
    SessionStopRow,
)
from kata.database.base import utc_now
from kata.database.series import Series, pack, unpack
from kata.device.config import StationConfig
from kata.device.journal import PHASE_LESSENED, PHASE_PLAYING, Journal
from kata.device.messages import LOAD_LEVELS
from kata.motion import edit
from kata.motion.axes import Side
from kata.motion.linkage import Floats, OutOfReachError, pose_deg
from kata.motion.method import Method
from kata.motion.tracking import Tracking, compare, compare_motions

log = logging.getLogger(__name__)

_MAY_BE_EMPTIED: Final = {"pain_before", "pain_during", "pain_after"}


def begin(
    session: DatabaseSession,
    patient_id: UUID,
    therapist: str = "",
    programme_version_id: UUID | None = None,
    station: str = "",
) -> SessionRow:
    """Begin a session; the patient's one that is still open goes on instead, with what it does not have yet.

    :raises ProblemError: 404; 409 for an archived patient, or a programme of another episode.
    """
    patient = patients.get(session, patient_id)
    if patient.archived_at:
        raise ProblemError(409, "archived", f"{patient.name} is archived.", "Restore the patient's record first.")
    unended = select(SessionRow).where(SessionRow.patient_id == patient.id, SessionRow.ended_at.is_(None))
    row = session.scalars(unended.order_by(SessionRow.started_at.desc())).first()
    if row is None:
        now = utc_now()
        row = SessionRow(
            id=uuid4(),
            patient_id=patient.id,
            episode_id=patient.episode.id if patient.episode else None,
            station=station,
            started_at=now,
            ended_at=None,
            note="",
            updated_at=now,
        )
        session.add(row)
        session.flush()
        session.refresh(row)
    row.therapist = row.therapist or therapist
    if programme_version_id and row.programme_version_id is None:
        plans.choose(session, row, programme_version_id)
        session.flush()
    return row


def get(session: DatabaseSession, session_id: UUID) -> SessionRow:
    """One session.

    :raises ProblemError: 404.
    """
    row = session.get(SessionRow, session_id)
    if row is None:
        raise not_found("session")
    return row


def to_change(session: DatabaseSession, session_id: UUID, seen_at: datetime | None = None) -> SessionRow:
    """One session that may still be changed; nobody else changes it meanwhile.

    ``seen_at``: the ``updated_at`` that the editor saw.

    :raises ProblemError: 404; 409 when it is signed, or somebody else has changed it.
    """
    row = session.get(SessionRow, session_id, with_for_update=True)
    if row is None:
        raise not_found("session")
    if row.signed_at:
        raise ProblemError(409, "signed", "This session is signed and stays as it is.", "Write an addendum.")
    patients.check_not_erased(row.patient)
    check_version(row.updated_at, seen_at)
    return row


def end(session: DatabaseSession, session_id: UUID, reason: EndReason | None = None) -> SessionRow:
    """End a session, once; only the reason may be given again.

    :raises ProblemError: 404; 409 while a run in it has not ended, or when it is signed.
    """
    row = to_change(session, session_id)
    if any(run.outcome == "loaded" for run in row.runs):
        raise ProblemError(
            409, "run_not_ended", "A playback in this session has not ended.", "End it first, or stop it."
        )
    row.ended_at = row.ended_at or utc_now()
    row.end_reason = reason or row.end_reason or ending.suggested_reason(plans.items(row), row.runs)
    row.updated_at = utc_now()
    return row


def change(session: DatabaseSession, session_id: UUID, given: SessionUpdate) -> SessionRow:
    """Change what is given, leave the rest.

    :raises ProblemError: 404; 409 when it is signed, somebody else changed it meanwhile, or the programme is another episode's.
    """
    row = to_change(session, session_id, given.updated_at)
    fields = given.model_dump(exclude_unset=True, exclude={"updated_at", "programme_version_id"})
    for name, value in fields.items():
        if value is not None or name in _MAY_BE_EMPTIED:
            setattr(row, name, value)
    if given.programme_version_id:
        plans.choose(session, row, given.programme_version_id)
    elif "programme_version_id" in given.model_fields_set:
        row.programme_version = None
    row.updated_at = utc_now()
    return row


def get_run(session: DatabaseSession, run_id: UUID) -> RunRow:
    """One run.

    :raises ProblemError: 404.
    """
    row = session.get(RunRow, run_id)
    if row is None:
        raise not_found("run")
    return row


def begin_run(
    session: DatabaseSession,
    session_id: UUID,
    recording_id: UUID,
    load_level: int = LOAD_LEVELS,
    asked: edit.Asked = edit.AS_TAUGHT,
    method: Method = "smooth",
    station: str = "",
    programme_position: int | None = None,
) -> RunRow:
    """Write down that a recording is about to be played; by the learned method, with what was learned on that station.

    :raises ProblemError: 404; 409 when the session has ended, the recording is another patient's or archived, or it is not at
        that place of the session's programme.
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
    if programme_position is not None:
        plans.require(visit, programme_position, recording_id)
    row = RunRow(
        id=uuid4(),
        session_id=session_id,
        recording_id=recording_id,
        programme_position=programme_position,
        started_at=utc_now(),
        ended_at=None,
        outcome="loaded",
        stop_code=None,
        stop_message=None,
        rate_hz=None,
        load_level=load_level,
        **asdict(asked),
        method=method,
        samples=None,
    )
    if method == "learned":
        row.corrected_by = learning.newest(session, row, station)
    session.add(row)
    visit.run_count += 1
    session.flush()
    session.refresh(row)
    return row


def motion_of(session: DatabaseSession, row: RunRow, *, once: bool = False) -> edit.Motion:
    """What a run asks of the motors: its recording, with what is done to it.

    :param once: one repetition of it, however many are asked for.
    :raises ProblemError: 404; 410 when the recording's samples are damaged; 422 when it cannot be played like that.
    """
    taught = recordings.samples(session, row.recording_id)
    asked = replace(asked_of(row), repetitions=1) if once else asked_of(row)
    try:
        return edit.as_asked(edit.Motion(taught.times_s, taught.angles_deg), asked)
    except edit.EditError as error:
        raise ProblemError(
            422, "unplayable", f"This recording cannot be played like that: {error}.", "Choose other settings."
        ) from error


def asked_of(row: RunRow) -> edit.Asked:
    """How a run's recording is played."""
    return edit.Asked(row.speed_percent, row.repetitions, row.pause_s, row.range_percent)


def keep_run(session: DatabaseSession, journal: Journal, config: StationConfig) -> RunRow | None:
    """Complete a run from its journal, and learn from it; one that is complete already is left alone.

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
    counting.keep(session, row, journal)
    if len(journal.t_ns):
        _keep_phases(session, row, journal)
    seen: bytes | None = None
    played = journal.phase == PHASE_PLAYING
    if np.any(played):
        motion = motion_of(session, row)
        path_s, measured_deg = journal.path_s[played], journal.measured_deg[played]
        compared = compare(motion.times_s, motion.angles_deg, path_s, measured_deg, journal.torque_nm[played])
        row.samples = compared.samples
        seen = overview.of_run(motion, compared)
        learning.keep(session, row, journal, motion, config)
        row.motions = _compare_motions(row, motion, path_s, measured_deg)
        row.tracking = [
            MotorTrackingRow(motor=motor.motor, torque_peak_nm=motor.torque_peak_nm, **_columns(motor))
            for motor in compared.motors
        ]
        phases.widen(
            row.tracking, row.motions, journal.measured_deg[journal.phase == PHASE_LESSENED], row.recording.side
        )
        row.worst_rmse_deg = max(motor.rmse_deg for motor in compared.motors)
        row.worst_peak_deg = max(abs(motor.peak_deg) for motor in compared.motors)
    if len(journal.t_ns):
        SAMPLES.keep(session, row.id, _series(journal), seen)
    if row.outcome == "stopped":
        _keep_stop(session, row)
    session.flush()
    return row


def _keep_phases(session: DatabaseSession, row: RunRow, journal: Journal) -> None:
    row.reversals = phases.reversals(journal.phase)
    if np.any(journal.phase == PHASE_LESSENED):
        row.least_range_percent = phases.least_range_percent(
            motion_of(session, row), journal.phase, journal.path_s, journal.measured_deg.astype(np.float64)
        )


def _series(journal: Journal) -> Series:
    columns = {
        name: getattr(journal, name) for name in ("phase", "path_s", "setpoint_deg", "measured_deg", "torque_nm")
    }
    return pack({"time_s": (journal.t_ns - journal.t_ns[0]) / 1e9, **columns}, SAMPLE_COLUMNS)


def forget_run(session: DatabaseSession, run_id: UUID) -> None:
    """The device refused it: it never began."""
    row = session.get(RunRow, run_id)
    if row and row.outcome == "loaded":
        get(session, row.session_id).run_count -= 1
        session.delete(row)


def _keep_stop(session: DatabaseSession, row: RunRow) -> None:
    visit = get(session, row.session_id)
    visit.stop_count += 1
    if row.stop_code and session.get(SessionStopRow, (visit.id, row.stop_code)) is None:
        session.add(SessionStopRow(session_id=visit.id, code=row.stop_code, started_at=visit.started_at))


def give_up_unended(session: DatabaseSession, run_id: UUID | None = None) -> int:
    """At start, with every journal imported: a run that still has not ended has lost its journal too.

    ``run_id``: at any time, for the one whose journal holds nothing.

    :returns: how many there were.
    """
    lost = update(RunRow).where(RunRow.outcome == "loaded").values(outcome="interrupted", ended_at=RunRow.started_at)
    if run_id:
        lost = lost.where(RunRow.id == run_id)
    return int(session.connection().execute(lost).rowcount)


def _compare_motions(row: RunRow, motion: edit.Motion, path_s: Floats, measured_deg: Floats) -> list[MotionTrackingRow]:
    """None where the motors stood as no scapula can stand: what is known of them is kept all the same."""
    side: Side = "left" if row.recording.side == "left" else "right"
    try:
        compared = compare_motions(
            motion.times_s, motion.angles_deg, path_s, measured_deg, lambda angles: pose_deg(angles, side)
        )
    except OutOfReachError as error:
        log.warning("run %s is compared by its motors only: %s", row.id, error)
        return []
    return [MotionTrackingRow(motion=one.motion.number, **_columns(one)) for one in compared]


def _columns(tracking: Tracking) -> dict[str, float | None]:
    return {
        "peak_deg": tracking.peak_deg,
        "peak_at_s": tracking.peak_at_s,
        "rmse_deg": tracking.rmse_deg,
        "start_deg": tracking.start_deg,
        "lag_ms": tracking.lag_ms,
        "taught_min_deg": tracking.taught.min_deg,
        "taught_max_deg": tracking.taught.max_deg,
        "played_min_deg": tracking.played.min_deg,
        "played_max_deg": tracking.played.max_deg,
        "taught_smoothness": tracking.taught_smoothness,
        "played_smoothness": tracking.played_smoothness,
    }


def figure_parts(session: DatabaseSession, run_id: UUID, window: Window | None = None) -> RunParts:
    """What the run's figures are drawn from; of a window of the path only, where one is given.

    :raises ProblemError: 404; 409 when nothing was played; 410 when what says where the samples are is damaged.
    """
    row = get_run(session, run_id)
    if row.samples is None:
        raise ProblemError(409, "nothing_played", "Nothing was played in this run.", "There is nothing to compare.")
    seen = None if window else SAMPLES.overview(session, run_id)
    if seen is not None:
        return RunParts(None, None, asked_of(row), seen, None)
    taught = recordings.stored_samples(session, row.recording_id)
    if window:
        return RunParts(taught, SAMPLES.read_within(session, run_id, "path_s", *window), asked_of(row), None, window)
    return RunParts(taught, SAMPLES.read(session, run_id), asked_of(row), None, None)


def samples(session: DatabaseSession, run_id: UUID) -> dict[str, Floats]:
    """What the run measured, the arrays of :data:`kata.clinic.sessions.tables.SAMPLE_COLUMNS` by name.

    :raises UnreadableError: when they are damaged, or there are none.
    """
    return unpack(SAMPLES.read(session, run_id))


def as_run(row: RunRow) -> Run:
    """As it goes out."""
    motors = [MotorTracking.model_validate(motor) for motor in row.tracking]
    motions = [MotionTracking.model_validate(motion) for motion in row.motions]
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
        method=row.method,
        load_level=row.load_level,
        **asdict(asked_of(row)),
        programme_position=row.programme_position,
        repetitions_done=row.repetitions_done,
        reversals=row.reversals,
        least_range_percent=row.least_range_percent,
        comparison=Comparison(samples=row.samples, motors=motors, motions=motions) if row.samples else None,
    )


def as_session(row: SessionRow) -> Session:
    """As it goes out."""
    return Session(
        id=row.id,
        patient=SessionPatient.model_validate(row.patient),
        episode_id=row.episode_id,
        side=row.episode.side if row.episode else None,
        therapist=row.therapist,
        station=row.station,
        programme=plans.as_programme(row),
        started_at=row.started_at,
        ended_at=row.ended_at,
        end_reason=row.end_reason,
        checks=[CheckAnswer.model_validate(one) for one in row.checks],
        pain_before=row.pain_before,
        pain_during=row.pain_during,
        pain_after=row.pain_after,
        note=row.note,
        signed_at=row.signed_at,
        signed_by=row.signed_by,
        addenda=[Addendum.model_validate(one) for one in row.addenda],
        updated_at=row.updated_at,
        runs=[as_run(run) for run in row.runs],
    )
