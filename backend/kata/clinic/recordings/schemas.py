"""Recordings as they go in and out."""

from typing import Any
from uuid import UUID

from pydantic import Field

from kata.clinic.fields import Moment, Motor, Name, Note, Schema, Side


class Recording(Schema):
    """What was taught in one take."""

    id: UUID
    patient_id: UUID
    teaching_id: UUID
    take: int = Field(ge=1, description="Which press of the pedal within its teaching.")
    name: str = Field(examples=["Flexion, take 1"])
    side: Side
    station: str = Field(description="Where it was taught.", examples=["Station 1"])
    taught_at: Moment
    duration_s: float = Field(ge=0, description="Seconds.", examples=[22.1])
    rate_hz: int = Field(ge=1, description="Samples a second.", examples=[100])
    samples: int = Field(ge=2, examples=[2210])
    note: str
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
    """Any part of what may change."""

    name: Name | None = None
    note: Note | None = None
    archived: bool | None = Field(None, description="True archives, false restores.")


class Figure(Schema):
    """A Plotly figure, to be drawn as it is."""

    data: list[dict[str, Any]]
    layout: dict[str, Any]
