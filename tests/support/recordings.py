"""Recordings made through the API."""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any
from uuid import UUID, uuid4

import numpy as np
from fastapi.testclient import TestClient

from kata.clinic.recordings.tables import RECORDING_COLUMNS, RECORDING_SAMPLES, RecordingRow, TeachingRow
from kata.database.engine import Database
from kata.database.series import pack
from kata.motion.linkage import Floats, motor_angles_deg

LASTS_S = 8.0


def lifted(top_deg: float = 90.0) -> Callable[[Floats], Floats]:
    """Poses of an arm that is lifted sideways from 10 deg and lowered again, with upward rotation of the scapula."""

    def at(times_s: Floats) -> Floats:
        share = 0.5 - 0.5 * np.cos(2 * np.pi * times_s / LASTS_S)
        none = np.zeros_like(times_s)
        return np.stack([none, 10 * share, 10 + (top_deg - 10) * share, 5 * share, none], axis=1)

    return at


def taught(client: TestClient, patient: dict[str, Any], at: Callable[[Floats], Floats], **given: Any) -> dict[str, Any]:
    """Create a recording of a right shoulder as if it had been taught."""
    app: Any = client.app
    recording_id = store(app.state.services.database, patient["id"], at, **given)
    made: dict[str, Any] = client.get(f"/api/recordings/{recording_id}").json()
    return made


def store(database: Database, patient_id: str, at: Callable[[Floats], Floats], **given: Any) -> UUID:
    """Write a recording of a right shoulder to the database, and return its id."""
    times_s = np.arange(0, LASTS_S + 0.005, 0.01)
    angles_deg = motor_angles_deg(at(times_s), "right")
    common = {"patient_id": UUID(patient_id), "name": "Lift", "side": "right"} | given
    with database.write() as session:
        teaching = TeachingRow(id=uuid4(), started_at=datetime.now(UTC), **common)
        session.add(teaching)
        session.flush()
        row = RecordingRow(
            id=uuid4(), teaching_id=teaching.id, take=1, station="Station 1", taught_at=datetime.now(UTC),
            duration_s=LASTS_S, rate_hz=100, samples=len(times_s), note="", archived_at=None, **common,
        )  # fmt: skip
        session.add(row)
        session.flush()
        RECORDING_SAMPLES.store(
            session, row.id, pack({"time_s": times_s, "angle_deg": angles_deg}, RECORDING_COLUMNS), None
        )
    return row.id
