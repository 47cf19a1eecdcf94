"""A run's record says when learning fell back, for which motors, and why nothing was learned."""

from pathlib import Path
from uuid import UUID

import pytest

from kata.clinic.sessions import correction_learning, runs, stored_corrections
from kata.clinic.sessions.schemas import LearningNote
from kata.database.engine import Database
from kata.device.journal import JournalEnd
from tests.support.databases import SQLITE_FIRST
from tests.support.imported_runs import Clinic, pose


@pytest.fixture
def clinic(tmp_path: Path, database: Database) -> Clinic:
    return Clinic(tmp_path, database)


@pytest.fixture
def recording_id(clinic: Clinic) -> UUID:
    return clinic.recording(4.0, pose)


def played(
    clinic: Clinic, recording_id: UUID, error_deg: float, reason: str = "completed"
) -> tuple[UUID, list[LearningNote]]:
    run_id = clinic.begin_run(recording_id, method="learned")
    clinic.journal("run", run_id, [4.0], at=pose, error_deg=error_deg, end=JournalEnd(reason=reason))  # type: ignore[arg-type]
    clinic.importer.run()
    with clinic.database.read() as session:
        return run_id, runs.as_run(runs.get(session, run_id)).learning


@SQLITE_FIRST
def test_grown_error_falls_back_and_names_its_motors(clinic: Clinic, recording_id: UUID) -> None:
    _, first = played(clinic, recording_id, -0.5)
    assert first == []
    run_id, (note,) = played(clinic, recording_id, -1.5)
    assert note.message_key is not None
    assert note.message_key.code == "learning_fell_back"
    assert note.message_key.params["motors"] == "1, 2, 3, 4, 5"
    assert "grew by more than 10 %" in note.message
    # The next Load shows the same, from the stored correction.
    with clinic.database.read() as session:
        correction = stored_corrections.correction(session, run_id)
        assert correction is not None and correction.learned_from is not None
        assert [str(text) for text in correction_learning.fall_back(correction.learned_from)] == [note.message]
    _, after = played(clinic, recording_id, -0.5)
    assert after == []


def test_run_that_did_not_reach_its_end_says_so(clinic: Clinic, recording_id: UUID) -> None:
    _, (note,) = played(clinic, recording_id, -0.5, reason="returned")
    assert note.message == "nothing was learned: the playback did not reach its end"


@SQLITE_FIRST
def test_other_methods_report_nothing(clinic: Clinic, recording_id: UUID) -> None:
    run_id = clinic.begin_run(recording_id)
    clinic.journal("run", run_id, [4.0], at=pose, error_deg=-0.5, end=JournalEnd(reason="returned"))
    clinic.importer.run()
    with clinic.database.read() as session:
        assert runs.as_run(runs.get(session, run_id)).learning == []
