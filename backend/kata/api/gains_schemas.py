"""Request and response bodies for tuning position gains (:mod:`kata.commissioning.gains_review`)."""

from typing import Annotated, Literal

from pydantic import Field

from kata.clinic.commissionings.schemas import MotorStepResponse
from kata.commissioning.gain_proposal import GAIN_RANGE
from kata.motion.axes import N_AXES
from kata.station.schemas import OptionalKey
from kata.types import Motor, Schema

Gain = Annotated[int, Field(strict=True, ge=GAIN_RANGE.low, le=GAIN_RANGE.high)]


class DriveGains(Schema):
    """The position gains of a motor, in the drive's own units."""

    p: Gain
    i: Gain
    d: Gain


class StepFigures(Schema):
    """Figures of the response to a step."""

    rise_s: float = Field(description="Time from 10 to 90 % of the step.")
    overshoot: float = Field(description="Share of the step.")
    steady_error_deg: float = Field(description="Distance from the goal at the end.")


class MotorTuning(Schema):
    """Gains of one motor, and the responses with them."""

    motor: Motor
    gains: DriveGains
    response: StepFigures | None = Field(description="Null: not measured, because the gains were unstable.")
    former_gains: DriveGains | None = Field(description="Gains to which the technician can return.")
    former_response: StepFigures | None
    proposed: DriveGains = Field(description="Equal to the gains if no change is proposed.")
    advice: str = Field(description="Reason of the proposal; empty if no change is proposed.")
    advice_key: OptionalKey = None
    lowest: DriveGains = Field(description="Lower limits of the next measurement.")
    highest: DriveGains = Field(description="Upper limits of the next measurement.")


class GainTuningReview(Schema):
    """The step responses that the technician compares."""

    load: Literal["weight", "empty"]
    motors: list[MotorTuning]
    curves: list[MotorStepResponse]
    former_curves: list[MotorStepResponse]
    fault: str = Field(description="Fault with which the step ends if these gains are kept; empty if there is none.")
    fault_key: OptionalKey = None


class GainsAnswer(Schema):
    """Choice of the technician: keep the gains, take them back, or measure with other gains."""

    action: Literal["keep", "take_back", "measure"]
    gains: list[DriveGains] = Field(
        default_factory=list, max_length=N_AXES, description="measure: gains of every motor, in motor order."
    )
