"""Stretches in the clinic's records: the largest angle, the baseline, and the time for which the torque was held."""

from datetime import UTC
from pathlib import Path
from uuid import UUID

import pytest

from kata.clinic.sessions import end_feel_results
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device.journal import JournalEnd
from kata.errors import ProblemError
from kata.reporting import rendering
from kata.reporting import session as session_report
from kata.reporting.phrases import Language
from tests.support.databases import SQLITE_FIRST
from tests.support.end_feel_runs import STATION, begin, ended, row_of, stretched
from tests.support.fhir_bundle import exported, of_kind
from tests.support.imported_runs import Clinic, pose
from tests.support.reports import print_options


@pytest.fixture
def clinic(tmp_path: Path, database: Database) -> Clinic:
    return Clinic(tmp_path, database)


@pytest.fixture
def recording(clinic: Clinic) -> UUID:
    """A recording with today's baseline."""
    made = clinic.recording(4.0, pose)
    ended(clinic, begin(clinic, made, "baseline"), (105.0,), shoulder=False)
    return made


def held(clinic: Clinic, recording: UUID) -> UUID:
    run_id = begin(clinic, recording, "stretch", largest_deg=80.0)
    stretched(clinic, run_id, JournalEnd(reason="completed", held_s=84.2, target_nm=1.6))
    return run_id


@SQLITE_FIRST
def test_held_time_and_reduced_torque_are_stored(clinic: Clinic, recording: UUID) -> None:
    row = row_of(clinic, held(clinic, recording))
    assert (row.kind, row.hold_s, row.repetitions) == ("stretch", 30.0, 3)
    assert (row.held_s, row.target_nm, row.range_deg, row.unmeasured) == (84.2, 1.6, None, None)


@SQLITE_FIRST
def test_way_of_a_stretch_ends_at_the_largest_angle(clinic: Clinic, recording: UUID) -> None:
    row = row_of(clinic, begin(clinic, recording, "stretch", largest_deg=80.0))
    assert row.largest_deg == pytest.approx(80.0, abs=0.11)
    far = row_of(clinic, begin(clinic, recording, "stretch", largest_deg=300.0))
    open_end = row_of(clinic, begin(clinic, recording, "stretch"))
    assert far.largest_deg == open_end.largest_deg
    assert far.largest_deg is not None and far.largest_deg > 80.0


@SQLITE_FIRST
def test_angle_at_which_the_arm_is_not_weighed_is_refused(clinic: Clinic, recording: UUID) -> None:
    with pytest.raises(ProblemError) as refused:
        begin(clinic, recording, "stretch", largest_deg=20.0)
    assert refused.value.code == "largest_angle_too_small"


@SQLITE_FIRST
def test_stretch_without_a_baseline_of_today_is_not_loaded(clinic: Clinic) -> None:
    with pytest.raises(ProblemError) as refused:
        begin(clinic, clinic.recording(4.0, pose), "stretch")
    assert refused.value.code == "no_baseline_today"


@SQLITE_FIRST
def test_journal_without_an_end_counts_no_time(clinic: Clinic, recording: UUID) -> None:
    run_id = begin(clinic, recording, "stretch")
    row = stretched(clinic, run_id, JournalEnd(reason="stopped"))
    assert (row.held_s, row.target_nm) == (None, None)


def test_guide_and_record_show_the_stretch(clinic: Clinic, recording: UUID) -> None:
    run_id = held(clinic, recording)
    with clinic.database.read() as session:
        visit = session.query(SessionRow).one()
        today = utc_now().replace(hour=0, minute=0, second=0, microsecond=0)
        (motion,) = end_feel_results.guide(session, visit.id, STATION, today).motions
        assert motion.tests == [] and [one.run_id for one in motion.stretches] == [run_id]
        found = end_feel_results.curves(session, run_id, zone=UTC)
        assert found.figure is None and found.result.stretch is not None
        assert (found.result.stretch.held_s, found.result.stretch.target_nm) == (84.2, 1.6)
        assert session.get_one(RunRow, run_id).repetitions_done == 0


@SQLITE_FIRST
@pytest.mark.parametrize(("language", "words"), [("en", "stretch, held for 84\u00a0s"), ("ja", "ストレッチ、保持84秒")])
def test_session_report_states_the_held_time(clinic: Clinic, recording: UUID, language: Language, words: str) -> None:
    held(clinic, recording)
    with clinic.database.read() as session:
        content = session_report.read_content(session, session.query(SessionRow).one().id, UTC)
    assert words in rendering.session_page(content, print_options(language)).html


def test_stretch_is_no_end_feel_observation(clinic: Clinic, recording: UUID, tmp_path: Path) -> None:
    held(clinic, recording)
    bundle = exported(clinic.database, clinic.patient_id, tmp_path / "bundle.json")
    codes = [resource["code"]["coding"][0]["code"] for resource in of_kind(bundle, "Observation")]
    assert "end-feel" not in codes
