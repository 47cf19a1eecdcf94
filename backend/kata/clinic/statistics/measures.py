"""The measures of outcome, and which change of each is important.

The limits of the SPADI are those of :mod:`kata.clinic.assessments.spadi`. For pain, a fall by 2 of 10 points is important: Farrar et al.
2001, Pain 94(2), 149-158 (chronic pain, 2724 patients). No detectable change of pain and no limit for the range of motion is known to us
from a source that fits this use; the figures then show the change without a verdict.
"""

from dataclasses import dataclass
from typing import Final

from kata.clinic.assessments import spadi
from kata.clinic.rounding import change_as_shown
from kata.clinic.statistics.schemas import OutcomeMeasure


@dataclass(frozen=True)
class MeasureDefinition:
    """One measure of outcome."""

    important: float | None = None
    """Smallest decrease that patients call important; None: no verified limit."""
    detectable: float | None = None
    """Largest decrease of one patient that may be due to chance; None: no verified limit."""
    motion: tuple[str, str] | None = None
    """Motion and position of the arm, for a passive range of motion of the affected shoulder."""


MEASURES: Final[dict[OutcomeMeasure, MeasureDefinition]] = {
    # The upper end of the published range, so that the share of improved patients is not too high.
    "spadi": MeasureDefinition(important=spadi.IMPORTANT_CHANGE[1], detectable=spadi.DETECTABLE_CHANGE),
    "pain": MeasureDefinition(important=2.0),
    "flexion": MeasureDefinition(motion=("flexion", "")),
    "abduction": MeasureDefinition(motion=("abduction", "")),
    "external_rotation": MeasureDefinition(motion=("external_rotation", "at_side")),
}


def improvement(first: float, last: float) -> float:
    """Return by how much a measure fell, as shown. Every count and every verdict compares this number with a limit, so that a reader who
    subtracts the shown numbers finds the same.
    """
    return change_as_shown(last, first)
