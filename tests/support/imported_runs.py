"""A clinic whose journals the importer reads."""

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from uuid import UUID, uuid4

import numpy as np
from sqlalchemy import func, select

from kata.clinic.importer import Importer, Saved
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.sessions import runs
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.tables import RunRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device import journal
from kata.device.config import StationConfig
from kata.device.journal import JournalDisk, JournalEnd, JournalHeader, JournalWriter
from kata.motion.axes import Side
from kata.motion.edit import AS_TAUGHT, PlaybackSettings
from kata.motion.linkage import motor_angles_deg
from kata.motion.method import Method

STARTED = datetime(2026, 11, 21, 9, 0, tzinfo=UTC)


class Clinic:
    """A database with a patient, and journals like those of a device."""

    def __init__(self, folder: Path, database: Database) -> None:
        self.folder = folder / "journal"
        self.folder.mkdir()
        self.database = database
        self.saved: list[Saved] = []
        self.importer = Importer(self.database, self.folder, StationConfig(), self.saved.append)
        with self.database.write() as session:
            new = PatientCreate(clinic_number="1", name="N", affected_side="right")
            self.patient_id = patients.create(session, new).id

    def begin_teaching(self, side: Side = "right") -> UUID:
        row = TeachingRow(id=uuid4(), patient_id=self.patient_id, name="Flexion", side=side, started_at=utc_now())
        with self.database.write() as session:
            session.add(row)
        return row.id

    def begin_run(self, recording_id: UUID, asked: PlaybackSettings = AS_TAUGHT, method: Method = "smooth") -> UUID:
        with self.database.write() as session:
            visit = sessions.begin(session, self.patient_id, station="Station 1")
            row = runs.begin(
                session, runs.RunRequest(visit.id, recording_id, settings=asked, method=method), "Station 1"
            )
            return row.id

    def journal(
        self,
        kind: str,
        identity: UUID,
        takes: list[float],
        *,
        error_deg: float = 0.0,
        end: JournalEnd | None = None,
        at: Callable[[float], Sequence[float]] = lambda time_s: [10 * time_s] * 5,
        torque_nm: Sequence[float] | Callable[[float], Sequence[float]] = (0.0,) * 5,
    ) -> Path:
        """``takes``: their lengths in seconds; a run has one. ``at``: the arm's angles. ``torque_nm``: the drives' torques, also over the time."""
        header = JournalHeader(
            kind="teaching" if kind == "teaching" else "run",
            id=str(identity), recording_id=None, station="Station 1", rate_hz=100, started_at=STARTED, started_ns=0,
        )  # fmt: skip
        writer = JournalWriter(self.folder, header, JournalDisk())
        t_ns = 5_000_000_000
        for take, seconds in enumerate(takes, start=1):
            for n in range(round(seconds * 100) + 1):
                writer.append_sample(
                    journal.Sample(
                        t_ns=t_ns,
                        take=take,
                        phase=journal.PHASE_PLAYING if kind == "run" else 0,
                        path_s=n / 100,
                        setpoint_deg=at(n / 100),
                        measured_deg=[angle + error_deg for angle in at(n / 100)],
                        torque_nm=torque_nm(n / 100) if callable(torque_nm) else torque_nm,
                    )
                )
                t_ns += 10_000_000
            t_ns += 1_000_000_000
        if end:
            writer.finish(end)
        writer.write()
        return writer.path

    def count(self, table: type[RecordingRow] | type[RunRow]) -> int:
        with self.database.read() as session:
            return session.scalar(select(func.count()).select_from(table)) or 0

    def recording(
        self,
        seconds: float = 2.0,
        at: Callable[[float], Sequence[float]] = lambda time_s: [10 * time_s] * 5,
        side: Side = "right",
    ) -> UUID:
        """Teach a motion of one take and return its recording. ``at``: the arm's angles."""
        self.journal("teaching", self.begin_teaching(side), [seconds], end=JournalEnd(reason="finished"), at=at)
        self.importer.run()
        return self.saved[-1].id


def pose(time_s: float) -> list[float]:
    """Return motor angles of an arm that is lifted sideways and back, with upward rotation of the scapula."""
    share = 0.5 - 0.5 * np.cos(2 * np.pi * time_s / 4)
    return [float(angle) for angle in motor_angles_deg([0.0, 10 * share, 10 + 80 * share, 0.0, 0.0])]
