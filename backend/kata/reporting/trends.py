"""An episode's numbers over its weeks, as charts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import groupby
from typing import Final

from kata.reporting.charts import Chart, Series, Tick, over_days
from kata.reporting.content import EpisodeContent, Reading, RomLine
from kata.reporting.words import Speaker

_DAY_S: Final = 86400.0
_SHORTEST_TREND: Final = 2
"""One reading is a number, not a trend."""


@dataclass(frozen=True)
class Trends:
    """The charts of an episode."""

    rom: tuple[Chart, ...]
    pain: Chart | None
    spadi: Chart | None

    @property
    def all(self) -> tuple[Chart, ...]:
        """In the order in which they are shown."""
        return (*self.rom, *(chart for chart in (self.pain, self.spadi) if chart))


def draw(content: EpisodeContent, speaker: Speaker) -> Trends:
    """Whatever was found on at least two days."""
    visited = [visit.started_at for visit in content.visits]
    moments = sorted([*content.assessed_at, *visited])
    if not moments:
        return Trends((), None, None)
    axis = _Axis(moments[0], moments[-1], speaker)
    rom = []
    for (motion, position), lines in groupby(content.rom, key=lambda line: (line.motion, line.position)):
        chart = _rom(motion, position, list(lines), axis, speaker)
        if chart:
            rom.append(chart)
    before = [Reading(v.started_at, v.pain_before) for v in content.visits if v.pain_before is not None]
    after = [Reading(v.started_at, v.pain_after) for v in content.visits if v.pain_after is not None]
    pain = None
    if max(len(before), len(after)) >= _SHORTEST_TREND:
        series = [axis.series("before", before), axis.series("after", after)]
        pain = over_days(speaker.say("trends_pain"), series, axis.labels, 0, 10)
    spadi = None
    if len(content.spadi) >= _SHORTEST_TREND:
        spadi = over_days(speaker.say("trends_spadi"), [axis.series("spadi", content.spadi)], axis.labels, 0, 100)
    return Trends(tuple(rom), pain, spadi)


class _Axis:
    """Days from the first thing that happened to the last."""

    def __init__(self, first: datetime, last: datetime, speaker: Speaker) -> None:
        self._first = first
        days = self._day(last)
        middle = first + (last - first) / 2
        ends = [Tick(0.0, speaker.short_day(first)), Tick(days, speaker.short_day(last))]
        between = [Tick(days / 2, speaker.short_day(middle))] if days > _SHORTEST_TREND else []
        self.labels: Sequence[Tick] = [ends[0], *between, ends[1]]

    def _day(self, when: datetime) -> float:
        return (when - self._first).total_seconds() / _DAY_S

    def series(self, name: str, readings: Iterable[Reading]) -> Series:
        """A curve; its points are readings."""
        found = list(readings)
        return Series(
            name, tuple(self._day(reading.at) for reading in found), tuple(reading.value for reading in found)
        )


def _rom(motion: str, position: str, lines: Sequence[RomLine], axis: _Axis, speaker: Speaker) -> Chart | None:
    if all(len(line.readings) < _SHORTEST_TREND for line in lines):
        return None
    series = [axis.series(line.kind, line.readings) for line in lines]
    by_kind = {line.kind: line.other for line in lines if line.other}
    other = by_kind.get("passive") or next(iter(by_kind.values()), None)
    if other:
        series.append(Series("other", (), (other.value,)))
    if lines[0].reference_deg is not None:
        series.append(Series("reference", (), (lines[0].reference_deg,)))
    values = [value for one in series for value in one.values]
    return over_days(
        speaker.measure(motion, position),
        [one for one in series if one.values],
        axis.labels,
        min(0, *values),
        max(values),
    )
