"""Motions with a known scapulohumeral rhythm."""

from typing import Any, Final
from uuid import UUID

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from kata.clinic.recordings.tables import (
    RECORDING_COLUMNS,
    RECORDING_SAMPLES,
    RecordingSampleBlockRow,
    RecordingSamplesRow,
)
from kata.clinic.sessions.tables import RUN_COLUMNS, RUN_SAMPLES, RunRow, RunSampleBlockRow, RunSamplesRow
from kata.database.series import pack
from kata.motion.axes import POSE_COLUMNS, Side
from kata.motion.linkage import Floats, motor_angles_deg

RATE_HZ: Final = 100


def wave(low_deg: float, high_deg: float, lasts_s: float, times: int = 1) -> Floats:
    """Return an angle that goes from low to high and back, ``times`` times."""
    at = np.arange(int(lasts_s * RATE_HZ) * times + 1) / (lasts_s * RATE_HZ)
    found: Floats = low_deg + (high_deg - low_deg) * (1 - np.cos(2 * np.pi * at)) / 2
    return found


def abduction(elevation: Floats, scapula: Floats) -> Floats:
    """Return poses of pure abduction with this elevation of the arm and this upward rotation of the scapula."""
    zero = np.zeros_like(elevation)
    return np.column_stack([zero, scapula, elevation - scapula, zero, zero])


def times_of(poses: Floats) -> Floats:
    """Return the times of poses, seconds."""
    found: Floats = np.arange(len(poses)) / RATE_HZ
    return found


def evenly(elevation: Floats, ratio: float) -> Floats:
    """Return poses of abduction with this ratio at every elevation."""
    return abduction(elevation, (elevation - elevation[0]) / (1 + ratio))


def as_csv(poses: Floats) -> str:
    """Return poses as a motion's CSV."""
    rows = [",".join(f"{value:.4f}" for value in row) for row in np.column_stack([times_of(poses), poses])]
    return "\n".join([",".join(("time_s", *POSE_COLUMNS)), *rows]) + "\n"


def store_poses(session: Session, run: RunRow, poses: Floats, phase: int, side: Side) -> None:
    """Replace the samples of a run and of its recording by these poses; all samples have this phase."""
    motors = motor_angles_deg(poses, side)
    run_id, recording_id = run.id, run.recording_id
    for rows, key, own in (
        (RunSampleBlockRow, "run_id", run_id),
        (RunSamplesRow, "run_id", run_id),
        (RecordingSampleBlockRow, "recording_id", recording_id),
        (RecordingSamplesRow, "recording_id", recording_id),
    ):
        session.query(rows).filter_by(**{key: own}).delete()
    session.flush()
    session.expunge_all()
    times = times_of(poses)
    played: dict[str, NDArray[Any]] = {
        "time_s": times,
        "phase": np.full(len(times), phase, dtype=np.uint8),
        "path_s": times,
        "setpoint_deg": motors,
        "measured_deg": motors,
        "torque_nm": np.zeros_like(motors),
    }
    RUN_SAMPLES.store(session, run_id, pack(played, RUN_COLUMNS), None)
    RECORDING_SAMPLES.store(
        session, recording_id, pack({"time_s": times, "angle_deg": motors}, RECORDING_COLUMNS), None
    )


def damage(session: Session, recording_id: UUID) -> None:
    """Damage the samples of a recording."""
    session.query(RecordingSamplesRow).filter_by(recording_id=recording_id).update({"data": b"damaged"})
