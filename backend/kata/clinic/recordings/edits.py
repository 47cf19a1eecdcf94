"""What can be done to a recording, as it is asked for; :mod:`kata.motion.edit` does it."""

from typing import Annotated, Literal

from pydantic import Field

from kata.motion import edit
from kata.types import Motor, Name, Schema

_Motors = Annotated[set[Motor], Field(min_length=1, description="Motor numbers, 1 to 5.", examples=[[3, 4]])]
_Pause = Annotated[float, Field(ge=0, le=120, description="Standstill at each end, seconds.", examples=[2.0])]


class _Edit(Schema):
    name: Name | None = Field(
        None, description="Of the new recording; unless given, the old one's with what was done.", examples=["Warm-up"]
    )


class Trim(_Edit):
    """Only what is between two times."""

    do: Literal["trim"]
    start_s: float = Field(ge=0, le=edit.LONGEST_S, description="Seconds.", examples=[1.0])
    end_s: float = Field(ge=0, le=edit.LONGEST_S, description="Seconds.", examples=[6.5])


class Hold(_Edit):
    """Stand at one point for a while."""

    do: Literal["hold"]
    at_s: float = Field(ge=0, le=edit.LONGEST_S, description="Where on the motion, seconds.", examples=[4.0])
    hold_s: float = Field(gt=0, le=600, description="For how long, seconds.", examples=[10.0])


class Scale(_Edit):
    """Less range of some motors, towards the middle of what each of them goes through."""

    do: Literal["scale"]
    percent: float = Field(
        ge=edit.RANGE_PERCENT[0], lt=100, description="Range of motion, percent of what it was.", examples=[80.0]
    )
    motors: _Motors


class Isolate(_Edit):
    """Only some motors move, as they did; the others stay where they started."""

    do: Literal["isolate"]
    motors: _Motors


class WarmUp(_Edit):
    """Repetitions that begin with less range and widen it, the last one the whole."""

    do: Literal["warm_up"]
    less_deg: float = Field(
        gt=0, le=180, description="How much less the motor that goes farthest begins with, degrees.", examples=[15.0]
    )
    step_deg: float = Field(ge=0.5, le=30, description="How much wider each repetition is, degrees.", examples=[3.0])
    pause_s: _Pause = 0.0


class Stretch(_Edit):
    """At the end of range of the motor that goes farthest: back, slowly up to the end again and beyond it, and hold."""

    do: Literal["stretch"]
    further_deg: float = Field(ge=0, le=15, description="Beyond the end, degrees.", examples=[3.0])
    back_deg: float = Field(5.0, ge=1, le=30, description="From how far below the end, degrees.", examples=[5.0])
    hold_s: float = Field(0.0, ge=0, le=120, description="Standstill at the far end, seconds.", examples=[10.0])


class Mirror(_Edit):
    """The same motion for the other shoulder."""

    do: Literal["mirror"]


Edit = Annotated[Trim | Hold | Scale | Isolate | WarmUp | Stretch | Mirror, Field(discriminator="do")]
