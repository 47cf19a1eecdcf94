"""A database with two invented patients and their history, and with figures of a larger clinic."""

from datetime import datetime, timedelta
from functools import cache
from pathlib import Path
from string import ascii_uppercase
from tempfile import TemporaryDirectory
from typing import Final
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.cli.seed import fill
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.statistics import derived_tables, parts
from kata.clinic.statistics.schemas import LEAST_SHOWN
from kata.clinic.statistics.tables import StationHourRow
from kata.database.base import utc_now
from kata.database.engine import Database
from tests.support.databases import upgraded_file

_DRIFTING: Final = "Station 3"


def invented_file(file: Path) -> str:
    """Create the database at this path and return its URL."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(_invented())
    return f"sqlite:///{file}"


@cache
def _invented() -> bytes:
    with TemporaryDirectory() as folder:
        file, now = Path(folder) / "kata.db", utc_now()
        database = Database(upgraded_file(file))
        fill(database, 1, now, patients=2)
        with database.write() as session:
            _make_due(session)
            for number in range(LEAST_SHOWN):
                _add_outcome(session, number, now)
            _let_drift(session, now)
        database.close()
        return file.read_bytes()


def _make_due(session: Session) -> None:
    """Prescribe a session a day to the first patient, whose last session was yesterday."""
    episode = select(EpisodeRow.id).join(PatientRow).where(PatientRow.clinic_number == "DEMO-001")
    programmes = select(ProgrammeRow.id).where(ProgrammeRow.episode_id.in_(episode))
    for version in session.scalars(select(ProgrammeVersionRow).where(ProgrammeVersionRow.programme_id.in_(programmes))):
        version.sessions_per_week = 7


def _add_outcome(session: Session, number: int, now: datetime) -> None:
    """Add a patient whose SPADI improved by ``4 * number`` points in the month before last."""
    at = now - timedelta(days=60)
    patient = PatientRow(
        id=uuid4(), clinic_number=f"EXTRA-{number}", name=f"Invented {ascii_uppercase[number]}", sex="female", notes="",
        created_at=at, updated_at=at,
    )  # fmt: skip
    episode = EpisodeRow(id=uuid4(), patient_id=patient.id, side="left", limits_by="", opened_at=at, updated_at=at)
    session.add(patient)
    session.flush()
    session.add(episode)
    session.flush()
    for days, score in ((0, 60.0), (30, 60.0 - 4 * number)):
        when = at + timedelta(days=days)
        session.add(
            AssessmentRow(
                id=uuid4(), episode_id=episode.id, assessed_at=when, assessed_by="", note="", spadi_score=score,
                updated_at=when,
            )
        )  # fmt: skip


def _let_drift(session: Session, now: datetime) -> None:
    """Let the tracking error of a station grow in the last weeks."""
    rows = [
        {
            "hour": parts.begin_of(now - timedelta(days=days)), "station": _DRIFTING, "sessions": 10, "playbacks": 20,
            "stopped": 0, "played_s": 60.0, "repetitions": 20, "compared": 20, "rmse_sum_deg": 20 * mean_deg,
            # A standard deviation of 0.1 deg.
            "rmse_square_sum_deg2": 20 * (mean_deg**2 + 0.01), "peak_deg": 2.0,
        }
        for days, mean_deg in ((7, 1.0), (60, 0.7))
    ]  # fmt: skip
    derived_tables.upsert(session, StationHourRow, rows)
