"""Defines what the technician sees and answers while the position gains are tuned."""

from typing import Literal

from msgspec import Struct

from kata.commissioning.gain_proposal import Gains, are_within_limits
from kata.commissioning.record import RecordedCurve
from kata.commissioning.step_response import StepResponse
from kata.messages import MessageKey

GainSet = tuple[Gains, ...]
"""The gains of all motors, in motor order."""


class MotorGains(Struct, frozen=True):
    """The gains of one motor. ``response`` and ``former_response`` are None if they were not measured."""

    motor: int
    gains: Gains
    response: StepResponse | None
    former_gains: Gains | None
    """Gains to which the technician can return; None if there are none."""
    former_response: StepResponse | None
    proposed: Gains
    """Equal to ``gains`` if no change is proposed."""
    advice: str
    """Reason of the proposal; empty if no change is proposed."""
    advice_key: MessageKey | None
    lowest: Gains
    highest: Gains
    """``lowest`` and ``highest`` are the limits of the next trial."""


class GainsReview(Struct, frozen=True):
    """The step responses with the present gains beside those with the former gains."""

    load: str
    motors: tuple[MotorGains, ...]
    curves: tuple[RecordedCurve, ...]
    former_curves: tuple[RecordedCurve, ...]
    fault: str
    """Fault with which the step ends if the present gains are kept; empty if there is none."""
    fault_key: MessageKey | None

    def accepts(self, choice: "GainsChoice") -> bool:
        """Return True if the technician may choose this now."""
        match choice.action:
            case "keep":
                return True
            case "take_back":
                return self.motors[0].former_gains is not None
            case "measure":
                motors = self.motors
                return len(choice.gains) == len(motors) and all(
                    are_within_limits(gains, motor.gains) for gains, motor in zip(choice.gains, motors, strict=True)
                )


class GainsChoice(Struct, frozen=True):
    """Keep the present gains, take them back, or measure with ``gains`` of all motors (in motor order)."""

    action: Literal["keep", "take_back", "measure"]
    gains: GainSet = ()
