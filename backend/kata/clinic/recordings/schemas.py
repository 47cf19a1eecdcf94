"""Request and response models of recordings."""

from typing import Annotated, Any
from uuid import UUID

from pydantic import BeforeValidator, Field, StrictBool

from kata.station.schemas import OptionalKey, TextKey
from kata.types import Fixture, Moment, Motor, Name, Note, Schema, Side

Fixtures = Annotated[
    set[Fixture],
    Field(
        max_length=3,
        description="Fixtures that held the arm: arm fixer 1 for motions 1 to 5, arm fixer 2 with elbow fixer 1 for "
        "motion 6. Empty if unknown.",
        examples=[["arm_fixer_1"]],
    ),
]


class Recording(Schema):
    """A motion that was taught in one take, derived or imported."""

    id: UUID
    patient_id: UUID
    teaching_id: UUID | None = Field(description="Null for a derived or imported recording.")
    take: int | None = Field(ge=1, description="Number of the pedal press within its teaching.")
    parent_id: UUID | None = Field(
        description="Recording from which it was derived; null for a taught or imported recording."
    )
    done: list[str] = Field(
        description="Texts of all edits in order; the last edit was applied to the parent.",
        examples=[["trimmed to 1.0 s to 6.5 s", "mirrored for the left shoulder"]],
    )
    done_keys: Annotated[list[OptionalKey], BeforeValidator(lambda keys: keys or [])] = Field(
        [],
        description="Code and parameters of each text in `done`; empty for a recording of a version that did not store them.",
    )
    name: str = Field(examples=["Flexion, take 1"])
    side: Side
    station: str = Field(description="Station at which it was taught or derived.", examples=["Station 1"])
    taught_by: str = Field(description="Name of the person who guided the arm; empty if unknown.", examples=["Sato"])
    fixtures: list[Fixture] = Field(description="Fixtures that held the arm.", examples=[["arm_fixer_1"]])
    taught_at: Moment = Field(description="Time of teaching or deriving. UTC.")
    duration_s: float = Field(ge=0, description="Seconds.", examples=[22.1])
    rate_hz: int = Field(ge=1, description="Samples a second of the taught motion.", examples=[100])
    samples: int = Field(ge=2, examples=[2210])
    simulated: bool = Field(
        False, description="True if it was taught on a simulated apparatus, or derived from such a recording."
    )
    note: str
    updated_at: Moment
    archived_at: Moment | None


class MotorRange(Schema):
    """Range and speed of one motor in a recording."""

    motor: Motor
    min_deg: float = Field(description="Smallest angle, degrees.")
    max_deg: float = Field(description="Largest angle, degrees.")
    max_speed_deg_s: float = Field(ge=0, description="Highest mean speed over a tenth of a second, degrees per second.")


class ReachMargin(Schema):
    """The point at which a motion is nearest to the edge of the reachable set."""

    margin_deg: float = Field(
        description="Degrees between the nearest angle and its limit; below 0 the angle is beyond its limit. The apparatus tolerates 2 deg.",
        examples=[12.5],
    )
    at_s: float = Field(description="Seconds from the start.", examples=[3.2])
    quantity: str = Field(
        description="Name of the angle that is nearest to its limit.", examples=["plane of elevation"]
    )
    quantity_key: OptionalKey = None
    value_deg: float = Field(description="Value of this angle at that time.", examples=[117.5])
    limit_deg: float = Field(description="Limit of this angle in this pose.", examples=[130.0])


class RecordingDetail(Recording):
    """A recording with the ranges of its motors."""

    readable: bool = Field(
        description="False if the samples are damaged. The recording can then be viewed but not played."
    )
    ranges: list[MotorRange] = Field(description="One entry per motor; empty if the samples are damaged.")
    margin: ReachMargin | None = Field(
        None, description="Smallest margin to the reachable set; null if the samples are damaged."
    )


class RecordingUpdate(Schema):
    """A change of a recording. ``updated_at`` is the version that the editor saw. If the recording has changed since, nothing is saved."""

    name: Name | None = None
    note: Note | None = None
    archived: StrictBool | None = Field(None, description="True archives the recording, false restores it.")
    updated_at: Moment | None = None


class PlacedText(TextKey):
    """Code and parameters of an English text, and the places where it occurs."""

    places: list[str] = Field(description="JSON pointers to the places.", examples=[["/layout/xaxis/title/text"]])


class Figure(Schema):
    """A Plotly figure."""

    data: list[dict[str, Any]]
    layout: dict[str, Any]
    texts: list[PlacedText] = Field([], description="Codes of the figure's English texts, for translation.")
