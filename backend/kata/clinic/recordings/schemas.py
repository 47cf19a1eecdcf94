"""Recordings as they go in and out."""

from typing import Annotated, Any
from uuid import UUID

from pydantic import BeforeValidator, Field, StrictBool

from kata.station.schemas import OptionalKey, TextKey
from kata.types import Fixture, Moment, Motor, Name, Note, Schema, Side

Fixtures = Annotated[
    set[Fixture],
    Field(
        max_length=3,
        description="What the arm was in: arm fixer 1 for motions 1 to 5, arm fixer 2 with elbow fixer 1 for motion 6. Empty where "
        "nobody has said.",
        examples=[["arm_fixer_1"]],
    ),
]


class Recording(Schema):
    """What was taught in one take, or made of another recording."""

    id: UUID
    patient_id: UUID
    teaching_id: UUID | None = Field(description="Null for what was made of another recording, or came in a file.")
    take: int | None = Field(ge=1, description="Which press of the pedal within its teaching.")
    parent_id: UUID | None = Field(
        description="The recording that it was made of; null for what was taught or came in a file."
    )
    done: list[str] = Field(
        description="What was done to what was taught, in order; the last of it to the parent.",
        examples=[["trimmed to 1.0 s to 6.5 s", "mirrored for the left shoulder"]],
    )
    done_keys: Annotated[list[OptionalKey], BeforeValidator(lambda keys: keys or [])] = Field(
        [], description="Code and parameters of each of `done`; none for a recording from before they were stored."
    )
    name: str = Field(examples=["Flexion, take 1"])
    side: Side
    station: str = Field(description="Where it was taught, or made.", examples=["Station 1"])
    taught_by: str = Field(description="Whose hands guided the arm; empty where nobody has said.", examples=["Sato"])
    fixtures: list[Fixture] = Field(description="What the arm was in.", examples=[["arm_fixer_1"]])
    taught_at: Moment = Field(description="When it was taught, or made. UTC.")
    duration_s: float = Field(ge=0, description="Seconds.", examples=[22.1])
    rate_hz: int = Field(ge=1, description="Samples a second of what was taught.", examples=[100])
    samples: int = Field(ge=2, examples=[2210])
    note: str
    updated_at: Moment
    archived_at: Moment | None


class RecordingList(Schema):
    """A patient's recordings, newest first."""

    items: list[Recording]


class MotorRange(Schema):
    """What one motor does in a recording."""

    motor: Motor
    min_deg: float = Field(description="Degrees.")
    max_deg: float = Field(description="Degrees.")
    max_speed_deg_s: float = Field(ge=0, description="Fastest tenth of a second, degrees a second.")


class RecordingDetail(Recording):
    """A recording with what its samples say."""

    readable: bool = Field(description="False when its samples are damaged: it can be looked up, but not played.")
    ranges: list[MotorRange] = Field(description="One a motor; empty when the samples are damaged.")


class RecordingUpdate(Schema):
    """Any part of what may change. ``updated_at`` is the one the editor saw; if it has changed since, nothing is saved."""

    name: Name | None = None
    note: Note | None = None
    archived: StrictBool | None = Field(None, description="True archives, false restores.")
    updated_at: Moment | None = None


class PlacedText(TextKey):
    """Code and parameters of an English text, and where it stands."""

    places: list[str] = Field(description="JSON pointers.", examples=[["/layout/xaxis/title/text"]])


class Figure(Schema):
    """A Plotly figure, to be drawn as it is."""

    data: list[dict[str, Any]]
    layout: dict[str, Any]
    texts: list[PlacedText] = Field([], description="For the translation of its English texts.")
