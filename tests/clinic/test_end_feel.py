"""Results of end-feel runs from journals whose truth is known."""

from datetime import UTC
from pathlib import Path
from typing import Literal
from uuid import UUID

import pytest

from kata.clinic.progress import figures, numbers
from kata.clinic.progress import service as progress
from kata.clinic.progress.series import EndFeelPoint
from kata.clinic.sessions import end_feel, end_feel_results, runs
from kata.clinic.sessions.tables import EndFeelRow, RunRow, SessionRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.errors import ProblemError
from kata.reporting import charts, rendering
from kata.reporting import session as session_report
from kata.reporting.phrases import Language
from tests.support.databases import SQLITE_FIRST
from tests.support.end_feel_runs import CHOSEN_NM, NM_DEG, ONSET_DEG, SPEED_DEG_S, STATION, begin, ended, row_of
from tests.support.fhir_bundle import exported, judged, of_kind
from tests.support.imported_runs import STARTED, Clinic, pose
from tests.support.reports import print_options

TURNS_DEG = (68.0, 68.0, 68.0)


@pytest.fixture
def clinic(tmp_path: Path, database: Database) -> Clinic:
    return Clinic(tmp_path, database)


@pytest.fixture
def recording(clinic: Clinic) -> UUID:
    return clinic.recording(4.0, pose)


@pytest.fixture
def baseline(clinic: Clinic, recording: UUID) -> UUID:
    run_id = begin(clinic, recording, "baseline")
    assert ended(clinic, run_id, (105.0,), shoulder=False).curve
    return run_id


def played(clinic: Clinic, recording: UUID, **given: tuple[float, ...]) -> EndFeelRow:
    return ended(clinic, begin(clinic, recording, "test"), TURNS_DEG, shoulder=True, **given)


@SQLITE_FIRST
def test_known_capsule_gives_range_onset_and_stiffness(clinic: Clinic, recording: UUID, baseline: UUID) -> None:
    row = played(clinic, recording)
    assert (row.motor, row.motion, row.outward, row.unmeasured) == (3, 4, 1, None)
    assert row.baseline_run_id == baseline
    assert row.range_deg == pytest.approx(ONSET_DEG + 0.6 * CHOSEN_NM / NM_DEG, abs=0.3)
    assert row.onset_deg == pytest.approx(ONSET_DEG + 0.25 * CHOSEN_NM / NM_DEG, abs=0.3)
    assert row.stiffness_nm_deg == pytest.approx(1 / (1 / NM_DEG - 1 / 3.1), rel=0.05)
    assert row.interval_range_deg is not None and row.interval_range_deg < 0.2


@SQLITE_FIRST
def test_patient_who_pushes_in_one_repetition_has_no_figures(clinic: Clinic, recording: UUID, baseline: UUID) -> None:
    row = played(clinic, recording, bursts_nm=(0.0, 1.5, 0.0))
    assert (row.unmeasured, row.range_deg, row.curve) == ("guarding", None, None)
    assert row.disagreement_nm is not None and row.disagreement_nm > 0.2


@SQLITE_FIRST
def test_test_without_a_baseline_of_today_is_refused(clinic: Clinic, recording: UUID) -> None:
    with pytest.raises(ProblemError) as refused:
        begin(clinic, recording, "test")
    assert refused.value.code == "no_baseline_today"


@SQLITE_FIRST
def test_baseline_of_another_speed_does_not_count(clinic: Clinic, recording: UUID, baseline: UUID) -> None:
    with clinic.database.read() as session:
        today = utc_now().replace(hour=0, minute=0, second=0, microsecond=0)
        found = end_feel.baseline_of(session, recording, STATION, SPEED_DEG_S, today)
        assert found is not None and found.run_id == baseline
        assert end_feel.baseline_of(session, recording, STATION, 4.0, today) is None
        assert end_feel.baseline_of(session, recording, "Station 2", SPEED_DEG_S, today) is None
        assert end_feel.baseline_of(session, recording, STATION, SPEED_DEG_S, utc_now()) is None


@SQLITE_FIRST
def test_baseline_that_turned_early_does_not_count(clinic: Clinic, recording: UUID) -> None:
    """Someone touched the weight. Beyond the turn the test would not know the apparatus' weight, and take the patient's arm too far."""
    row = ended(clinic, begin(clinic, recording, "baseline"), (40.0,), shoulder=False)
    assert (row.curve, row.unmeasured) == (None, "too_few_ways")
    with pytest.raises(ProblemError) as refused:
        begin(clinic, recording, "test")
    assert refused.value.code == "no_baseline_today"


@SQLITE_FIRST
def test_test_goes_no_farther_than_its_baseline(clinic: Clinic, recording: UUID) -> None:
    """The doctor widened the limits between the two."""
    run_id = begin(clinic, recording, "baseline")
    with clinic.database.write() as session:
        row = session.get_one(EndFeelRow, run_id)
        widest_deg, row.further_deg = row.further_deg, 5.0
    assert widest_deg > 5.0
    assert ended(clinic, run_id, (105.0,), shoulder=False).curve
    assert row_of(clinic, begin(clinic, recording, "test")).further_deg == 5.0


@SQLITE_FIRST
def test_end_feel_run_counts_no_repetitions_and_no_errors(clinic: Clinic, recording: UUID, baseline: UUID) -> None:
    row = played(clinic, recording)
    with clinic.database.read() as session:
        run = session.get_one(RunRow, row.run_id)
        assert (run.repetitions_done, run.samples, run.outcome) == (0, None, "completed")
        shown = runs.as_run(run)
        assert (shown.end_feel, shown.comparison) == ("test", None)


def test_refused_run_leaves_nothing_behind(clinic: Clinic, recording: UUID) -> None:
    run_id = begin(clinic, recording, "baseline")
    with clinic.database.write() as session:
        runs.remove_refused(session, run_id)
    with clinic.database.read() as session:
        assert session.get(EndFeelRow, run_id) is None


def test_curves_hold_earlier_tests_and_figures(clinic: Clinic, recording: UUID, baseline: UUID) -> None:
    first, second = played(clinic, recording).run_id, played(clinic, recording).run_id
    with clinic.database.read() as session:
        found = end_feel_results.curves(session, second, zone=UTC)
        assert [result.run_id for result in found.earlier] == [first]
        assert found.result.figures is not None and found.other_side is None
        assert found.figure is not None
        assert len(found.figure.data) == 4


@SQLITE_FIRST
def test_guide_shows_baselines_and_tests_of_the_session(clinic: Clinic, recording: UUID, baseline: UUID) -> None:
    run_id = played(clinic, recording).run_id
    with clinic.database.read() as session:
        visit = session.query(SessionRow).one()
        today = utc_now().replace(hour=0, minute=0, second=0, microsecond=0)
        (motion,) = end_feel_results.guide(session, visit.id, STATION, today).motions
        assert (motion.motion, motion.baseline_run_id) == (4, baseline)
        assert [test.run_id for test in motion.tests] == [run_id]
        (elsewhere,) = end_feel_results.guide(session, visit.id, "Station 2", today).motions
        assert elsewhere.baseline_run_id is None


@SQLITE_FIRST
def test_curve_as_csv_has_units_and_every_place(clinic: Clinic, recording: UUID, baseline: UUID) -> None:
    row = played(clinic, recording)
    with clinic.database.read() as session:
        lines = end_feel_results.as_csv(session, row.run_id).splitlines()
        curve = end_feel.curve_of(row)
        assert curve is not None
        assert lines[0].startswith("angle_deg,torque_out_nm,torque_back_nm,torque_mean_nm")
        assert len(lines) == 1 + len(curve.places_deg)
        with pytest.raises(ProblemError):
            end_feel_results.as_csv(session, begin_without_curve(clinic, recording))


@SQLITE_FIRST
def test_observation_has_method_and_components(clinic: Clinic, recording: UUID, baseline: UUID, tmp_path: Path) -> None:
    row = played(clinic, recording)
    bundle = exported(clinic.database, clinic.patient_id, tmp_path / "bundle.json")
    found = [
        resource for resource in of_kind(bundle, "Observation") if resource["code"]["coding"][0]["code"] == "end-feel"
    ]
    # The baseline is of the apparatus.
    assert [resource["id"] for resource in found] == [str(row.run_id)]
    assert found[0]["valueQuantity"]["value"] == pytest.approx(row.range_deg, abs=1e-3)
    assert found[0]["method"]["coding"][0]["code"] == "end-feel-test"
    assert {part["code"]["coding"][0]["code"] for part in found[0]["component"]} >= {
        "end-feel-torque", "end-feel-range-interval", "end-feel-onset", "end-feel-stiffness", "end-feel-hysteresis",
    }  # fmt: skip
    assert judged({"bundle": bundle}) == {"bundle": []}


@SQLITE_FIRST
def test_observation_without_figures_says_why(clinic: Clinic, recording: UUID, baseline: UUID, tmp_path: Path) -> None:
    played(clinic, recording, bursts_nm=(0.0, 1.5, 0.0))
    bundle = exported(clinic.database, clinic.patient_id, tmp_path / "bundle.json")
    (found,) = (
        resource for resource in of_kind(bundle, "Observation") if resource["code"]["coding"][0]["code"] == "end-feel"
    )
    assert "valueQuantity" not in found
    assert found["dataAbsentReason"]["text"] == "guarding"
    # The test was performed; its value is not known.
    assert found["dataAbsentReason"]["coding"][0]["code"] == "unknown"
    assert judged({"bundle": bundle}) == {"bundle": []}


@SQLITE_FIRST
@pytest.mark.parametrize(("language", "words"), [("en", "End-feel test"), ("ja", "エンドフィール検査")])
def test_session_report_has_figures_of_the_test(
    clinic: Clinic, recording: UUID, baseline: UUID, language: Language, words: str
) -> None:
    row = played(clinic, recording)
    with clinic.database.read() as session:
        content = session_report.read_content(session, session.query(SessionRow).one().id, UTC)
    page = rendering.session_page(content, print_options(language)).html
    assert words in page
    assert f"{row.range_deg:.1f} ± {row.interval_range_deg:.1f}" in page
    assert page.count("<circle") == 2


@SQLITE_FIRST
@pytest.mark.parametrize("outward", [1, -1])
def test_reports_curve_has_dots_at_onset_and_range(
    clinic: Clinic, recording: UUID, baseline: UUID, outward: Literal[1, -1]
) -> None:
    row = played(clinic, recording)
    curve = end_feel.curve_of(row)
    assert curve is not None and row.range_deg is not None and row.onset_deg is not None
    drawn = charts.torque_angle("Test", curve, outward, [outward * row.onset_deg, outward * row.range_deg])
    mean = drawn.lines[2]
    places = [tuple(map(float, point.split(","))) for point in mean.points.split()]
    (onset_x, onset_y), (range_x, range_y) = mean.dots
    assert (onset_x < range_x) == (outward == 1)
    # The mean has 25 % of the chosen torque at onset and 60 % at range.
    zero = next(tick.at for tick in drawn.y_ticks if tick.label == "0")
    assert (zero - onset_y) / (zero - range_y) == pytest.approx(0.25 / 0.6, abs=0.03)
    assert all(drawn.frame.y(1) <= y <= drawn.frame.y(0) for _, y in places)


def test_progress_has_the_range_of_each_test(clinic: Clinic, recording: UUID, baseline: UUID) -> None:
    row = played(clinic, recording)
    with clinic.database.read() as session:
        visit = session.query(SessionRow).one()
        assert visit.episode_id is not None
        points = progress.end_feel_points(session, progress.timeline_of(session, visit.episode_id))
    (point,) = points
    assert (point.range_deg, point.half_deg) == (row.range_deg, row.interval_range_deg)
    assert figures.end_feel(points)["data"][0]["error_y"]["array"] == [row.interval_range_deg]


def test_ranges_at_other_torque_or_side_are_not_joined() -> None:
    def point(week: int, side: str, torque_nm: float, range_deg: float) -> EndFeelPoint:
        return EndFeelPoint("Flexion", side, STARTED, week, torque_nm, range_deg, None, None, None)

    points = [
        point(0, "left", 2.0, 80.0),
        point(1, "left", 4.0, 95.0),
        point(2, "right", 2.0, 140.0),
        point(3, "left", 2.0, 82.0),
    ]
    drawn = {str(trace["name"]): trace["y"] for trace in figures.end_feel(points)["data"]}
    assert drawn == {
        "Flexion, left, 2.0 Nm": [80.0, 82.0],
        "Flexion, left, 4.0 Nm": [95.0],
        "Flexion, right, 2.0 Nm": [140.0],
    }


def test_figure_that_was_not_measured_is_empty() -> None:
    point = EndFeelPoint("Flexion", "left", STARTED, 0, 2.0, 80.0, None, None, None)
    assert figures.end_feel([point])["data"][0]["error_y"]["array"] == [None]
    assert numbers.end_feel([point]).rows[0][5:] == [None, None, None]


def begin_without_curve(clinic: Clinic, recording: UUID) -> UUID:
    run_id = begin(clinic, recording, "test")
    assert row_of(clinic, run_id).curve is None
    return run_id
