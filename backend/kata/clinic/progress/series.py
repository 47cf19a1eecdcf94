"""Data of the charts. Time is counted in weeks from the episode's first visit, so that it is the same in every time zone."""

from dataclasses import dataclass
from datetime import datetime
from typing import Final, Literal

from kata.clinic import texts
from kata.clinic.assessments.rom import Kind, Measure
from kata.clinic.questionnaires.definitions import Definition

Chart = Literal[
    "rom", "pain", "spadi", "questionnaires", "tracking", "correction", "adherence", "end_feel", "end_range"
]


@dataclass(frozen=True)
class Point:
    """One value of one day."""

    at: datetime
    week: float
    value: float


@dataclass(frozen=True)
class LineSeries:
    """Values over the weeks, oldest first."""

    name: str
    """A Text, or the name of a recording."""
    points: tuple[Point, ...]


@dataclass(frozen=True)
class RomLine:
    """The angles of the affected shoulder in one direction. The first point is the baseline."""

    kind: Kind
    points: tuple[Point, ...]
    other_side_deg: float | None
    """Newest angle of the other shoulder."""


@dataclass(frozen=True)
class RomPanel:
    """The angles of one motion."""

    measure: Measure
    lines: tuple[RomLine, ...]


@dataclass(frozen=True)
class SpadiPoint:
    """The scores of one day, 0 to 100; None if too many items are unanswered."""

    at: datetime
    week: float
    total: float | None
    pain: float | None
    disability: float | None


@dataclass(frozen=True)
class TotalPoint:
    """The total of one day; None if too many items are unanswered."""

    at: datetime
    week: float
    total: float | None


@dataclass(frozen=True)
class QuestionnairePanel:
    """The totals of one questionnaire, oldest first."""

    definition: Definition
    points: tuple[TotalPoint, ...]


@dataclass(frozen=True)
class Tracked:
    """Error of the worst motor in all playbacks of one recording in one session by one method."""

    recording: str
    method: str | None
    """None for playbacks of a version without methods."""
    at: datetime
    week: float
    playbacks: int
    rmse_deg: float
    """Mean over the playbacks."""
    peak_deg: float
    """The largest absolute error."""


@dataclass(frozen=True)
class EndFeelPoint:
    """The figures of one end-feel test. ``half_deg``: half of the 95 % interval of the range. None: not measured."""

    motion: str
    side: str
    at: datetime
    week: float
    torque_nm: float
    range_deg: float
    half_deg: float | None
    onset_deg: float | None
    stiffness_nm_deg: float | None


@dataclass(frozen=True)
class EndRangePoint:
    """End-range time of one motion in one session, in minutes. ``in_week_min``: sum of the episode's week so far."""

    motion: str
    at: datetime
    week: float
    minutes: float
    in_week_min: float


@dataclass(frozen=True)
class EndRangeGain:
    """End-range times, and the gain of passive range: angles minus the first one of each measured motion, degrees."""

    points: tuple[EndRangePoint, ...]
    gains: tuple[LineSeries, ...]


KINDS: Final = {"active": texts.FIGURE_KIND_ACTIVE(), "passive": texts.FIGURE_KIND_PASSIVE()}
"""Names of the kinds of a measurement."""
METHODS: Final = {"smooth": texts.FIGURE_SMOOTH(), "learned": texts.FIGURE_LEARNED(), "paper": texts.FIGURE_PAPER()}
"""Names of the methods."""
PAIN_CONTEXTS: Final = (
    texts.FIGURE_PAIN_AT_REST(),
    texts.FIGURE_PAIN_MOVING(),
    texts.FIGURE_PAIN_MOVED(),
    texts.FIGURE_PAIN_AVERAGE(),
)
"""Names of the pain scores in assessments."""
PAIN_IN_SESSIONS: Final = (texts.FIGURE_PAIN_BEFORE(), texts.FIGURE_PAIN_DURING(), texts.FIGURE_PAIN_AFTER())
