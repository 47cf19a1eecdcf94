"""Response models of device events."""

from typing import Literal
from uuid import UUID

from pydantic import Field

from kata.station.schemas import OptionalKey
from kata.types import Moment, Schema

EventKind = Literal["alarm", "event"]


class DeviceEvent(Schema):
    """An event of the device. An event of the kind alarm has stopped something."""

    id: UUID
    station: str = Field(examples=["Station 1"])
    at: Moment
    kind: EventKind
    code: str = Field(examples=["estop_pressed"])
    message: str = Field(examples=["The emergency stop was pressed."])
    message_key: OptionalKey = None
    category: int | None = Field(ge=0, le=2, description="Category of the stop, if the event is an alarm.")
    axis: int | None = Field(ge=1, le=5, description="Motor number, if the event belongs to a motor.")
    patient_id: UUID | None
    session_id: UUID | None
    run_id: UUID | None
    ended_at: Moment | None = Field(description="Time at which an alarm was acknowledged after its cause had cleared.")

    def without_patient(self) -> "DeviceEvent":
        """Return the event without patient, session and run."""
        return self.model_copy(update=dict.fromkeys(("patient_id", "session_id", "run_id")))
