"""A run's record says when learning fell back, for which motors, and why nothing was learned."""

from dataclasses import replace
from pathlib import Path
from typing import get_args
from uuid import UUID

import msgspec
import numpy as np
import pytest
from sqlalchemy import delete

from kata.clinic.sessions import correction_learning, runs, stored_corrections
from kata.clinic.sessions.schemas import LearningNote
from kata.clinic.sessions.tables import RunCorrectionRow
from kata.database import arrays
from kata.database.engine import Database
from kata.device.config import StationConfig
from kata.device.journal import JournalEnd
from kata.motion.arm_load import ArmLoad
from kata.motion.axes import N_AXES, Side
from kata.motion.path import PathPoint
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


@pytest.mark.parametrize("side", get_args(Side))
def test_the_weight_of_the_played_sides_arm_is_learned_through(clinic: Clinic, side: Side) -> None:
    """The station was turned between the service's start and this run. The torque that carries the arm on the run's side is not the
    patient's resistance, whatever the side that the importer knows.
    """
    heavy = StationConfig(arm=ArmLoad(inertia=(0.0,) * 6 + (0.03, 0.05, -0.2, 0.5)))
    load = replace(heavy.servo_model.load, side=side)
    recording_id = clinic.recording(4.0, pose, side)
    still = np.zeros(N_AXES)

    def carried(time_s: float) -> list[float]:
        return [float(torque) for torque in load.arm_nm(PathPoint(np.array(pose(time_s)), still, still))]

    learned = []
    for importers_side in get_args(Side):
        clinic.importer.use(msgspec.structs.replace(heavy, side=importers_side))
        run_id = clinic.begin_run(recording_id, method="learned")
        clinic.journal(
            "run", run_id, [4.0], at=pose, torque_nm=carried, error_deg=-0.5, end=JournalEnd(reason="completed")
        )
        clinic.importer.run()
        with clinic.database.write() as session:
            correction = stored_corrections.correction(session, run_id)
            assert correction is not None
            learned.append(correction.angles_deg)
            session.execute(delete(RunCorrectionRow))
    assert np.array_equal(learned[0], learned[1])
    assert np.all(np.abs(learned[0]).max(axis=0) > 0.2), "each motor learns"


@SQLITE_FIRST
def test_other_methods_report_nothing(clinic: Clinic, recording_id: UUID) -> None:
    run_id = clinic.begin_run(recording_id)
    clinic.journal("run", run_id, [4.0], at=pose, error_deg=-0.5, end=JournalEnd(reason="returned"))
    clinic.importer.run()
    with clinic.database.read() as session:
        assert runs.as_run(runs.get(session, run_id)).learning == []


def test_correction_of_an_earlier_version_is_played_but_not_compared(clinic: Clinic, recording_id: UUID) -> None:
    run_id, _ = played(clinic, recording_id, -0.5)
    with clinic.database.write() as session:
        row = session.get_one(RunCorrectionRow, run_id)
        columns = arrays.decode(row.data)
        row.data = arrays.encode(columns, correction_learning.COLUMNS[:5])
    with clinic.database.read() as session:
        correction = stored_corrections.correction(session, run_id)
    assert correction is not None
    assert np.array_equal(correction.angles_deg, columns["correction_deg"])
    assert correction.learned_from is None
    _, notes = played(clinic, recording_id, -1.5)
    assert notes == []
