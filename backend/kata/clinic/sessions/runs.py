"""Read and write runs. The caller commits."""

import logging
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta
from uuid import UUID, uuid4

import msgspec
from sqlalchemy import ColumnElement, select, update
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import end_feel, end_range, ending, phases, plans, stored_corrections
from kata.clinic.sessions.patient_angles import PatientAngles
from kata.clinic.sessions.run_results import EndedPlayback, PlaybackResults, calculate
from kata.clinic.sessions.schemas import (
    Comparison,
    LearningNote,
    MotionTracking,
    MotorTracking,
    PlaybackSettings,
    Run,
    RunOutcome,
    RunStop,
)
from kata.clinic.sessions.tables import (
    RUN_COLUMNS,
    RUN_SAMPLES,
    MotionTrackingRow,
    MotorTrackingRow,
    RunCorrectionRow,
    RunRow,
    SessionRow,
    SessionStopRow,
)
from kata.database.base import utc_now
from kata.database.series import Series, pack, unpack
from kata.device.config import StationConfig
from kata.device.ipc_messages import RESISTANCE_LEVELS
from kata.device.journal import Journal
from kata.errors import ProblemError, not_found
from kata.messages import text_of
from kata.motion import edit
from kata.motion.linkage import Floats
from kata.motion.method import Method
from kata.plotting.figures import Clock, RunFigureSamples, Window
from kata.types import side_of

log = logging.getLogger(__name__)


def get(session: DatabaseSession, run_id: UUID) -> RunRow:
    """Return one run.

    :raises ProblemError: 404.
    """
    row = session.get(RunRow, run_id)
    if row is None:
        raise not_found(texts.RUN_NOT_FOUND)
    return row


@dataclass(frozen=True)
class RunRequest:
    """A requested run: recording, settings and item of the session's programme."""

    session_id: UUID
    recording_id: UUID
    resistance_level: int = RESISTANCE_LEVELS
    settings: edit.PlaybackSettings = edit.AS_TAUGHT
    method: Method = "smooth"
    programme_position: int | None = None
    """Position in the session's programme; None for a run that was not planned."""
    self_paced: bool = False
    """True if the patient's effort sets the pace."""


def begin(
    session: DatabaseSession, request: RunRequest, station: str = "", *, prepared: RunRow | None = None
) -> RunRow:
    """Store a run that is about to be played. For the learned method it gets the station's newest correction.

    ``prepared``: result of :func:`prepare` for the same run. Its correction is used.

    :raises ProblemError: as in :func:`prepare`.
    """
    row = _allowed(session, request)
    row.corrected_by = prepared.corrected_by if prepared else _corrected_by(session, row, station)
    session.add(row)
    _clinic_session(session, row).run_count += 1
    session.flush()
    session.refresh(row)
    return row


def prepare(session: DatabaseSession, request: RunRequest, station: str = "") -> RunRow:
    """Return the run that :func:`begin` would store. Nothing is stored.

    :raises ProblemError: 404; 409 when the session has ended, the recording is archived or belongs to another patient, or it is not at that
        position of the session's programme.
    """
    row = _allowed(session, request)
    row.corrected_by = _corrected_by(session, row, station)
    return row


def _corrected_by(session: DatabaseSession, row: RunRow, station: str) -> UUID | None:
    if row.method != "learned":
        return None
    return stored_corrections.newest(session, row.recording_id, settings_of(row), station, row.started_at)


def _allowed(session: DatabaseSession, request: RunRequest) -> RunRow:
    clinic_session = session.get(SessionRow, request.session_id)
    if clinic_session is None:
        raise not_found(texts.SESSION_NOT_FOUND)
    recording = recordings.get(session, request.recording_id)
    ending.check_not_ended(clinic_session.ended_at)
    if recording.patient_id != clinic_session.patient_id:
        raise ProblemError(409, "other_patient", texts.RECORDING_OF_OTHER_PATIENT(), texts.CHOOSE_OWN_RECORDING())
    if recording.archived_at:
        raise ProblemError(409, "archived", texts.RECORDING_ARCHIVED(), texts.RESTORE_OR_CHOOSE_ANOTHER())
    if request.programme_position is not None:
        plans.require(clinic_session, request.programme_position, request.recording_id)
    return new(uuid4(), utc_now(), request)


def new(id_: UUID, started_at: datetime, request: RunRequest) -> RunRow:
    """Return a new row of a loaded run. The row is not added to a database."""
    return RunRow(
        id=id_,
        session_id=request.session_id,
        recording_id=request.recording_id,
        programme_position=request.programme_position,
        started_at=started_at,
        ended_at=None,
        outcome="loaded",
        stop_code=None,
        stop_message=None,
        rate_hz=None,
        resistance_level=request.resistance_level,
        **asdict(request.settings),
        method=request.method,
        self_paced=request.self_paced,
        samples=None,
    )


def motion_of(session: DatabaseSession, row: RunRow, *, single: bool = False) -> edit.Motion:
    """Return the motion that a run requests from the motors: its recording with the run's settings.

    :param single: return only one repetition.
    :raises ProblemError: 404; 410 when the recording's samples are damaged; 422 when it cannot be played with these settings.
    """
    settings = settings_of(row)
    return with_settings(taught(session, row.recording_id), replace(settings, repetitions=1) if single else settings)


def taught(session: DatabaseSession, recording_id: UUID) -> edit.Motion:
    """Return a recording as a motion.

    :raises ProblemError: 404; 410 when its samples are damaged.
    """
    samples = recordings.samples(session, recording_id)
    return edit.Motion(samples.times_s, samples.angles_deg)


def with_settings(taught: edit.Motion, settings: edit.PlaybackSettings) -> edit.Motion:
    """Return a recording with a run's settings. This takes seconds for a recording of an hour.

    :raises ProblemError: 422 when it cannot be played with these settings.
    """
    try:
        return edit.with_settings(taught, settings)
    except edit.EditError as error:
        raise ProblemError(
            422, "unplayable", texts.RUN_NOT_PLAYABLE(reason=text_of(error)), texts.CHOOSE_OTHER_SETTINGS()
        ) from error


def settings_of(row: RunRow | PlaybackSettings) -> edit.PlaybackSettings:
    """Return the settings of a run."""
    return edit.PlaybackSettings(row.speed_percent, row.repetitions, row.pause_s, row.range_percent)


def ended_playback(session: DatabaseSession, journal: Journal, config: StationConfig) -> EndedPlayback | None:
    """Return the data from which the results of a journal's run are calculated.

    :returns: None if the run is unknown, already complete, or an end-feel run.
    :raises ProblemError: 404 when the recording is missing.
    """
    row = session.get(RunRow, UUID(journal.id))
    if row is None or row.rate_hz is not None or row.end_feel:
        return None
    learns = row.method == "learned"
    return EndedPlayback(
        run_id=journal.id,
        journal=journal,
        recording=recordings.stored_samples(session, row.recording_id),
        settings=settings_of(row),
        outcome=outcome_of(journal),
        config=msgspec.structs.replace(config, side=side_of(row.recording.side)),
        end_range=end_range.thresholds_of(plans.end_range_of(session, row)),
        learns=learns,
        correction=stored_corrections.correction(session, row.corrected_by) if learns else None,
        resistance_share=(row.resistance_level or RESISTANCE_LEVELS) / RESISTANCE_LEVELS,
    )


def complete(
    session: DatabaseSession, journal: Journal, config: StationConfig, results: PlaybackResults | None = None
) -> RunRow | None:
    """Complete a run from its journal. A run that is already complete is not changed. A run that was marked as interrupted before its
    journal arrived is completed.

    :param results: results of :func:`ended_playback` if they were calculated before; otherwise they are calculated here.
    :returns: the run, or None if it is unknown.
    """
    row = session.get(RunRow, UUID(journal.id))
    if row is None or row.rate_hz is not None:
        return row
    playback = None if results else ended_playback(session, journal, config)
    lasted_ns = int(journal.t_ns[-1]) - journal.started_ns if len(journal.t_ns) else 0
    row.ended_at = journal.started_at + timedelta(seconds=lasted_ns / 1e9)
    row.outcome = outcome_of(journal)
    row.stop_code = journal.end.cause_code if journal.end else None
    row.stop_message = journal.end.cause_message if journal.end else None
    row.stop_key = msgspec.to_builtins(journal.end.cause_key) if journal.end else None
    row.rate_hz = journal.rate_hz
    if journal.end:
        row.work_j, row.mean_effort_nm = journal.end.work_j, journal.end.mean_effort_nm
        row.mean_pace_percent = journal.end.mean_pace_percent
    if row.end_feel:
        _complete_end_feel(session, row, journal)
    elif results := results or (calculate(playback) if playback else None):
        _store_results(session, row, results, config)
    if len(journal.t_ns):
        RUN_SAMPLES.store(session, row.id, _series(journal), results.overview if results else None)
    if row.outcome == "stopped":
        _store_stop(session, row)
    session.flush()
    return row


def _store_results(session: DatabaseSession, row: RunRow, results: PlaybackResults, config: StationConfig) -> None:
    for name, value in results.run.items():
        setattr(row, name, value)
    row.tracking = [MotorTrackingRow(**columns) for columns in results.motors]
    row.motions = [MotionTrackingRow(**columns) for columns in results.motions]
    store_worst_errors(row)
    if results.correction:
        session.add(RunCorrectionRow(run_id=row.id, station=config.name, data=results.correction))


def store_worst_errors(row: RunRow) -> None:
    """Store the errors of the worst motor for lists, progress and the clinic's figures. A partial run has none."""
    if row.tracking and not row.partial:
        row.worst_rmse_deg = max(motor.rmse_deg for motor in row.tracking)
        row.worst_peak_deg = max(abs(motor.peak_deg) for motor in row.tracking)


def _complete_end_feel(session: DatabaseSession, row: RunRow, journal: Journal) -> None:
    """Calculate the result of an end-feel run. It repeats no recording, so it counts neither repetitions nor errors of a playback."""
    assert row.end_feel is not None
    row.repetitions_done, row.played_s = 0, 0.0
    if len(journal.t_ns):
        row.reversals = phases.reversals(journal.phase)
    end_feel.complete(session, row, row.end_feel, journal)


def outcome_of(journal: Journal) -> RunOutcome:
    """Return the outcome that the journal shows for its run."""
    reason = journal.end.reason if journal.end else None
    return "interrupted" if reason is None or reason == "finished" else reason


def _series(journal: Journal) -> Series:
    columns = {
        name: getattr(journal, name) for name in ("phase", "path_s", "setpoint_deg", "measured_deg", "torque_nm")
    }
    return pack({"time_s": (journal.t_ns - journal.t_ns[0]) / 1e9, **columns}, RUN_COLUMNS)


def remove_refused(session: DatabaseSession, run_id: UUID) -> None:
    """Delete a run that the device refused."""
    row = session.get(RunRow, run_id)
    if row and row.outcome == "loaded":
        _clinic_session(session, row).run_count -= 1
        session.delete(row)


def _clinic_session(session: DatabaseSession, row: RunRow) -> SessionRow:
    return session.get_one(SessionRow, row.session_id)


def _store_stop(session: DatabaseSession, row: RunRow) -> None:
    clinic_session = _clinic_session(session, row)
    clinic_session.stop_count += 1
    if row.stop_code and session.get(SessionStopRow, (clinic_session.id, row.stop_code)) is None:
        columns = {
            "started_at": clinic_session.started_at,
            "therapist": clinic_session.therapist,
            "station": clinic_session.station,
        }
        session.add(SessionStopRow(session_id=clinic_session.id, code=row.stop_code, **columns))


def mark_unended_interrupted(session: DatabaseSession, station: str, before: datetime) -> int:
    """Close the runs whose journal is lost: those that were loaded at this station before ``before`` and have not ended.

    Call it when every journal of the station's last device process has been imported. A session may have continued at another station,
    where its run is playing now; :func:`complete` still completes that run.

    :returns: the number of closed runs.
    """
    sessions_here = select(SessionRow.id).where(SessionRow.station.in_((station, "")))
    return _mark_interrupted(session, RunRow.session_id.in_(sessions_here) & (RunRow.started_at <= before))


def mark_interrupted(session: DatabaseSession, run_id: UUID) -> None:
    """Mark a run as interrupted whose journal cannot be read, unless it has ended."""
    _mark_interrupted(session, RunRow.id == run_id)


def _mark_interrupted(session: DatabaseSession, condition: ColumnElement[bool]) -> int:
    lost_runs = update(RunRow).where(RunRow.outcome == "loaded", condition)
    interrupted = lost_runs.values(outcome="interrupted", ended_at=RunRow.started_at)
    return int(session.connection().execute(interrupted).rowcount)


def figure_samples(
    session: DatabaseSession, run_id: UUID, window: Window | None = None, clock: Clock = "path"
) -> RunFigureSamples:
    """Return the data of the run's figures, or those within a window of the figures' clock.

    :raises ProblemError: 404; 409 when nothing was played; 410 when the head of the samples is damaged.
    """
    row = get(session, run_id)
    if row.samples is None:
        raise ProblemError(409, "nothing_played", texts.NOTHING_PLAYED(), texts.NOTHING_TO_COMPARE())
    settings = settings_of(row)
    overview = None if window or clock == "wall" else RUN_SAMPLES.read_overview(session, run_id)
    if overview is not None:
        return RunFigureSamples(None, None, settings, overview, None)
    taught = recordings.stored_samples(session, row.recording_id)
    if window and clock == "path":
        played = RUN_SAMPLES.read_within(session, run_id, "path_s", *window)
    else:
        # The wall clock starts where each part of the playback began, which may be before the window.
        played = RUN_SAMPLES.read(session, run_id)
    return RunFigureSamples(taught, played, settings, None, window, clock)


def samples(session: DatabaseSession, run_id: UUID) -> dict[str, Floats]:
    """Return the run's samples by name (:data:`kata.clinic.sessions.tables.RUN_COLUMNS`).

    :raises UnreadableError: when the samples are damaged or missing.
    """
    return unpack(RUN_SAMPLES.read(session, run_id))


def as_run(row: RunRow, recording_name: str | None = None, angles: PatientAngles | None = None) -> Run:
    """Return the response model.

    :param recording_name: name for a run that is not in the database yet.
    :param angles: estimates of the run's session. None: return only apparatus angles.
    """
    # A run that is not in the database yet has no recording.
    recording: RecordingRow | None = row.recording
    motors = [MotorTracking.model_validate(motor) for motor in row.tracking]
    motions = [_as_motion(row, motion, angles) for motion in row.motions]
    return Run(
        id=row.id,
        session_id=row.session_id,
        recording_id=row.recording_id,
        recording_name=recording_name or row.recording.name,
        side=side_of(recording.side) if recording else None,
        started_at=row.started_at,
        ended_at=row.ended_at,
        outcome=row.outcome,
        stop=RunStop(code=row.stop_code, message=row.stop_message or "", message_key=row.stop_key)
        if row.stop_code
        else None,
        rate_hz=row.rate_hz,
        method=row.method,
        learning=[LearningNote.model_validate(note) for note in row.learning or ()],
        resistance_level=row.resistance_level,
        **asdict(settings_of(row)),
        self_paced=row.self_paced,
        work_j=row.work_j,
        mean_effort_nm=row.mean_effort_nm,
        mean_pace_percent=row.mean_pace_percent,
        programme_position=row.programme_position,
        repetitions_done=row.repetitions_done,
        reversals=row.reversals,
        least_range_percent=row.least_range_percent,
        compared_percent=row.compared_percent,
        partial=row.partial,
        clock_offset_s=row.clock_offset_s,
        end_feel=row.end_feel.kind if row.end_feel else None,
        comparison=Comparison(samples=row.samples, motors=motors, motions=motions) if row.samples else None,
    )


def _as_motion(run: RunRow, row: MotionTrackingRow, angles: PatientAngles | None) -> MotionTracking:
    motion = MotionTracking.model_validate(row)
    patient_range = angles.of_run(run, row) if angles else None
    if patient_range:
        low, high = patient_range
        motion.patient_min_deg, motion.patient_min_uncertainty_deg = low.angle_deg, low.uncertainty_deg
        motion.patient_max_deg, motion.patient_max_uncertainty_deg = high.angle_deg, high.uncertainty_deg
    return motion
