"""Edits of a recording as a request contains them. :mod:`kata.motion.edit` applies them."""

from typing import Annotated, Final, Literal
from uuid import UUID

from pydantic import Field

from kata.motion import edit
from kata.types import Motor, Name, Schema

RETOUCH_DEG: Final = 30.0
"""Largest change of a motor's angle by a retouch. A larger change needs a new teaching."""
MOST_POINTS: Final = 20
"""Largest number of points of a retouch."""

_Motors = Annotated[set[Motor], Field(min_length=1, description="Motor numbers, 1 to 5.", examples=[[3, 4]])]
_Pause = Annotated[float, Field(ge=0, le=120, description="Pause at each end, seconds.", examples=[2.0])]


class _Edit(Schema):
    name: Name | None = Field(
        None, description="Name of the new recording; by default the old name and the edit.", examples=["Warm-up"]
    )


class Trim(_Edit):
    """Keep the part between two times."""

    do: Literal["trim"]
    start_s: float = Field(ge=0, le=edit.LONGEST_S, description="Start of the part, seconds.", examples=[1.0])
    end_s: float = Field(ge=0, le=edit.LONGEST_S, description="End of the part, seconds.", examples=[6.5])


class Hold(_Edit):
    """Hold the arm at one point for some time."""

    do: Literal["hold"]
    at_s: float = Field(
        ge=0, le=edit.LONGEST_S, description="Time of the point on the motion, seconds.", examples=[4.0]
    )
    hold_s: float = Field(gt=0, le=600, description="Duration, seconds.", examples=[10.0])


class Scale(_Edit):
    """Reduce the range of some motors towards the pose in which the motion starts."""

    do: Literal["scale"]
    percent: float = Field(
        ge=edit.RANGE_PERCENT[0], lt=100, description="Range of motion, percent of the original.", examples=[80.0]
    )
    motors: _Motors


class Isolate(_Edit):
    """Move only some motors. The others keep the angle at which they started."""

    do: Literal["isolate"]
    motors: _Motors


class WarmUp(_Edit):
    """Repetitions that begin with a reduced range, which widens up to the full range."""

    do: Literal["warm_up"]
    less_deg: float = Field(
        gt=0,
        le=180,
        description="Range by which the first repetition is reduced, for the motor with the largest range, degrees.",
        examples=[15.0],
    )
    step_deg: float = Field(ge=0.5, le=30, description="Increase per repetition, degrees.", examples=[3.0])
    pause_s: _Pause = 0.0


class Stretch(_Edit):
    """Stretch at the end of range of the motor with the largest range: move back, then slowly to the end and beyond it, and hold."""

    do: Literal["stretch"]
    further_deg: float = Field(ge=0, le=15, description="Distance beyond the end of range, degrees.", examples=[3.0])
    back_deg: float = Field(
        5.0,
        ge=1,
        le=30,
        description="Distance from the end of range at which the stretch starts, degrees.",
        examples=[5.0],
    )
    hold_s: float = Field(
        0.0, ge=0, le=120, description="Duration of the hold beyond the end of range, seconds.", examples=[10.0]
    )


class Mirror(_Edit):
    """Mirror the motion for the other shoulder."""

    do: Literal["mirror"]


class GuideScapula(_Edit):
    """Let the scapula follow the rhythm of the sound side's newest recording in the same plane, mirrored. The upper arm moves as before."""

    do: Literal["guide"]


class Reteach(_Edit):
    """Replace the part between two marks by another recording, which was taught for it. Its ends are blended into the marks."""

    do: Literal["reteach"]
    start_s: float = Field(ge=0, le=edit.LONGEST_S, description="First mark, seconds.", examples=[2.0])
    end_s: float = Field(ge=0, le=edit.LONGEST_S, description="Second mark, seconds.", examples=[6.0])
    recording_id: UUID = Field(description="Recording of the new part: of the same patient and shoulder.")


class RetouchPoint(Schema):
    """A point that the changed motor passes."""

    motor: Motor
    at_s: float = Field(
        ge=0, le=edit.LONGEST_S, description="Time of the point on the motion, seconds.", examples=[4.0]
    )
    change_deg: float = Field(
        ge=-RETOUCH_DEG,
        le=RETOUCH_DEG,
        description="Distance of the point from the motor's taught angle, degrees.",
        examples=[-5.0],
    )


class Retouch(_Edit):
    """Change some motors between two marks. The motion passes the points smoothly, and does not change outside the marks."""

    do: Literal["retouch"]
    start_s: float = Field(ge=0, le=edit.LONGEST_S, description="First mark, seconds.", examples=[2.0])
    end_s: float = Field(ge=0, le=edit.LONGEST_S, description="Second mark, seconds.", examples=[6.0])
    points: Annotated[
        list[RetouchPoint], Field(min_length=1, max_length=MOST_POINTS, description="Points of one or several motors.")
    ]


Edit = Annotated[
    Trim | Hold | Scale | Isolate | WarmUp | Stretch | Mirror | GuideScapula | Reteach | Retouch,
    Field(discriminator="do"),
]
