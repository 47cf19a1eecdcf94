"""Content of the progress charts, on both databases."""

from collections.abc import Callable
from datetime import UTC, date, datetime, timedelta
from typing import TYPE_CHECKING, Any
from uuid import UUID, uuid4
from zoneinfo import ZoneInfo

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace
from sqlalchemy.orm import Session

from kata.clinic.assessments import service as assessments
from kata.clinic.assessments.schemas import AssessmentCreate
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.programmes.adherence import AdherenceWeek
from kata.clinic.progress import figures, notes, numbers, service
from kata.clinic.progress.series import EndRangeGain, LineSeries, Point, RomPanel, SpadiPoint, Tracked
from kata.clinic.questionnaires.definitions import DEFINITIONS, SPADI
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions.tables import MotionTrackingRow, RunRow, SessionRow
from kata.database.engine import Database
from kata.errors import ProblemError
from kata.plotting.placed_texts import with_texts
from tests.support.databases import SQLITE_FIRST

if TYPE_CHECKING:
    import plotly.graph_objects as go

DAY = datetime(2026, 3, 2, 9, 30, tzinfo=UTC)
ALARM_COLOURS = {"#ff0000", "#ffff00", "#00ffff", "red", "yellow", "cyan"}


class Episode:
    """Return a function that fills an episode for a test."""

    def __init__(self, session: Session) -> None:
        self.session = session
        patient = patients.create(
            session, PatientCreate(clinic_number="K-1", name="Yamada Hanako", affected_side="left")
        )
        assert patient.episode
        self.patient_id, self.id = patient.id, patient.episode.id
        self.recorded = 0

    def assess(self, day: float, **found: Any) -> UUID:
        body = {"assessed_at": DAY + timedelta(days=day), "assessed_by": "Kimura Jun"} | found
        return assessments.create(self.session, self.id, AssessmentCreate(**body)).id

    def record(self, name: str, side: str = "left") -> UUID:
        self.recorded += 1
        row = RecordingRow(
            id=uuid4(), patient_id=self.patient_id, name=name, side=side, station="S", duration_s=1.0, rate_hz=100,
            taught_at=DAY + timedelta(minutes=self.recorded), samples=101, note="",
        )  # fmt: skip
        self.session.add(row)
        self.session.flush()
        return row.id

    def treat(self, day: float, *runs: RunRow, **given: Any) -> None:
        row = SessionRow(
            id=uuid4(), patient_id=self.patient_id, episode_id=self.id, started_at=DAY + timedelta(days=day), note="",
            run_count=len(runs), **given,
        )  # fmt: skip
        self.session.add(row)
        self.session.flush()
        for run in runs:
            run.session_id = row.id
            run.started_at += timedelta(days=day)
            self.session.add(run)
        self.session.flush()


def run(recording_id: UUID, rmse_deg: float | None, peak_deg: float | None, minute: int = 0, **given: Any) -> RunRow:
    return RunRow(
        id=uuid4(), recording_id=recording_id, started_at=DAY + timedelta(minutes=minute), outcome="completed",
        worst_rmse_deg=rmse_deg, worst_peak_deg=peak_deg, **({"method": "smooth"} | given),
    )  # fmt: skip


def rom(angle_deg: float, **given: Any) -> dict[str, Any]:
    return {"side": "left", "motion": "flexion", "kind": "active", "angle_deg": angle_deg} | given


def drawn(figure: figures.Figure) -> "go.Figure":
    """Return the figure as an object of Plotly, which refuses unknown properties."""
    # The import takes a second, which each worker would spend when it collects the tests.
    import plotly.graph_objects as go

    figure = with_texts(figure)
    assert {entry["code"].partition("_")[0] for entry in figure.pop("texts")} <= {"figure", "motion", "rom"}
    written = msgspec.json.encode(figure).decode()
    assert not {colour for colour in ALARM_COLOURS if f'"{colour}"' in written}
    return go.Figure(figure)


def traces(figure: "go.Figure") -> dict[str, tuple[list[Any], list[Any]]]:
    return {trace.name: (list(trace.x), list(trace.y)) for trace in figure.data}


def line_names_of(figure: "go.Figure") -> list[Any]:
    """Return the names beside the lines, from the lowest line to the highest of each panel."""
    return [name for name in figure.layout.annotations if name.xref.endswith(" domain")]


def read_timeline(database: Database, episode_id: UUID, read: Callable[[Session, service.EpisodeTimeline], Any]) -> Any:
    with database.read() as session:
        return read(session, service.timeline_of(session, episode_id))


def names(table: numbers.NumberTable) -> list[str]:
    assert all(len(row) == len(table.columns) for row in table.rows)
    return [column.name for column in table.columns]


@pytest.fixture
def fill(database: Database) -> Callable[[Callable[[Episode], None]], UUID]:
    def filled(how: Callable[[Episode], None]) -> UUID:
        with database.write() as session:
            episode = Episode(session)
            how(episode)
            return episode.id

    return filled


Fill = Callable[[Callable[[Episode], None]], UUID]


@SQLITE_FIRST
def test_range_of_motion_is_compared_with_baseline_other_side_reference(database: Database, fill: Fill) -> None:
    def how(episode: Episode) -> None:
        episode.assess(0, rom=[rom(90), rom(100, kind="passive"), rom(165, side="right")])
        episode.assess(7, rom=[rom(105), rom(175, side="right"), rom(12, motion="extension")])
        episode.assess(14, rom=[rom(120), rom(130, kind="passive")])
        mistaken = episode.assess(21, rom=[rom(10)])
        row = assessments.get(episode.session, mistaken)
        assessments.withdraw(episode.session, mistaken, row.updated_at)

    panels: list[RomPanel] = read_timeline(database, fill(how), service.rom_panels)
    assert [panel.measure.english for panel in panels] == ["Flexion", "Extension"]
    figure = drawn(figures.rom(panels))
    flexion = [trace for trace in figure.data if trace.xaxis == "x"]
    assert {trace.name: (list(trace.x), list(trace.y)) for trace in flexion} == {
        "Active": ([0, 1, 2], [90, 105, 120]),
        "Passive": ([0, 2], [100, 130]),
        "Baseline, active": ([-0.2, 2.2], [90, 90]),
        "Baseline, passive": ([-0.2, 2.2], [100, 100]),
        "Other side, active": ([-0.2, 2.2], [175, 175]),
        "Reference": ([-0.2, 2.2], [180, 180]),
    }
    assert [name.text for name in line_names_of(figure) if name.yref == "y"] == ["Baseline", "Other side", "Reference"]
    looks = {(trace.line.color, trace.line.dash) for trace in flexion}
    assert len(looks) == len(flexion)
    shown = [trace.name for trace in figure.data if trace.showlegend]
    assert len(shown) == len(set(shown)) == 6

    table = numbers.rom(panels)
    assert names(table)[:2] == ["Motion", "Kind"]
    assert table.rows[2] == ["Flexion", "active", DAY + timedelta(days=14), 120, 30, 175, 180]
    assert len(table.rows) == 6


@SQLITE_FIRST
def test_assessment_pain_and_session_pain_are_separate(database: Database, fill: Fill) -> None:
    def how(episode: Episode) -> None:
        episode.treat(0, pain_before=6, pain_after=5)
        episode.assess(1.75, pain_rest=4, pain_average=7)
        episode.treat(7, pain_before=4, pain_during=5, pain_after=3)
        episode.treat(8)

    lines: list[LineSeries] = read_timeline(database, fill(how), service.pain_lines)
    assert traces(drawn(figures.pain(lines))) == {
        "At rest": ([0.25], [4]),
        "Average over the last week": ([0.25], [7]),
        "Before the session": ([0, 1], [6, 4]),
        "During the session": ([1], [5]),
        "After the session": ([0, 1], [5, 3]),
    }
    figure = drawn(figures.pain(lines))
    assert not any(trace.showlegend for trace in figure.data)
    # The space for a legend once was an empty strip.
    assert figure.layout.margin.t == 30
    leading = {trace.name: trace.yaxis for trace in figure.data if trace.line.width > 2}
    assert leading == {"Average over the last week": "y", "Before the session": "y2"}
    for axis in ("y", "y2"):
        looks = [
            (trace.line.color, trace.line.dash, trace.marker.symbol) for trace in figure.data if trace.yaxis == axis
        ]
        assert all(len(set(kind)) == len(looks) for kind in zip(*looks, strict=True))
    colours = {trace.yaxis + trace.line.color for trace in figure.data}
    assert {name.yref + name.font.color for name in line_names_of(figure)} == colours
    table = numbers.pain(lines)
    assert names(table) == [
        "When", "At rest, 0 to 10", "Average over the last week, 0 to 10", "Before the session, 0 to 10", "During the session, 0 to 10",
        "After the session, 0 to 10",
    ]  # fmt: skip
    assert table.rows[0] == [DAY, None, None, 6, None, 5]
    assert len(table.rows) == 3


@SQLITE_FIRST
def test_the_spadi_shows_where_a_change_begins_to_matter(database: Database, fill: Fill) -> None:
    def how(episode: Episode) -> None:
        episode.assess(0, spadi=[6] * 5 + [3] * 8)
        episode.assess(7, spadi=[None, None, None, 4, 4] + [3] * 8)
        episode.assess(14, spadi=[4] * 5 + [3] * 8)
        episode.assess(21, spadi=[2] * 5 + [3] * 8)
        episode.assess(28, pain_rest=1)

    points: list[SpadiPoint] = read_timeline(database, fill(how), service.spadi_points)
    figure = drawn(figures.spadi(points))
    assert traces(figure) == {
        "SPADI": ([0, 2, 3], [45, 35, 25]),
        "Pain": ([0, 2, 3], [60, 40, 20]),
        "Disability": ([0, 2, 3], [30, 30, 30]),
        "Baseline": ([-0.2, 3.2], [45, 45]),
        "8 points better: MCID reached, possibly measurement error": ([-0.2, 3.2], [37, 37]),
        "Over 17 points better: beyond measurement error": ([-0.2, 3.2], [28, 28]),
    }
    assert (figure.layout.shapes[0].y0, figure.layout.shapes[0].y1) == (28, 37)
    line_ends = line_names_of(figure)
    assert [name.text for name in line_ends] == ["−17 points", "−8 points", "Baseline"]
    assert line_ends[1].y == pytest.approx(37, abs=2)
    # A legend of seven lines leaves 150 px for the 108 points on a telephone, and a name is 18 px high.
    assert np.diff([name.y for name in line_ends]).min() >= 18 * 108 / 150 - 1e-9
    table = numbers.spadi(points)
    assert names(table)[-2:] == ["Change from baseline, points", "Change of at least the MCID"]
    assert [row[-2:] for row in table.rows] == [[0, "no"], [None, ""], [-10, "possibly better"], [-20, "better"]]


@SQLITE_FIRST
def test_other_questionnaires_show_where_a_change_matters(database: Database, fill: Fill) -> None:
    def how(episode: Episode) -> None:
        given: list[dict[str, list[int | None]]] = [
            {"quickdash": [4] * 11},
            {"quickdash": [3] * 11, "oxford": [2] * 12},
            {"quickdash": [None, None, *[1] * 9], "oxford": [3] * 12, "of_tomorrow": [1]},
        ]
        for day, answered in zip((0, 7, 14), given, strict=True):
            found_at = DAY + timedelta(days=day)
            body = AssessmentCreate.model_construct(
                assessed_at=found_at, assessed_by="Kimura Jun", rom=[], spadi=None, note=""
            )
            assessments.create(episode.session, episode.id, body, answered)

    panels = read_timeline(database, fill(how), service.questionnaire_panels)
    assert [panel.definition.code for panel in panels] == ["oxford", "quickdash"]
    figure = drawn(figures.questionnaires(panels))
    upper, lower = ({trace.name: list(trace.y) for trace in figure.data if trace.yaxis == axis} for axis in ("y", "y2"))
    # A higher Oxford Shoulder Score is better, a lower QuickDASH is.
    assert upper == {
        "Total": [24, 36],
        "Baseline": [24, 24],
        "From here on the MCID is reached, possibly measurement error": [30, 30],
        "Beyond this line more than measurement error": [30, 30],
    }
    assert lower == {
        "Total": [75, 50],
        "Baseline": [75, 75],
        "From here on the MCID is reached, possibly measurement error": pytest.approx([61.6, 61.6]),
        "Beyond this line more than measurement error": pytest.approx([57.9, 57.9]),
    }
    titles = [title.text for title in figure.layout.annotations if title.xref == "paper"]
    assert titles == ["Oxford Shoulder Score", "QuickDASH"]
    assert [(name.yref, name.text) for name in line_names_of(figure)] == [
        ("y", "Baseline"), ("y", "+6 points"), ("y2", "−17.1 points"), ("y2", "−13.4 points"), ("y2", "Baseline"),
    ]  # fmt: skip
    assert figure.layout.yaxis.title.text == "0 to 48 points, higher is better"
    assert figure.layout.yaxis2.title.text == "0 to 100 points, lower is better"
    shown = [trace.name for trace in figure.data if trace.showlegend]
    assert len(shown) == len(set(shown)) == 4
    table = numbers.questionnaires(panels)
    assert names(table)[2:] == ["Total, points", "Change from baseline, points", "Change of at least the MCID"]
    assert [row[1:] for row in table.rows] == [
        ["Oxford Shoulder Score", 24, 0, "no"],
        ["Oxford Shoulder Score", 36, 12, "better"],
        ["QuickDASH", 75, 0, "no"],
        ["QuickDASH", 50, -25, "better"],
        ["QuickDASH", None, None, ""],
    ]
    source = "van Kampen et al. 2013, J Orthop Surg Res 8, 40"
    assert [(note.title, str(note.sentence), note.source) for note in notes.questionnaires(panels)[2:]] == [
        ("QuickDASH", "Patients call a change of 13.4 points important (MCID).", source),
        ("QuickDASH", "A change of 17.1 points or less may be measurement error (SDC).", source),
    ]


@pytest.mark.parametrize(
    ("code", "change", "verdict"),
    [("quickdash", -13.3, "no"), ("quickdash", -13.4, "possibly better"), ("quickdash", -17.1, "possibly better"),
     ("quickdash", -17.2, "better"), ("quickdash", 17.2, "worse"),
     ("oxford", 5.9, "no"), ("oxford", 6, "possibly better"), ("oxford", 7, "better"), ("oxford", -7, "worse"),
     ("ases", 6.3, "no"), ("ases", 6.4, "possibly better"), ("ases", 9.7, "possibly better"), ("ases", 9.8, "better"),
     ("ases", -9.8, "worse")],
)  # fmt: skip
def test_verdict_follows_the_limits_of_each_questionnaire(code: str, change: float, verdict: str) -> None:
    assert numbers.verdict(DEFINITIONS[code], change) == verdict


def test_change_within_the_important_range_is_never_certain() -> None:
    """A clinic's definition may detect changes that are smaller than the upper end of what patients call important."""
    given = replace(SPADI, detectable=replace(SPADI.detectable, points=9))
    assert [numbers.verdict(given, change) for change in (-10, -13, -13.1)] == ["possibly better"] * 2 + ["better"]


@SQLITE_FIRST
def test_narrow_screen_has_one_panel_below_the_other(database: Database, fill: Fill) -> None:
    """Titles of two panels would overlap on a telephone."""

    def how(episode: Episode) -> None:
        episode.assess(0, rom=[rom(90), rom(12, motion="extension"), rom(80, motion="abduction")])

    panels = read_timeline(database, fill(how), service.rom_panels)
    for columns, places in ((2, [0, 0.625, 0]), (1, [0, 0, 0])):
        titles = [title for title in drawn(figures.rom(panels, columns)).layout.annotations if title.xref == "paper"]
        assert [round(title.x, 3) for title in titles] == places
        heights = [title.y for title in titles]
        assert len(set(heights)) == (2 if columns == 2 else 3)


@pytest.mark.parametrize(
    ("change", "verdict"),
    [(None, ""), (0, "no"), (-7.9, "no"), (-8, "possibly better"), (-17, "possibly better"), (-17.1, "better"),
     (7.9, "no"), (8, "possibly worse"), (17, "possibly worse"), (17.1, "worse")],
)  # fmt: skip
def test_lower_scores_are_better_and_relevance_begins_at_eight(change: float | None, verdict: str) -> None:
    assert numbers.verdict(SPADI, change) == verdict


@SQLITE_FIRST
def test_errors_are_reported_by_recording_and_method(database: Database, fill: Fill) -> None:
    def how(episode: Episode) -> None:
        lift, other = episode.record("Lift"), episode.record("Lift")
        episode.treat(0, run(lift, 1.0, 3.0), run(lift, 2.0, 2.5, minute=5), run(other, 0.5, 0.75))
        episode.treat(7, run(lift, 0.5, 1.5, method="learned"), run(lift, None, None))

    tracked: list[Tracked] = read_timeline(database, fill(how), service.tracked)
    figure = drawn(figures.tracking(tracked))
    upper, lower = ([trace for trace in figure.data if trace.yaxis == axis] for axis in ("y", "y2"))
    assert [(trace.name, list(trace.x), list(trace.y)) for trace in upper] == [
        ("Lift, smooth", [0], [1.5]),
        ("Lift (2), smooth", [0], [0.5]),
        ("Lift, learned", [1], [0.5]),
    ]
    assert [list(trace.y) for trace in lower] == [[3.0], [0.75], [1.5]]
    assert [trace.showlegend for trace in figure.data] == [True] * 3 + [False] * 3
    table = numbers.tracking(tracked)
    assert table.rows[-1] == [DAY + timedelta(days=7), "Lift", "learned", 1, 0.5, 1.5]


@SQLITE_FIRST
def test_learned_values_are_reported_as_at_the_sessions_end(database: Database, fill: Fill) -> None:
    def how(episode: Episode) -> None:
        lift = episode.record("Lift")
        learned = [run(lift, 1.0, 3.0, minute, learned_rms_deg=rms) for minute, rms in ((5, 0.5), (0, 0.25))]
        episode.treat(0, *learned)
        episode.treat(7, run(lift, 1.0, 3.0, learned_rms_deg=0.75), run(lift, 1.0, 3.0, minute=3))

    lines: list[LineSeries] = read_timeline(database, fill(how), service.correction_lines)
    assert traces(drawn(figures.correction(lines))) == {"Lift": ([0, 1], [0.5, 0.75])}
    assert numbers.correction(lines).rows[1] == [DAY + timedelta(days=7), "Lift", 0.75]


@SQLITE_FIRST
def test_end_range_time_adds_up_by_week_beside_the_gain(database: Database, fill: Fill) -> None:
    def held(recording: UUID, **seconds: float | None) -> RunRow:
        short_run = run(recording, 1.0, 1.0)
        short_run.motions = [
            MotionTrackingRow(
                motion=int(name[1]), end_range_s=time, peak_deg=0.0, peak_at_s=0.0, rmse_deg=0.0, start_deg=0.0
            )
            for name, time in seconds.items()
        ]
        return short_run

    def how(episode: Episode) -> None:
        lift = episode.record("Lift")
        for day, angle_deg in ((0, 90.0), (14, 102.0)):
            episode.assess(day, rom=[rom(angle_deg, kind="passive")])
        episode.treat(0, held(lift, m2=None, m4=60.0), held(lift, m4=30.0))
        episode.treat(3, held(lift, m4=90.0, m6=12.0))
        episode.treat(8, held(lift, m4=120.0))

    found: EndRangeGain = read_timeline(database, fill(how), service.end_range)
    abduction, rotation = "Abduction / adduction of the shoulder", found.points[2].motion
    assert [(point.motion, point.minutes, point.in_week_min) for point in found.points] == [
        (abduction, 1.5, 1.5), (abduction, 1.5, 3.0), (rotation, 0.2, 0.2), (abduction, 2.0, 2.0),
    ]  # fmt: skip
    figure = drawn(figures.end_range(found))
    assert traces(figure) == {
        abduction: ([0.5, 1.5], [3.0, 2.0]),
        rotation: ([0.5], [0.2]),
        "Flexion": ([0, 2], [0, 12]),
    }
    assert figure.layout.xaxis.range[1] >= 2
    assert numbers.end_range(found).rows[1] == [DAY + timedelta(days=3), abduction, 1.5, 3.0]


def test_end_range_time_of_the_other_shoulder_is_left_out(database: Database, fill: Fill) -> None:
    def held(recording: UUID, seconds: float) -> RunRow:
        one = run(recording, 1.0, 1.0)
        one.motions = [
            MotionTrackingRow(motion=4, end_range_s=seconds, peak_deg=0.0, peak_at_s=0.0, rmse_deg=0.0, start_deg=0.0)
        ]
        return one

    def how(episode: Episode) -> None:
        episode.treat(0, held(episode.record("Lift"), 60.0), held(episode.record("Lift", "right"), 600.0))

    found: EndRangeGain = read_timeline(database, fill(how), service.end_range)
    assert [point.minutes for point in found.points] == [1.0]


@SQLITE_FIRST
def test_playback_of_an_unknown_method_is_drawn(database: Database, fill: Fill) -> None:
    """Versions before methods stored errors, too."""

    def how(episode: Episode) -> None:
        episode.treat(0, run(episode.record("Lift"), 1.0, 3.0, method=None))

    tracked: list[Tracked] = read_timeline(database, fill(how), service.tracked)
    assert [trace.name for trace in drawn(figures.tracking(tracked)).data] == ["Lift"] * 2
    assert numbers.tracking(tracked).rows[0][1:4] == ["Lift", None, 1]


@SQLITE_FIRST
def test_week_without_visits_is_included(database: Database, fill: Fill) -> None:
    def how(episode: Episode) -> None:
        lift = episode.record("Lift")
        for day, stops in ((0, 0), (2, 1), (6.9, 0), (21, 0)):
            episode.treat(day, run(lift, 1.0, 1.0), stop_count=stops)
        episode.treat(9)

    weeks = read_timeline(database, fill(how), service.weeks)
    mondays = [date(2026, 3, day) for day in (2, 9, 16, 23)]
    assert traces(drawn(figures.adherence(weeks[:4]))) == {"Sessions": (mondays, [2, 1, 0, 1])}
    assert numbers.adherence(weeks).rows[2] == ["2026-03-16", 0, None, 0, 0]


@SQLITE_FIRST
def test_session_of_monday_morning_is_in_the_clinics_week(database: Database, fill: Fill) -> None:
    """Nine o'clock on Monday in Tokyo is midnight in UTC."""

    def how(episode: Episode) -> None:
        episode.treat(-0.5, run(episode.record("Lift"), 1.0, 1.0))

    episode_id = fill(how)
    with database.read() as session:
        found = {
            zone: service.weeks(session, service.timeline_of(session, episode_id, ZoneInfo(zone)))
            for zone in ("UTC", "Asia/Tokyo")
        }
    held = {zone: next(week.begins_on for week in weeks if week.sessions) for zone, weeks in found.items()}
    assert held == {"UTC": date(2026, 2, 23), "Asia/Tokyo": date(2026, 3, 2)}


def test_prescribed_and_completed_sessions_are_compared() -> None:
    monday = date(2026, 3, 2)
    weeks = [
        AdherenceWeek(begins_on=monday, sessions=2, sessions_prescribed=3, repetitions_planned=60, repetitions_done=54),
        AdherenceWeek(
            begins_on=monday + timedelta(days=7),
            sessions=0,
            sessions_prescribed=3,
            repetitions_planned=0,
            repetitions_done=0,
        ),
    ]
    mondays = [week.begins_on for week in weeks]
    assert traces(drawn(figures.adherence(weeks))) == {
        "Sessions": (mondays, [2, 0]),
        "As prescribed": (mondays, [3, 3]),
    }
    assert numbers.adherence(weeks).rows[0] == ["2026-03-02", 2, 3, 60, 54]


@pytest.mark.parametrize(("count", "between"), [(1, 1), (4, 1), (5, 2), (60, 15)])
def test_sessions_per_week_are_labelled_with_mondays(count: int, between: int) -> None:
    monday = date(2026, 3, 2)
    weeks = [
        AdherenceWeek(
            begins_on=monday + timedelta(weeks=week),
            sessions=1,
            sessions_prescribed=1,
            repetitions_planned=1,
            repetitions_done=1,
        )
        for week in range(count)
    ]
    axis = figures.adherence(weeks)["layout"]["xaxis"]
    assert (axis["tick0"], timedelta(milliseconds=axis["dtick"])) == (monday, timedelta(weeks=between))


def test_nothing_yet_is_an_empty_chart_and_an_empty_table(database: Database, fill: Fill) -> None:
    episode_id = fill(lambda episode: None)
    for read, draw, tabulate in (
        (service.rom_panels, figures.rom, numbers.rom),
        (service.pain_lines, figures.pain, numbers.pain),
        (service.spadi_points, figures.spadi, numbers.spadi),
        (service.questionnaire_panels, figures.questionnaires, numbers.questionnaires),
        (service.tracked, figures.tracking, numbers.tracking),
        (service.correction_lines, figures.correction, numbers.correction),
        (service.weeks, figures.adherence, numbers.adherence),
    ):
        found = read_timeline(database, episode_id, read)
        assert found == []
        assert all(len(trace.y) == 0 for trace in drawn(draw(found)).data)
        assert tabulate(found).rows == []


@SQLITE_FIRST
def test_missing_episode_is_not_found(database: Database) -> None:
    with pytest.raises(ProblemError) as problem, database.read() as session:
        service.timeline_of(session, uuid4())
    assert problem.value.status == 404


def test_thirty_series_in_one_chart_look_different() -> None:
    lines = [LineSeries(str(number), (Point(DAY, 0, number),)) for number in range(30)]
    looks = {
        (trace.line.color, trace.line.dash, trace.marker.symbol) for trace in drawn(figures.correction(lines)).data
    }
    assert len(looks) == 30
