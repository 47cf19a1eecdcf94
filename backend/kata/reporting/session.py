"""Read the content of a session's report."""

from collections.abc import Iterator
from datetime import date, datetime, tzinfo
from uuid import UUID

from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes import adherence, planned
from kata.clinic.programmes.adherence import AdherenceWeek, EndRangeDone
from kata.clinic.programmes.tables import ProgrammeVersionRow
from kata.clinic.sessions import end_feel, patient_angles, runs
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.patient_angles import PatientAngles
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.clinic.sessions.tables import (
    EndFeelRow,
    GoniometerReadingRow,
    MotionTrackingRow,
    MotorTrackingRow,
    RunRow,
    SessionRow,
)
from kata.motion.edit import PlaybackSettings
from kata.reporting.content import (
    Check,
    MotionReach,
    MotorErrors,
    PlannedItem,
    PlaybackDescription,
    PrintedAddendum,
    PrintedDose,
    PrintedEndFeel,
    PrintedEndRange,
    PrintedPlan,
    PrintedReading,
    PrintedStop,
    ReportPatient,
    RunContent,
    SessionContent,
    motor_of,
)


def read_content(session: DatabaseSession, session_id: UUID, zone: tzinfo) -> SessionContent:
    """Return the content of the report.

    :param zone: the clinic's time zone. It determines the session's week.
    :raises ProblemError: 404.
    """
    row = sessions.get(session, session_id)
    episode = session.get(EpisodeRow, row.episode_id) if row.episode_id else None
    angles = patient_angles.of_session(row)
    runs = tuple(_run(session, run, number, angles) for number, run in enumerate(row.runs, start=1))
    return SessionContent(
        patient=report_patient(row.patient),
        side=row.side,
        diagnosis=episode.diagnosis if episode else "",
        diagnosis_code=episode.diagnosis_code if episode else "",
        verification=episode.verification if episode else "",
        started_at=row.started_at,
        ended_at=row.ended_at,
        end_reason=row.end_reason,
        therapist=row.therapist,
        station=row.station,
        simulated=row.simulated,
        checks=tuple(_check(check) for check in row.checks),
        pain_before=row.pain_before,
        pain_during=row.pain_during,
        pain_after=row.pain_after,
        plan=_plan(session, row),
        runs=runs,
        readings=tuple(_reading(reading) for reading in row.goniometer_readings),
        note=row.note,
        signed_at=row.signed_at,
        signed_by=row.signed_by,
        addenda=tuple(PrintedAddendum(added.written_at, added.written_by, added.text) for added in row.addenda),
        doses=tuple(_doses(session, row, zone)),
    )


def report_patient(row: PatientRow) -> ReportPatient:
    """Return the patient in the form that a report needs."""
    return ReportPatient(row.name, row.kana, row.clinic_number, row.birth_date, row.sex)


def _check(stored: dict[str, str]) -> Check:
    return Check(stored["check"], stored["subject"], datetime.fromisoformat(stored["at"]), stored["by"])


def _plan(session: DatabaseSession, row: SessionRow) -> PrintedPlan | None:
    version = session.get(ProgrammeVersionRow, row.programme_version_id) if row.programme_version_id else None
    if version is None:
        return None
    plan = planned.of_session(session, row.id)
    numbers = {run.id: number for number, run in enumerate(row.runs, start=1)}
    items = tuple(
        PlannedItem(
            item.position,
            item.recording_name,
            PlaybackDescription(
                PlaybackSettings(item.speed_percent, item.repetitions, item.pause_s, item.range_percent),
                item.resistance_level,
                item.method,
                item.self_paced,
            ),
            item.repetitions_done,
            tuple((numbers[run.run_id], run.outcome) for run in item.runs),
        )
        for item in plan.items
    )
    besides = tuple(numbers[run.run_id] for run in plan.besides)
    return PrintedPlan(version.programme.name, version.number, version.made_by, version.timer_minutes, items, besides)


def _doses(session: DatabaseSession, row: SessionRow, zone: tzinfo) -> Iterator[PrintedDose]:
    version = session.get(ProgrammeVersionRow, row.programme_version_id) if row.programme_version_id else None
    prescribed = (
        [EndRangePrescription.model_validate(item.end_range) for item in version.items if item.end_range]
        if version
        else []
    )
    if not prescribed or row.episode_id is None:
        return
    for week in adherence.of_episode(session, row.episode_id, zone).weeks:
        for of_session in week.end_range_sessions:
            for done in of_session.motions if of_session.session_id == row.id else ():
                items = [item for item in prescribed if item.motion == done.motion]
                yield PrintedDose(
                    tuple(dict.fromkeys((item.band_deg, item.torque_nm) for item in items)),
                    printed_end_range(row.started_at, done),
                    next(of_week for of_week in end_range_of(week) if of_week.motion == done.motion),
                )


def end_range_of(week: AdherenceWeek) -> list[PrintedEndRange]:
    """Return the end-range times of a week."""
    return [printed_end_range(week.begins_on, done) for done in week.end_range]


def printed_end_range(begins: datetime | date, done: EndRangeDone) -> PrintedEndRange:
    """Return an end-range time in the form that a report needs."""
    return PrintedEndRange(begins, done.motion, done.counted_s, done.prescribed_s)


def _reading(row: GoniometerReadingRow) -> PrintedReading:
    return PrintedReading(row.motion, row.apparatus_deg, row.patient_deg, row.read_at, row.read_by)


def _run(session: DatabaseSession, row: RunRow, number: int, angles: PatientAngles) -> RunContent:
    return RunContent(
        number=number,
        recording=row.recording.name,
        side=row.recording.side,
        started_at=row.started_at,
        ended_at=row.ended_at,
        outcome=row.outcome,
        stop=PrintedStop(row.stop_code, row.stop_message or "", motor_of(row.stop_key)) if row.stop_code else None,
        playback_settings=PlaybackDescription(runs.settings_of(row), row.resistance_level, row.method, row.self_paced),
        rate_hz=row.rate_hz,
        reversals=row.reversals,
        least_range_percent=row.least_range_percent,
        compared_percent=row.compared_percent,
        partial=row.partial,
        clock_offset_s=row.clock_offset_s,
        work_j=row.work_j,
        mean_effort_nm=row.mean_effort_nm,
        mean_pace_percent=row.mean_pace_percent,
        worst_rmse_deg=max((motor.rmse_deg for motor in row.tracking), default=None),
        worst_peak_deg=max((abs(motor.peak_deg) for motor in row.tracking), default=None),
        motors=tuple(_motor(motor) for motor in row.tracking),
        motions=tuple(_motion(motion, row, angles) for motion in row.motions),
        end_feel=_end_feel(row.end_feel) if row.end_feel else None,
        parts=None if row.samples is None else runs.figure_samples(session, row.id),
    )


def _end_feel(row: EndFeelRow) -> PrintedEndFeel:
    measured = row.range_deg is not None and row.interval_range_deg is not None
    return PrintedEndFeel(
        kind=row.kind,
        motion=row.motion,
        torque_nm=row.torque_nm,
        unmeasured=row.unmeasured,
        range_deg=(row.outward * (row.range_deg or 0.0), row.interval_range_deg or 0.0) if measured else None,
        onset_deg=None if row.onset_deg is None else row.outward * row.onset_deg,
        stiffness_nm_deg=row.stiffness_nm_deg,
        outward=row.outward,
        curve=end_feel.curve_of(row) if row.kind == "test" else None,
        held_s=row.held_s,
    )


def _motor(row: MotorTrackingRow) -> MotorErrors:
    return MotorErrors(
        motor=row.motor,
        peak_deg=row.peak_deg,
        rmse_deg=row.rmse_deg,
        start_deg=row.start_deg,
        wall_peak_deg=row.wall_peak_deg,
        change_deg=row.change_deg,
        lag_ms=row.lag_ms,
        torque_peak_nm=row.torque_peak_nm,
    )


def _motion(row: MotionTrackingRow, run: RunRow, angles: PatientAngles) -> MotionReach:
    return MotionReach(
        row.motion,
        row.peak_deg,
        row.rmse_deg,
        _ends(row.taught_min_deg, row.taught_max_deg),
        _ends(row.played_min_deg, row.played_max_deg),
        (row.reference_min_deg, row.reference_max_deg),
        angles.of_run(run, row),
        row.end_range_s,
        _ends(row.end_range_band_deg, row.end_range_torque_nm),
    )


def _ends(low: float | None, high: float | None) -> tuple[float, float] | None:
    return None if low is None or high is None else (low, high)
