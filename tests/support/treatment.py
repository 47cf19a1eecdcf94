"""A patient with an episode, written directly to the database, for reports."""

from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from functools import cache
from uuid import UUID, uuid4

import numpy as np
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings.tables import RECORDING_COLUMNS, RECORDING_SAMPLES, RecordingRow
from kata.clinic.sessions.tables import (
    RUN_COLUMNS,
    RUN_SAMPLES,
    AddendumRow,
    GoniometerReadingRow,
    MotionTrackingRow,
    MotorTrackingRow,
    RunRow,
    SessionRow,
)
from kata.database.series import Series, pack
from kata.device.journal import PHASE_PLAYING
from kata.motion.edit import Motion, PlaybackSettings, with_settings
from kata.motion.tracking import MotorTracking, compare

DAY = datetime(2026, 11, 2, 0, 30, tzinfo=UTC)
"""Time of the first session, half past nine in Tokyo."""


@dataclass(frozen=True)
class Texts:
    """The free texts."""

    name: str = "Yamada Hanako"
    kana: str | None = "ヤマダ ハナコ"
    recording: str = "Abduction to 90"
    note: str = "Went well.\nMore range next time."
    therapist: str = "Sato Ken"
    other: str = "Frozen shoulder"


PLAIN = Texts()


@dataclass(frozen=True)
class Treated:
    """The written records."""

    episode_id: UUID
    session_ids: tuple[UUID, ...]


def treat(session: Session, texts: Texts = PLAIN, *, sessions: int = 1, runs: int = 3, signed: bool = True) -> Treated:
    """Write a patient, an episode with two assessments, a programme of two items, and sessions three days apart."""
    patient = PatientRow(
        id=uuid4(), clinic_number=f"K-{uuid4().hex[:6]}", name=texts.name, kana=texts.kana, birth_date=date(1968, 4, 12),
        sex="female", dominant_side="right", notes="", created_at=DAY, updated_at=DAY,
    )  # fmt: skip
    episode = EpisodeRow(
        id=uuid4(), patient_id=patient.id, side="left", diagnosis=texts.other, onset_on=date(2026, 6, 1),
        contraindications=texts.other, limits=[{"motion": 4, "lowest_deg": None, "highest_deg": 95.0}], max_resistance_level=12,
        max_speed_deg_s=35.0,
        limits_by=texts.therapist, opened_at=DAY - timedelta(days=3), closing_note=texts.note, updated_at=DAY,
    )  # fmt: skip
    session.add(patient)
    session.flush()
    session.add(episode)
    session.flush()
    for stage, since in (("freezing", date(2026, 6, 1)), ("frozen", date(2026, 10, 20))):
        session.add(StageRow(id=uuid4(), episode_id=episode.id, stage=stage, since=since, noted_at=DAY))
    recording = _recording(session, patient.id, texts)
    version = _programme(session, episode.id, recording.id, texts)
    ids = tuple(
        _visit(session, patient.id, episode.id, version, recording, texts, number, runs, signed)
        for number in range(sessions)
    )
    last = DAY + timedelta(days=3 * sessions)
    _assess(session, episode.id, DAY - timedelta(days=2), 0, texts)
    _assess(session, episode.id, last, 1, texts)
    session.flush()
    return Treated(episode.id, ids)


@cache
def _motion() -> Motion:
    """Return the taught motion."""
    times = np.arange(0, 12, 0.01)
    angles = np.zeros((len(times), 5))
    angles[:, 2] = 45 * (1 - np.cos(2 * np.pi * times / 12))
    angles[:, 3] = 8 * np.sin(2 * np.pi * times / 6)
    return Motion(times, angles)


@cache
def _played(place: int) -> tuple[Motion, tuple[MotorTracking, ...], Series]:
    """Return the wanted motion of a run, how it was tracked, and its packed samples. Every patient has the same runs."""
    wanted = with_settings(_motion(), PlaybackSettings(80.0, 1, 0.0, 90.0))
    late = np.maximum(wanted.times_s - 0.05, 0)
    noise = np.random.default_rng(place).normal(0, 0.1, wanted.angles_deg.shape)
    measured = wanted.at(late) + noise
    torque_nm = np.full_like(measured, 1.2)
    columns = {
        "time_s": wanted.times_s,
        "phase": np.full(len(measured), PHASE_PLAYING),
        "path_s": wanted.times_s,
        "setpoint_deg": wanted.angles_deg,
        "measured_deg": measured,
        "torque_nm": torque_nm,
    }
    compared = compare(wanted.times_s, wanted.angles_deg, wanted.times_s, measured, torque_nm)
    return wanted, compared.motors, pack(columns, RUN_COLUMNS)


def _recording(session: Session, patient_id: UUID, texts: Texts) -> RecordingRow:
    motion = _motion()
    row = RecordingRow(
        id=uuid4(), patient_id=patient_id, name=texts.recording, side="left", station="Kata 1", taught_at=DAY,
        taught_by=texts.therapist, duration_s=float(motion.times_s[-1]), rate_hz=100, samples=len(motion.times_s), note="",
    )  # fmt: skip
    session.add(row)
    session.flush()
    packed = pack({"time_s": motion.times_s, "angle_deg": motion.angles_deg}, RECORDING_COLUMNS)
    RECORDING_SAMPLES.store(session, row.id, packed, None)
    return row


def _programme(session: Session, episode_id: UUID, recording_id: UUID, texts: Texts) -> UUID:
    programme = ProgrammeRow(id=uuid4(), episode_id=episode_id, name=texts.other, created_at=DAY, updated_at=DAY)
    session.add(programme)
    session.flush()
    version = ProgrammeVersionRow(
        id=uuid4(),
        programme_id=programme.id,
        number=2,
        made_at=DAY,
        made_by=texts.therapist,
        note="",
        timer_minutes=30.0,
    )
    session.add(version)
    session.flush()
    for position, percent in ((1, 60.0), (2, 80.0)):
        session.add(
            ProgrammeItemRow(
                version_id=version.id, position=position, recording_id=recording_id, speed_percent=percent, repetitions=3,
                pause_s=1.5, range_percent=90.0, resistance_level=8, method="learned",
            )
        )  # fmt: skip
    return version.id


def _visit(
    session: Session,
    patient_id: UUID,
    episode_id: UUID,
    version: UUID,
    recording: RecordingRow,
    texts: Texts,
    number: int,
    runs: int,
    signed: bool,
) -> UUID:
    start = DAY + timedelta(days=3 * number)
    visit = SessionRow(
        id=uuid4(), patient_id=patient_id, episode_id=episode_id, programme_version_id=version, therapist=texts.therapist,
        station="Kata 1", started_at=start, ended_at=start + timedelta(minutes=41),
        checks=[
            {"check": check, "subject": subject, "at": (start + timedelta(minutes=2)).isoformat(), "by": by}
            for check, subject, by in (
                ("identity", "birth_date+name", texts.therapist),
                ("side", "left", texts.therapist), ("fixtures", "arm_fixer_2+elbow_fixer_2", texts.therapist),
                ("belt", "", texts.therapist), ("pedal", "", ""), ("estop", "", ""),
            )
        ],
        pain_before=max(7 - number, 2), pain_during=6, pain_after=max(5 - number, 1), end_reason="completed",
        note=texts.note, signed_at=start + timedelta(hours=1) if signed else None,
        signed_by=texts.therapist if signed else "", run_count=runs, stop_count=min(runs, 1),
    )  # fmt: skip
    session.add(visit)
    session.flush()
    for minutes, apparatus_deg, patient_deg in ((3, 20.0, 26.0), (4, 80.0, 78.0)):
        session.add(
            GoniometerReadingRow(
                id=uuid4(), session_id=visit.id, motion=4, apparatus_deg=apparatus_deg, patient_deg=patient_deg,
                read_at=start + timedelta(minutes=minutes), read_by=texts.therapist,
            )
        )  # fmt: skip
    for place in range(runs):
        _run(session, visit, recording, place, start + timedelta(minutes=5 + place))
    if signed:
        session.add(
            AddendumRow(
                id=uuid4(), session_id=visit.id, written_at=start + timedelta(days=1), written_by=texts.therapist,
                text=texts.note,
            )
        )  # fmt: skip
    return visit.id


def _run(session: Session, visit: SessionRow, recording: RecordingRow, place: int, at: datetime) -> None:
    wanted, motors, samples = _played(place)
    stopped = place == 1
    row = RunRow(
        id=uuid4(), session_id=visit.id, recording_id=recording.id, programme_position=place + 1 if place < 2 else None,
        started_at=at, ended_at=at + timedelta(seconds=40), outcome="stopped" if stopped else "completed",
        stop_code="drive_silent" if stopped else None,
        stop_message="Motor 3 does not answer." if stopped else None,
        stop_key={"code": "drive_silent", "params": {"motor": 3}} if stopped else None,
        rate_hz=100, resistance_level=8, speed_percent=80.0,
        repetitions=1, pause_s=0.0, range_percent=90.0, method="learned", samples=len(wanted.times_s),
        worst_rmse_deg=max(motor.rmse_deg for motor in motors),
        worst_peak_deg=max(abs(motor.peak_deg) for motor in motors), reversals=place,
        least_range_percent=80.0 if place else None, repetitions_done=0 if stopped else 1, played_s=15.0,
    )  # fmt: skip
    session.add(row)
    session.flush()
    for motor in motors:
        session.add(
            MotorTrackingRow(
                run_id=row.id, motor=motor.motor, torque_peak_nm=motor.torque_peak_nm, peak_deg=motor.peak_deg,
                peak_at_s=motor.peak_at_s, rmse_deg=motor.rmse_deg, start_deg=motor.start_deg, lag_ms=motor.lag_ms,
                taught_min_deg=motor.taught.min_deg, taught_max_deg=motor.taught.max_deg,
                played_min_deg=motor.played.min_deg, played_max_deg=motor.played.max_deg,
            )
        )  # fmt: skip
    for number in (4, 5):
        session.add(
            MotionTrackingRow(
                run_id=row.id, motion=number, peak_deg=-1.25, peak_at_s=3.0, rmse_deg=0.75, start_deg=0.0, lag_ms=12.0,
                taught_min_deg=4.5, taught_max_deg=85.5, played_min_deg=5.0, played_max_deg=84.9,
            )
        )  # fmt: skip
    RUN_SAMPLES.store(session, row.id, samples, None)


def _assess(session: Session, episode_id: UUID, at: datetime, better: int, texts: Texts) -> None:
    row = AssessmentRow(
        id=uuid4(), episode_id=episode_id, assessed_at=at, assessed_by=texts.therapist, note=texts.note,
        pain_rest=3 - better, pain_active=7 - 2 * better, pain_passive=6, pain_average=None,
        spadi=[6 - 2 * int(better)] * 13, spadi_score=60.0 - 20 * int(better), updated_at=at,
    )  # fmt: skip
    session.add(row)
    session.flush()
    for motion, position, value in (
        ("flexion", "", 95.0), ("abduction", "", 70.0), ("external_rotation", "at_side", 15.0), ("internal_rotation", "at_side", 40.0),
    ):  # fmt: skip
        for kind, more in (("active", 0.0), ("passive", 8.0)):
            for side, own in (("left", 0.0), ("right", 25.0)):
                angle = value + more + own + 21.0 * better
                session.add(
                    RomRow(
                        assessment_id=row.id, side=side, motion=motion, kind=kind, position=position, angle_deg=angle
                    )
                )
