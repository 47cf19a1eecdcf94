"""Creates the records of a benchmark through the clinic's own functions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path
from typing import Final, Literal
from uuid import UUID, uuid4

import numpy as np

from kata.bench.account import sign_in_cookie
from kata.clinic.importer import Importer, Saved
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.recordings.tables import TeachingRow
from kata.clinic.sessions import runs
from kata.clinic.sessions import service as sessions
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from kata.device import journal
from kata.device.config import StationConfig
from kata.device.journal import JournalDisk, JournalEnd, JournalHeader, JournalWriter
from kata.motion.axes import CANONICAL_SIDE

_RATE_HZ: Final = 100
_SWING_DEG: Final = 10.0
_PERIOD_S: Final = 8.0
_ROWS_A_FLUSH: Final = 5000
"""Number of rows between two flushes. It is lower than the capacity of a journal's ring buffer."""


@dataclass(frozen=True)
class BenchRecords:
    """The records of a benchmark in the database."""

    patient_id: UUID
    session_id: UUID
    recording_id: UUID
    """Recording for playback. It begins at the arm's rest pose and moves all five axes."""
    run_id: UUID
    """Run for plotting."""
    cookie: str
    """``Cookie`` header of a login session."""
    database_url: str | None = None
    """None: the database is a file in the service's folder."""


def make_records(
    data: Path, rest_deg: Sequence[float], *, play_s: float, plot_s: float, database_url: str | None = None
) -> BenchRecords:
    """Create a patient with a recording of ``play_s`` to play and a run of ``plot_s`` to plot. ``rest_deg``: motor angles.

    Without ``database_url``, the database is a file in ``data``.
    """
    folder = data / "journal"
    folder.mkdir(parents=True)
    database = Database(database_url or f"sqlite:///{data / 'kata.db'}")
    try:
        upgrade(database)
        return replace(_Records(database, folder, rest_deg).make(play_s, plot_s), database_url=database_url)
    finally:
        database.close()


class _Records:
    def __init__(self, database: Database, folder: Path, rest_deg: Sequence[float]) -> None:
        self._database = database
        self._folder = folder
        self._rest_deg = np.array(rest_deg)
        axes = StationConfig().axes
        middle_deg = np.array([(axis.min_deg + axis.max_deg) / 2 for axis in axes])
        self._swing_deg = np.where(middle_deg >= self._rest_deg, _SWING_DEG, -_SWING_DEG)
        self._saved: list[Saved] = []
        self._importer = Importer(database, folder, StationConfig(), self._saved.append)

    def make(self, play_s: float, plot_s: float) -> BenchRecords:
        with self._database.write() as session:
            patient = PatientCreate(
                clinic_number=f"BENCH-{uuid4().hex[:8]}", name="Benchmark", affected_side=CANONICAL_SIDE
            )
            patient_id = patients.create(session, patient).id
            visit_id = sessions.begin(session, patient_id).id
        playback_id = self._recording(patient_id, play_s)
        plotted_id = self._recording(patient_id, plot_s)
        with self._database.write() as session:
            run_id = runs.begin(session, runs.RunRequest(visit_id, plotted_id)).id
        self._journal("run", run_id, plot_s, JournalEnd(reason="completed"))
        return BenchRecords(patient_id, visit_id, playback_id, run_id, sign_in_cookie(self._database))

    def _recording(self, patient_id: UUID, duration_s: float) -> UUID:
        row = TeachingRow(
            id=uuid4(), patient_id=patient_id, name="Benchmark", side=CANONICAL_SIDE, started_at=utc_now()
        )
        with self._database.write() as session:
            session.add(row)
        self._journal("teaching", row.id, duration_s, JournalEnd(reason="finished"))
        return self._saved[-1].id

    def _journal(self, kind: Literal["teaching", "run"], journal_id: UUID, duration_s: float, end: JournalEnd) -> None:
        header = JournalHeader(
            kind=kind,
            id=str(journal_id),
            recording_id=None,
            station="Benchmark",
            rate_hz=_RATE_HZ,
            started_at=utc_now() - timedelta(seconds=duration_s),
            started_ns=0,
        )
        writer = JournalWriter(self._folder, header, JournalDisk())
        for n in range(round(duration_s * _RATE_HZ) + 1):
            time_s = n / _RATE_HZ
            angle_rad = 2 * np.pi * time_s / _PERIOD_S
            setpoint = (self._rest_deg + self._swing_deg * (1 - np.cos(angle_rad)) / 2).tolist()
            # Like a real arm, follow the setpoint with a small, varying error.
            measured = setpoint if kind == "teaching" else [angle - 0.4 * np.sin(angle_rad) for angle in setpoint]
            phase = 0 if kind == "teaching" else journal.PHASE_PLAYING
            writer.append_sample(
                journal.Sample(
                    t_ns=n * (1_000_000_000 // _RATE_HZ),
                    take=1,
                    phase=phase,
                    path_s=time_s,
                    setpoint_deg=setpoint,
                    measured_deg=measured,
                    torque_nm=[0.0] * len(setpoint),
                )
            )
            if n % _ROWS_A_FLUSH == 0:
                writer.write()
        writer.finish(end)
        writer.write()
        writer.sync()
        self._importer.run(writer.path)
