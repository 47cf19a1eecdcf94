"""Device events as they go out."""

from typing import Literal
from uuid import UUID

from pydantic import Field

from kata.pagination import Next
from kata.station.schemas import OptionalKey
from kata.types import Moment, Schema

EventKind = Literal["alarm", "event"]


class DeviceEvent(Schema):
    """Something that the device told; an alarm where it stopped something."""

    id: UUID
    station: str = Field(examples=["Station 1"])
    at: Moment
    kind: EventKind
    code: str = Field(examples=["estop_pressed"])
    message: str = Field(examples=["The emergency stop was pressed."])
    message_key: OptionalKey = None
    category: int | None = Field(ge=0, le=2, description="Of the stop, where it is an alarm.")
    axis: int | None = Field(ge=1, le=5, description="Motor number, where it belongs to one.")
    patient_id: UUID | None
    session_id: UUID | None
    run_id: UUID | None
    ended_at: Moment | None = Field(description="When an alarm was acknowledged, its cause gone.")

    def of_nobody(self) -> "DeviceEvent":
        """What happened, and not to whom."""
        return self.model_copy(update=dict.fromkeys(("patient_id", "session_id", "run_id")))


class DeviceEventPage(Schema):
    """Some of the events that match, newest first."""

    items: list[DeviceEvent]
    next: Next
