"""Defines keys and texts of the steps in their order. The functions are in :mod:`kata.commissioning.procedure`."""

from dataclasses import dataclass
from typing import Final

from kata.commissioning import texts
from kata.commissioning.record import RecordedStep
from kata.messages import Text


@dataclass(frozen=True)
class StepTexts:
    """Key of a step in the record, its title, and the description of its action."""

    key: str
    title: Text
    description: Text


STEP_TEXTS: Final = (
    StepTexts("ids", texts.STEP_IDS(), texts.STEP_IDS_DOES()),
    StepTexts("registers", texts.STEP_REGISTERS(), texts.STEP_REGISTERS_DOES()),
    StepTexts("inputs", texts.STEP_INPUTS(), texts.STEP_INPUTS_DOES()),
    StepTexts("axes", texts.STEP_AXES(), texts.STEP_AXES_DOES()),
    StepTexts("torque", texts.STEP_TORQUE(), texts.STEP_TORQUE_DOES()),
    StepTexts("zero", texts.STEP_ZERO(), texts.STEP_ZERO_DOES()),
    StepTexts("range", texts.STEP_RANGE(), texts.STEP_RANGE_DOES()),
    StepTexts("stops", texts.STEP_STOPS(), texts.STEP_STOPS_DOES()),
    StepTexts("gains", texts.STEP_GAINS(), texts.STEP_GAINS_DOES()),
    StepTexts("lags", texts.STEP_LAGS(), texts.STEP_LAGS_DOES()),
    StepTexts("acceptance", texts.STEP_ACCEPTANCE(), texts.STEP_ACCEPTANCE_DOES()),
)

STEPS_WITH_TORQUE: Final = ("torque", "zero", "stops", "gains", "lags", "acceptance")
"""Steps in which motors have torque."""


def passed_steps(steps: tuple[RecordedStep, ...]) -> set[str]:
    """Return the keys of the steps whose last run has passed after every step before them had passed."""
    order = [step.key for step in STEP_TEXTS]
    passed: list[str] = []
    for ran in steps:
        place = order.index(ran.step)
        # A repeated step invalidates the steps after it.
        passed = passed[:place]
        if ran.passed and passed == order[:place]:
            passed.append(ran.step)
    return set(passed)
