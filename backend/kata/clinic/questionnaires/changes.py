"""Meaning of a change of a questionnaire's total: important to patients, larger than chance, or neither."""

from typing import Literal

from kata.clinic.questionnaires.definitions import Definition
from kata.clinic.rounding import as_shown

Meaning = Literal["none", "perhaps_better", "perhaps_worse", "better", "worse"]
"""``none``: smaller than what patients call important. ``perhaps_…``: important, but it may be chance."""


def certain_above(definition: Definition) -> float:
    """Return the change in points above which a change is important and no chance: the larger one of both published limits."""
    important = definition.important
    return max(definition.detectable.points, important.up_to or important.points)


def meaning_of(definition: Definition, change_points: float) -> Meaning:
    """Return what a change of the total means. ``change_points``: the later total minus the earlier one.

    The change is compared with a limit as it is shown, so that no verdict contradicts the number beside it.
    """
    size = abs(as_shown(change_points))
    if size < definition.important.points:
        return "none"
    better = change_points < 0 if definition.better == "lower" else change_points > 0
    if size > certain_above(definition):
        return "better" if better else "worse"
    return "perhaps_better" if better else "perhaps_worse"


def improved_by(definition: Definition, total: float, points: float) -> float:
    """Return the total that is ``points`` better."""
    return total - points if definition.better == "lower" else total + points
