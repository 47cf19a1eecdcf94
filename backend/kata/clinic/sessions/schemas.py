"""Sessions and runs as they go in and out."""

from typing import Literal
from uuid import UUID

from pydantic import Field

from kata.clinic.fields import Moment, Motor, Note, Schema
from kata.clinic.recordings.schemas import Figure
from kata.station.schemas import LoadLevel

Outcome = Literal["loaded", "completed", "returned", "stopped", "unloaded", "interrupted"]


class MotorTracking(Schema):
    """One motor's errors, playback minus teaching."""

    motor: Motor
    peak_deg: float = Field(description="Largest error with its sign, degrees.", examples=[-1.4])
    peak_at_s: float = Field(description="Where on the recording, seconds.", examples=[6.2])
    rmse_deg: float = Field(ge=0, description="Root of the mean square, degrees.", examples=[0.4])
    start_deg: float = Field(description="Error of the first sample, degrees.", examples=[0.1])


class Comparison(Schema):
    """Playback against teaching."""

    samples: int = Field(ge=1, description="Samples compared.")
    motors: list[MotorTracking] = Field(min_length=5, max_length=5)


class RunStop(Schema):
    """What stopped a run."""

    code: str = Field(examples=["estop_pressed"])
    message: str = Field(examples=["The emergency stop was pressed."])


class Run(Schema):
    """One playback of one recording."""

    id: UUID
    session_id: UUID
    recording_id: UUID
    recording_name: str
    started_at: Moment
    ended_at: Moment | None
    outcome: Outcome = Field(
        description="loaded: not ended yet. completed: played to its end. returned: ended early by the therapist. "
        "stopped: by a stop. unloaded: never played. interrupted: the control program ended during it."
    )
    stop: RunStop | None
    rate_hz: int | None = Field(ge=1, description="Samples a second.")
    load_level: LoadLevel | None = Field(
        description="Resistance at which the arm was to be taken back; null for a run of before there were levels."
    )
    comparison: Comparison | None = Field(description="Null while nothing was played.")


class RunFigure(Schema):
    """The paper's figure for one motor: angles on the left axis, error on the right one."""

    motor: Motor
    figure: Figure


class RunFigures(Schema):
    """One figure a motor."""

    motors: list[RunFigure]


class SessionPatient(Schema):
    """Whose session it is."""

    id: UUID
    name: str
    clinic_number: str


class SessionCreate(Schema):
    """What is needed to begin a session."""

    patient_id: UUID


class SessionUpdate(Schema):
    """What may change."""

    note: Note | None = None


class SessionSummary(Schema):
    """A session in a list."""

    id: UUID
    patient: SessionPatient
    started_at: Moment
    ended_at: Moment | None
    runs: int = Field(ge=0, description="How many playbacks.")
    stops: int = Field(ge=0, description="How many of them were stopped.")


class Session(Schema):
    """A session with its runs, in their order."""

    id: UUID
    patient: SessionPatient
    started_at: Moment
    ended_at: Moment | None
    note: str
    runs: list[Run]


class SessionPage(Schema):
    """Some sessions, newest first."""

    items: list[SessionSummary]
    total: int = Field(ge=0)
