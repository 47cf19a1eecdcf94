"""The numbers of the charts as accessible tables."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final, Literal

from kata.clinic import texts
from kata.clinic.programmes.adherence import AdherenceWeek
from kata.clinic.progress.series import (
    KINDS,
    METHODS,
    EndFeelPoint,
    EndRangeGain,
    LineSeries,
    QuestionnairePanel,
    RomPanel,
    SpadiPoint,
    Tracked,
)
from kata.clinic.questionnaires.changes import Meaning, meaning_of
from kata.clinic.questionnaires.definitions import SPADI, Definition
from kata.clinic.rounding import change_as_shown
from kata.plotting import texts as plotting_texts

Cell = str | float | datetime | None
_VERDICTS: Final[dict[Meaning, str]] = {
    "none": texts.FIGURE_NO(),
    "perhaps_better": texts.FIGURE_PERHAPS_BETTER(),
    "perhaps_worse": texts.FIGURE_PERHAPS_WORSE(),
    "better": texts.FIGURE_BETTER(),
    "worse": texts.FIGURE_WORSE(),
}


@dataclass(frozen=True)
class NumberColumn:
    """One column (:class:`kata.clinic.progress.schemas.ProgressColumn`)."""

    name: str
    kind: Literal["text", "moment", "number"]
    digits: int = 0


@dataclass(frozen=True)
class NumberTable:
    """A table in the form that is sent (:class:`kata.clinic.progress.schemas.ProgressTable`)."""

    columns: list[NumberColumn]
    rows: list[list[Cell]]


def rom(panels: Sequence[RomPanel]) -> NumberTable:
    """Return a table with one row per measurement of the affected shoulder."""
    rows: list[list[Cell]] = [
        [
            panel.measure.english,
            KINDS[line.kind],
            point.at,
            point.value,
            change_as_shown(line.points[0].value, point.value),
            line.other_side_deg,
            panel.measure.reference_deg,
        ]
        for panel in panels
        for line in panel.lines
        for point in line.points
    ]
    numbers = (
        plotting_texts.FIGURE_ANGLE(),
        texts.FIGURE_CHANGE_DEG(),
        texts.FIGURE_OTHER_SIDE_DEG(),
        texts.FIGURE_REFERENCE_DEG(),
    )
    columns = [
        _text(texts.FIGURE_MOTION()),
        _text(texts.FIGURE_KIND()),
        _moment(texts.FIGURE_ASSESSED()),
        *(_number(name, digits=1) for name in numbers),
    ]
    return NumberTable(columns=columns, rows=rows)


def pain(lines: Sequence[LineSeries]) -> NumberTable:
    """Return a table with one row per time and one column per context."""
    values_at: dict[datetime, dict[str, float]] = defaultdict(dict)
    for line in lines:
        for point in line.points:
            values_at[point.at][line.name] = point.value
    rows: list[list[Cell]] = [
        [at, *(values.get(line.name) for line in lines)] for at, values in sorted(values_at.items())
    ]
    columns = [_moment(texts.FIGURE_WHEN()), *(_number(texts.FIGURE_OF_10(score=line.name)) for line in lines)]
    return NumberTable(columns=columns, rows=rows)


def spadi(points: Sequence[SpadiPoint]) -> NumberTable:
    """Return a table with one row per assessment that has a SPADI."""
    baseline = next((point.total for point in points if point.total is not None), None)
    rows: list[list[Cell]] = []
    for point in points:
        change = None if point.total is None or baseline is None else change_as_shown(baseline, point.total)
        rows.append([point.at, point.total, point.pain, point.disability, change, verdict(SPADI, change)])
    scores = (texts.FIGURE_SPADI(), texts.FIGURE_PAIN(), texts.FIGURE_DISABILITY())
    columns = [
        _moment(texts.FIGURE_ASSESSED()),
        *(_number(texts.FIGURE_OF_100(score=score), digits=1) for score in scores),
        _number(texts.FIGURE_CHANGE_POINTS(), digits=1),
        _text(texts.FIGURE_IMPORTANT_CHANGE()),
    ]
    return NumberTable(columns=columns, rows=rows)


def questionnaires(panels: Sequence[QuestionnairePanel]) -> NumberTable:
    """Return a table with one row per answered questionnaire."""
    rows: list[list[Cell]] = []
    for panel in panels:
        baseline = next((point.total for point in panel.points if point.total is not None), None)
        for point in panel.points:
            change = None if point.total is None or baseline is None else change_as_shown(baseline, point.total)
            rows.append([point.at, panel.definition.title, point.total, change, verdict(panel.definition, change)])
    columns = [
        _moment(texts.FIGURE_ASSESSED()),
        _text(texts.FIGURE_QUESTIONNAIRE()),
        _number(texts.FIGURE_TOTAL_POINTS(), digits=1),
        _number(texts.FIGURE_CHANGE_POINTS(), digits=1),
        _text(texts.FIGURE_IMPORTANT_CHANGE()),
    ]
    return NumberTable(columns=columns, rows=rows)


def verdict(definition: Definition, change_points: float | None) -> str:
    """Return whether a change of the total is important to patients and larger than chance; empty without a change."""
    return "" if change_points is None else _VERDICTS[meaning_of(definition, change_points)]


def tracking(tracked: Sequence[Tracked]) -> NumberTable:
    """Return a table with one row per recording, method and session."""
    rows: list[list[Cell]] = [
        [row.at, row.recording, METHODS[row.method] if row.method else None, row.playbacks, row.rmse_deg, row.peak_deg]
        for row in tracked
    ]
    errors = [_number(texts.FIGURE_MEAN_RMSE(), digits=2), _number(texts.FIGURE_LARGEST_ERROR(), digits=2)]
    columns = [
        _moment(texts.FIGURE_SESSION()),
        _text(texts.FIGURE_RECORDING()),
        _text(texts.FIGURE_METHOD()),
        _number(texts.FIGURE_PLAYBACKS()),
        *errors,
    ]
    return NumberTable(columns=columns, rows=rows)


def correction(lines: Sequence[LineSeries]) -> NumberTable:
    """Return a table with one row per recording and session in which a correction was learned."""
    learned = sorted((point.at, line.name, point.value) for line in lines for point in line.points)
    rows: list[list[Cell]] = [[at, name, value] for at, name, value in learned]
    columns = [
        _moment(texts.FIGURE_SESSION()),
        _text(texts.FIGURE_RECORDING()),
        _number(texts.FIGURE_CORRECTION(), digits=2),
    ]
    return NumberTable(columns=columns, rows=rows)


def end_feel(points: Sequence[EndFeelPoint]) -> NumberTable:
    """Return a table with one row per test."""
    rows: list[list[Cell]] = [
        [
            point.at,
            point.motion,
            point.side,
            point.torque_nm,
            point.range_deg,
            point.half_deg,
            point.onset_deg,
            point.stiffness_nm_deg,
        ]
        for point in points
    ]
    columns = [
        _moment(texts.FIGURE_WHEN()),
        _text(texts.FIGURE_MOTION()),
        _text(texts.FIGURE_SIDE()),
        _number(texts.FIGURE_CHOSEN_TORQUE(), digits=1),
        _number(texts.FIGURE_END_FEEL_RANGE(), digits=1),
        _number(texts.FIGURE_END_FEEL_INTERVAL(), digits=1),
        _number(texts.FIGURE_END_FEEL_ONSET(), digits=1),
        _number(texts.FIGURE_END_FEEL_STIFFNESS(), digits=3),
    ]
    return NumberTable(columns=columns, rows=rows)


def end_range(gain: EndRangeGain) -> NumberTable:
    """Return a table with one row per session and motion."""
    rows: list[list[Cell]] = [[point.at, point.motion, point.minutes, point.in_week_min] for point in gain.points]
    columns = [
        _moment(texts.FIGURE_SESSION()),
        _text(texts.FIGURE_MOTION()),
        _number(texts.FIGURE_END_RANGE(), digits=1),
        _number(texts.FIGURE_END_RANGE_SO_FAR(), digits=1),
    ]
    return NumberTable(columns=columns, rows=rows)


def adherence(weeks: Sequence[AdherenceWeek]) -> NumberTable:
    """Return a table with one row per week."""
    rows: list[list[Cell]] = [
        [
            week.begins_on.isoformat(),
            week.sessions,
            week.sessions_prescribed,
            week.repetitions_planned,
            week.repetitions_done,
        ]
        for week in weeks
    ]
    columns = [
        _text(texts.FIGURE_WEEK_FROM()), _number(texts.FIGURE_SESSIONS()), _number(texts.FIGURE_AS_PRESCRIBED()), _number(texts.FIGURE_REPETITIONS_PLANNED()), _number(texts.FIGURE_REPETITIONS_DONE())
    ]  # fmt: skip
    return NumberTable(columns=columns, rows=rows)


def _text(name: str) -> NumberColumn:
    return NumberColumn(name=name, kind="text")


def _moment(name: str) -> NumberColumn:
    return NumberColumn(name=name, kind="moment")


def _number(name: str, digits: int = 0) -> NumberColumn:
    return NumberColumn(name=name, kind="number", digits=digits)
