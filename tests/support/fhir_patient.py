"""A patient with a history, written directly to the database, for exports."""

from datetime import UTC, date, datetime, timedelta
from uuid import UUID, uuid4

import numpy as np
from sqlalchemy.orm import Session

from kata.clinic.assessments.rom import MEASURES
from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings.tables import RECORDING_COLUMNS, RecordingRow, RecordingSamplesRow, TeachingRow
from kata.clinic.sessions import tables as visits
from kata.clinic.sessions.tables import (
    AddendumRow,
    GoniometerReadingRow,
    MotionTrackingRow,
    MotorTrackingRow,
    RunRow,
    SessionRow,
)
from kata.database import arrays
from kata.database.engine import Database
from kata.device.journal import PHASE_PLAYING
from kata.motion.linkage import Floats

BEGAN = datetime(2026, 4, 6, 9, 0, tzinfo=UTC)
NAME, KANA, NUMBER = "山田 花子", "ヤマダ ハナコ", "K-0042"
_TRACKING = {"peak_deg": -1.5, "peak_at_s": 2.0, "rmse_deg": 0.4, "start_deg": 0.1, "lag_ms": 12.0}
_RANGES = {"taught_min_deg": 5.0, "taught_max_deg": 90.0, "played_min_deg": 5.2, "played_max_deg": 89.5}


def treated(database: Database, sessions: int = 50, number: str = NUMBER) -> UUID:
    """Write an episode, a programme in two versions, assessments, and sessions of two runs each."""
    patient = PatientRow(
        id=uuid4(), clinic_number=number, name=NAME, kana=KANA, birth_date=date(1968, 4, 12), sex="female",
        dominant_side="right", notes="Mrs Yamada plays the koto.", created_at=BEGAN, updated_at=BEGAN,
    )  # fmt: skip
    episode = EpisodeRow(
        id=uuid4(), patient_id=patient.id, side="left", diagnosis="Frozen shoulder of Mrs Yamada", onset_on=date(2026, 1, 10),
        contraindications="None known to Mrs Yamada.", limits=[{"motion": 4, "lowest_deg": None, "highest_deg": 90.0}],
        max_resistance_level=12, max_speed_deg_s=45.5, limits_by="Dr Ito", opened_at=BEGAN, updated_at=BEGAN,
    )  # fmt: skip
    common = {"patient_id": patient.id, "name": "Lift of Mrs Yamada", "side": "left"}
    teaching = TeachingRow(id=uuid4(), started_at=BEGAN, **common)
    recording = RecordingRow(
        id=uuid4(), teaching_id=teaching.id, take=1, station="Room 1", taught_at=BEGAN, duration_s=2.0, rate_hz=100,
        samples=201, note="Mrs Yamada was afraid at first.", **common,
    )  # fmt: skip
    programme = ProgrammeRow(id=uuid4(), episode_id=episode.id, name="Yamada daily", created_at=BEGAN, updated_at=BEGAN)
    times_s = np.arange(201) / 100
    angles = np.repeat(20 + 10 * np.sin(times_s)[:, None], 5, axis=1)
    with database.write() as session:
        session.add(patient)
        session.flush()
        session.add_all([episode, teaching])
        session.flush()
        session.add_all([recording, programme])
        for stage, day in (("freezing", date(2026, 2, 1)), ("frozen", date(2026, 5, 20))):
            session.add(StageRow(id=uuid4(), episode_id=episode.id, stage=stage, since=day, noted_at=BEGAN))
        session.flush()
        data = arrays.encode({"time_s": times_s, "angle_deg": angles}, RECORDING_COLUMNS)
        session.add(RecordingSamplesRow(recording_id=recording.id, data=data))
        versions = []
        for version in (1, 2):
            row = ProgrammeVersionRow(
                id=uuid4(), programme_id=programme.id, number=version, made_at=BEGAN + timedelta(days=version),
                made_by="Suzuki Aya", note="As Mrs Yamada asked." if version == 2 else "", timer_minutes=20.0,
                sessions_per_week=3 if version == 2 else None,
            )  # fmt: skip
            session.add(row)
            session.flush()
            session.add(
                ProgrammeItemRow(
                    version_id=row.id, position=1, recording_id=recording.id, speed_percent=80.0, repetitions=10,
                    pause_s=2.0, range_percent=90.0, resistance_level=8, method="learned",
                )
            )  # fmt: skip
            versions.append(row.id)
        for visit in range(sessions):
            _visit(session, patient.id, episode.id, recording.id, versions[visit % 2], visit, (times_s, angles))
            if visit % 10 == 0:
                _assess(session, episode.id, visit)
    return patient.id


def _visit(
    session: Session,
    patient: UUID,
    episode: UUID,
    recording: UUID,
    version: UUID,
    number: int,
    samples: tuple[Floats, Floats],
) -> None:
    began = BEGAN + timedelta(days=number)
    row = SessionRow(
        id=uuid4(), patient_id=patient, episode_id=episode, programme_version_id=version, therapist="Suzuki Aya",
        station="Room 1" if number % 3 else "Room 2", started_at=began, ended_at=began + timedelta(minutes=25),
        pain_before=5, pain_during=None if number % 2 else 6, pain_after=3, end_reason="completed",
        note=f"Visit {number}: Mrs Yamada did well.", signed_at=began + timedelta(minutes=30), signed_by="Suzuki Aya",
    )  # fmt: skip
    session.add(row)
    session.flush()
    if number == 0:
        session.add(
            AddendumRow(id=uuid4(), session_id=row.id, written_at=began, written_by="Dr Ito", text="Seen by me.")
        )
        session.add_all(
            GoniometerReadingRow(
                id=uuid4(), session_id=row.id, motion=4, apparatus_deg=apparatus_deg, patient_deg=patient_deg,
                read_at=began + timedelta(minutes=2), read_by="Suzuki Aya",
            )
            for apparatus_deg, patient_deg in ((20.0, 26.0), (80.0, 78.0))
        )  # fmt: skip
        event = {"kind": "event", "code": "paused", "message": "Paused.", "patient_id": patient, "session_id": row.id}
        session.add(DeviceEventRow(id=uuid4(), station="Room 1", at=began, **event))
    times_s, angles = samples
    for place in (1, 2):
        outcome = "stopped" if (number, place) == (3, 2) else "completed"
        run = RunRow(
            id=uuid4(), session_id=row.id, recording_id=recording, programme_position=1,
            started_at=began + timedelta(minutes=5 * place), ended_at=began + timedelta(minutes=5 * place + 4),
            outcome=outcome, stop_code="estop" if outcome == "stopped" else None, rate_hz=100, resistance_level=8, method="learned",
            repetitions=10, samples=201, worst_rmse_deg=0.4, worst_peak_deg=1.5,
        )  # fmt: skip
        session.add(run)
        session.flush()
        session.add_all(MotorTrackingRow(run_id=run.id, motor=motor, **_TRACKING, **_RANGES) for motor in range(1, 6))
        session.add_all(
            MotionTrackingRow(run_id=run.id, motion=motion, **_TRACKING, **_RANGES) for motion in range(1, 7)
        )
        if number == 0:
            columns = {
                "time_s": times_s, "phase": np.full(201, PHASE_PLAYING), "path_s": times_s, "setpoint_deg": angles,
                "measured_deg": angles, "torque_nm": angles,
            }  # fmt: skip
            data = arrays.encode(columns, visits.RUN_COLUMNS)
            session.add(visits.RunSamplesRow(run_id=run.id, data=data))


def _assess(session: Session, episode: UUID, number: int) -> None:
    at = BEGAN + timedelta(days=number, hours=1)
    withdrawn = at if number == 10 else None
    row = AssessmentRow(
        id=uuid4(), episode_id=episode, assessed_at=at, assessed_by="Kimura Jun", note="Mrs Yamada slept badly.",
        pain_rest=2, pain_active=5, pain_passive=4, pain_average=3,
        spadi=[7, 8, 6, 5, 4, 5, 7, 4, 3, 3, 6, 7, None], spadi_score=54.6, updated_at=at, withdrawn_at=withdrawn,
    )  # fmt: skip
    row.rom = [
        RomRow(
            side=side, motion=measure.motion, kind=kind, position=measure.position, angle_deg=measure.reference_deg / 2
        )
        for measure in MEASURES
        for side in ("left", "right")
        for kind in ("active", "passive")
    ]
    session.add(row)
