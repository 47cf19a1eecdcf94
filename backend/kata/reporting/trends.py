"""Charts of an episode's values over time."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import groupby
from typing import Final

from kata.reporting.charts import Chart, DatedSeries, Tick, over_days
from kata.reporting.content import DatedValue, EpisodeContent, RomSeries
from kata.reporting.phrases import Phrases
from kata.reporting.totals import scale_of

_DAY_S: Final = 86400.0
_SHORTEST_TREND: Final = 2
"""Number of values from which a chart is drawn, because a single value shows no trend."""


@dataclass(frozen=True)
class Trends:
    """The charts of an episode."""

    rom: tuple[Chart, ...]
    pain: Chart | None
    questionnaires: tuple[Chart, ...]

    @property
    def all(self) -> tuple[Chart, ...]:
        """Return all charts, in the order of the report."""
        return (*self.rom, *([self.pain] if self.pain else []), *self.questionnaires)


def draw(content: EpisodeContent, phrases: Phrases) -> Trends:
    """Return a chart of every value that was measured on at least two days."""
    treated_at = [session.started_at for session in content.sessions]
    moments = sorted([*content.assessed_at, *treated_at])
    if not moments:
        return Trends((), None, ())
    axis = _Axis(moments[0], moments[-1], phrases)
    rom = []
    for (motion, position), lines in groupby(content.rom, key=lambda line: (line.motion, line.position)):
        chart = _rom(motion, position, list(lines), axis, phrases)
        if chart:
            rom.append(chart)
    before = [DatedValue(v.started_at, v.pain_before) for v in content.sessions if v.pain_before is not None]
    after = [DatedValue(v.started_at, v.pain_after) for v in content.sessions if v.pain_after is not None]
    pain = None
    if max(len(before), len(after)) >= _SHORTEST_TREND:
        series = [axis.series("before", before), axis.series("after", after)]
        pain = over_days(phrases.text("trends_pain"), series, axis.labels, 0, 10)
    totals = [
        over_days(
            scale_of(questionnaire, phrases),
            [axis.series("total", questionnaire.readings)],
            axis.labels,
            questionnaire.lowest,
            questionnaire.highest,
        )
        for questionnaire in content.questionnaires
        if len(questionnaire.readings) >= _SHORTEST_TREND
    ]
    return Trends(tuple(rom), pain, tuple(totals))


class _Axis:
    """Time axis in days from the first to the last date."""

    def __init__(self, first: datetime, last: datetime, phrases: Phrases) -> None:
        self._first = first
        days = self._day(last)
        middle = first + (last - first) / 2
        ends = [Tick(0.0, phrases.day(first)), Tick(days, phrases.day(last))]
        between = [Tick(days / 2, phrases.day(middle))] if days > _SHORTEST_TREND else []
        self.labels: Sequence[Tick] = [ends[0], *between, ends[1]]

    def _day(self, when: datetime) -> float:
        return (when - self._first).total_seconds() / _DAY_S

    def series(self, name: str, readings: Iterable[DatedValue]) -> DatedSeries:
        """Return a series of dated values."""
        values = list(readings)
        return DatedSeries(
            name, tuple(self._day(reading.at) for reading in values), tuple(reading.value for reading in values)
        )


def _rom(motion: str, position: str, lines: Sequence[RomSeries], axis: _Axis, phrases: Phrases) -> Chart | None:
    if all(len(line.readings) < _SHORTEST_TREND for line in lines):
        return None
    series = [axis.series(line.kind, line.readings) for line in lines]
    by_kind = {line.kind: line.other for line in lines if line.other}
    other = by_kind.get("passive") or next(iter(by_kind.values()), None)
    if other:
        series.append(DatedSeries("other", (), (other.value,)))
    if lines[0].reference_deg is not None:
        series.append(DatedSeries("reference", (), (lines[0].reference_deg,)))
    values = [value for curve in series for value in curve.values]
    return over_days(
        phrases.text("trends_angle", name=phrases.measure(motion, position)),
        [curve for curve in series if curve.values],
        axis.labels,
        min(0, *values),
        max(values),
    )
