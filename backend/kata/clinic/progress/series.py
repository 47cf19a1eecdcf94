"""What the charts are drawn from. Time is told in weeks from the episode's first visit: the same in every time zone."""

from dataclasses import dataclass
from datetime import datetime
from typing import Final, Literal

from kata.clinic import texts
from kata.clinic.assessments.rom import Kind, Measure

Chart = Literal["rom", "pain", "spadi", "tracking", "correction", "adherence"]


@dataclass(frozen=True)
class Point:
    """One number of one day."""

    at: datetime
    week: float
    value: float


@dataclass(frozen=True)
class LineSeries:
    """One thing over the weeks, oldest first."""

    name: str
    """A Text, or the name of a recording."""
    points: tuple[Point, ...]


@dataclass(frozen=True)
class RomLine:
    """How far the affected shoulder went in one direction; the first point is its baseline."""

    kind: Kind
    points: tuple[Point, ...]
    other_side_deg: float | None
    """The newest of the other shoulder."""


@dataclass(frozen=True)
class RomPanel:
    """One motion."""

    measure: Measure
    lines: tuple[RomLine, ...]


@dataclass(frozen=True)
class SpadiPoint:
    """One day's scores, 0 to 100; None where too much was left unanswered."""

    at: datetime
    week: float
    total: float | None
    pain: float | None
    disability: float | None


@dataclass(frozen=True)
class Tracked:
    """How one recording was reproduced in one session by one method: the worst motor's error, of all its playbacks."""

    recording: str
    method: str
    at: datetime
    week: float
    playbacks: int
    rmse_deg: float
    """Mean of the playbacks'."""
    peak_deg: float
    """The largest, without sign."""


KINDS: Final = {"active": texts.FIGURE_KIND_ACTIVE(), "passive": texts.FIGURE_KIND_PASSIVE()}
"""What the kinds of a measurement are called."""
METHODS: Final = {"smooth": texts.FIGURE_SMOOTH(), "learned": texts.FIGURE_LEARNED(), "paper": texts.FIGURE_PAPER()}
"""What the methods are called."""
PAIN_CONTEXTS: Final = (
    texts.FIGURE_PAIN_AT_REST(),
    texts.FIGURE_PAIN_MOVING(),
    texts.FIGURE_PAIN_MOVED(),
    texts.FIGURE_PAIN_AVERAGE(),
)
"""Of assessments."""
PAIN_IN_SESSIONS: Final = (texts.FIGURE_PAIN_BEFORE(), texts.FIGURE_PAIN_DURING(), texts.FIGURE_PAIN_AFTER())
