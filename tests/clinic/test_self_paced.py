"""Self-paced runs in the clinic's records: the permission, and the patient's work, effort and pace."""

from dataclasses import replace
from pathlib import Path
from uuid import uuid4

import pytest

from kata.clinic.episodes.limits import DoctorLimits
from kata.clinic.sessions import runs
from kata.clinic.sessions.replay import RunStarted, serialize_limits
from kata.clinic.sessions.tables import RunRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device.journal import JournalEnd
from kata.errors import ProblemError
from kata.motion.edit import AS_TAUGHT
from tests.support.imported_runs import Clinic, pose

FORBIDDEN = DoctorLimits("right", "Dr. Mori", None, None, ())
PERMITTED = replace(FORBIDDEN, self_paced_permitted=True)
END = JournalEnd(reason="completed", work_j=3.2, mean_effort_nm=1.4, mean_pace_percent=61.0)


def test_only_a_permitted_shoulder_is_self_paced() -> None:
    PERMITTED.check_self_paced(self_paced=True)
    FORBIDDEN.check_self_paced(self_paced=False)
    with pytest.raises(ProblemError) as refused:
        FORBIDDEN.check_self_paced(self_paced=True)
    assert refused.value.code == "self_pace_not_permitted"


def test_permission_is_compared_after_an_outage() -> None:
    assert serialize_limits(PERMITTED) != serialize_limits(FORBIDDEN)
    assert "self_paced" not in serialize_limits(FORBIDDEN)


def test_run_that_began_without_database_is_self_paced() -> None:
    started = RunStarted(
        id=uuid4(), session_id=uuid4(), recording_id=uuid4(), corrected_by=None, programme_position=None, started_at=utc_now(), resistance_level=8, settings=AS_TAUGHT, method="smooth",
        allowed=serialize_limits(PERMITTED), station="Station 1", self_paced=True,
    )  # fmt: skip
    assert started.row.self_paced is True


def test_work_effort_and_mean_pace_are_stored(tmp_path: Path, database: Database) -> None:
    clinic = Clinic(tmp_path, database)
    recording = clinic.recording(4.0, pose)
    run_id = clinic.begin_run(recording)
    clinic.journal("run", run_id, [4.0], end=END, at=pose)
    clinic.importer.run()
    with database.read() as session:
        run = runs.as_run(session.get_one(RunRow, run_id))
    assert (run.outcome, run.work_j, run.mean_effort_nm, run.mean_pace_percent) == ("completed", 3.2, 1.4, 61.0)
