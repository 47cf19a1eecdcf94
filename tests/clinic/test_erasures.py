"""Erasure on both databases removes every word that identifies the patient, and keeps every figure."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import false, select
from sqlalchemy.orm import Session

import kata.clinic.tables
from kata.clinic.assessments import service as assessments
from kata.clinic.assessments.schemas import AssessmentUpdate
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.episodes import service as episodes
from kata.clinic.episodes.schemas import EpisodeUpdate
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import ErasureRow
from kata.clinic.programmes import service as programmes
from kata.clinic.programmes.schemas import ProgrammeUpdate
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.schemas import RecordingUpdate
from kata.clinic.recordings.tables import RecordingRow
from kata.database.base import Base
from kata.database.engine import Database
from kata.errors import ProblemError
from kata.interop import erasures, exported_statements
from kata.interop.schemas import ErasureConsent, ErasureRefusal, ErasureRequest
from tests.support.fhir_bundle import exported
from tests.support.fhir_patient import KANA, NAME, NUMBER, treated

TELLING = ("Yamada", NAME, KANA, NUMBER, "koto", "1968-04-12", "19680412")
FIGURES = (
    "rom_measurements",
    "stages",
    "motor_tracking",
    "motion_tracking",
    "run_samples",
    "recording_samples",
    "runs",
)


def rows(session: Session, table: str) -> list[tuple[Any, ...]]:
    return sorted((tuple(row) for row in session.execute(select(Base.metadata.tables[table]))), key=repr)


def written_texts(session: Session) -> list[str]:
    """Return every row of every table that identifies the patient."""
    assert kata.clinic.tables.__all__
    text = [f"{table}: {row!s}" for table in Base.metadata.tables for row in rows(session, table)]
    return [line for line in text if any(word in line or "datetime.date(1968, 4, 12)" in line for word in TELLING)]


def test_erasure_removes_every_identifier_and_preserves_every_figure(database: Database) -> None:
    patient_id = treated(database, sessions=3)
    with database.write() as session:
        requested = erasures.request(session, patient_id, ErasureRequest(reason="Mrs Yamada asked.", noted_by="S"))
        erasures.refuse(session, requested.id, ErasureRefusal(explanation="Mrs Yamada owes us.", decided_by="K"))
        requested = erasures.request(session, patient_id, ErasureRequest(reason="Mrs Yamada paid.", noted_by="S"))
    with database.read() as session:
        assert {line.partition(":")[0] for line in written_texts(session)} == {
            "patients", "episodes", "programmes", "programme_versions", "assessments", "sessions", "teachings", "recordings",
            "erasures",
        }  # fmt: skip
        before = {table: rows(session, table) for table in FIGURES}
    with database.write() as session:
        erasures.erase(
            session, requested.id, ErasureConsent(clinic_number=NUMBER, explanation="Granted.", decided_by="K")
        )
    with database.read() as session:
        assert written_texts(session) == []
        assert {table: rows(session, table) for table in FIGURES} == before
        assert [row.explanation for row in erasures.of_patient(session, patient_id)] == ["", "Granted."]


def test_nothing_is_written_any_more_about_who_was_erased(database: Database) -> None:
    patient_id = treated(database, sessions=1)
    with database.write() as session:
        requested = erasures.request(session, patient_id, ErasureRequest(reason="Asked.", noted_by="S"))
        erasures.erase(
            session, requested.id, ErasureConsent(clinic_number=NUMBER, explanation="Granted.", decided_by="K")
        )
    with database.read() as session:
        keys = {table: session.scalars(select(table.id)).one() for table in (RecordingRow, EpisodeRow, ProgrammeRow)}
        found = session.scalars(select(AssessmentRow)).one()
        seen = found.updated_at
    writing: list[Callable[[Session], object]] = [
        lambda session: recordings.update(session, keys[RecordingRow], RecordingUpdate(note="Mrs Yamada")),
        lambda session: episodes.change(session, keys[EpisodeRow], EpisodeUpdate(diagnosis="Mrs Yamada")),
        lambda session: programmes.update(session, keys[ProgrammeRow], ProgrammeUpdate(name="Mrs Yamada")),
        lambda session: assessments.change(session, found.id, AssessmentUpdate(note="Mrs Yamada", updated_at=seen)),
    ]
    for write in writing:
        with pytest.raises(ProblemError) as refused, database.write() as session:
            write(session)
        assert refused.value.code == "erased"


def test_erasure_affects_only_the_requested_patient(database: Database, tmp_path: Path) -> None:
    first, second = treated(database, sessions=1), treated(database, sessions=1, number="K-0043")
    for patient_id in (first, second):
        exported(database, patient_id, tmp_path / "bundle.json")
    with database.write() as session:
        requested = erasures.request(session, first, ErasureRequest(reason="By letter.", noted_by="S"))
        erasures.request(session, second, ErasureRequest(reason="By letter.", noted_by="S"))
        erasures.erase(session, requested.id, ErasureConsent(clinic_number=NUMBER, decided_by="K"))
    with database.read() as session:
        assert [
            row.patient_id for row in erasures.undecided(session, hidden=select(ErasureRow.patient_id).where(false()))
        ] == [second]
        assert any("Visit 0: Mrs Yamada did well." in line for line in written_texts(session))
        assert sum("K-0043" in line for line in written_texts(session)) == 1
        assert not exported_statements.stored(session, first), "what was exported of the erased patient"
        assert exported_statements.stored(session, second)
