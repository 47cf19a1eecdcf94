"""Request and response models of programmes."""

from typing import Annotated
from uuid import UUID

from pydantic import Field, StrictBool

from kata.clinic.sessions.schemas import EndRangePrescription, PlaybackSettings
from kata.motion.method import Method
from kata.station.schemas import OptionalKey, ResistanceLevel
from kata.types import By, Moment, Name, Note, Schema, Side

MOST_ITEMS = 50

Position = Annotated[int, Field(ge=1, le=MOST_ITEMS, description="Position in the programme, from 1.", examples=[1])]
Number = Annotated[int, Field(ge=1, description="Number of the version, from 1.", examples=[2])]
Duration = Annotated[
    float, Field(ge=0, description="Playing time with repetitions and pauses, seconds.", examples=[180.0])
]
Timer = Annotated[
    float | None,
    Field(
        ge=1,
        le=240,
        description="Minutes of playing after which no further item is started in a session. Null: no timer.",
        examples=[20.0],
    ),
]
SessionsPerWeek = Annotated[int | None, Field(ge=1, le=21, description="Prescribed sessions per week.", examples=[3])]


class ProgrammeItemRequest(PlaybackSettings):
    """One recording and its settings. By default the recording is played once, as taught."""

    recording_id: UUID
    resistance_level: ResistanceLevel
    method: Method = "smooth"
    end_range: EndRangePrescription | None = Field(None, description="Null: no end-range time is prescribed.")
    self_paced: StrictBool = Field(
        False,
        description="True: the patient's effort sets the pace, up to the speed of the item. Needs the doctor's permission in the episode and "
        "the method smooth.",
    )


class ProgrammeItemsRequest(Schema):
    """Recordings in the order of playback."""

    items: list[ProgrammeItemRequest] = Field(min_length=1, max_length=MOST_ITEMS)


class ProgrammePreviewRequest(ProgrammeItemsRequest):
    """The programme to check."""

    episode_id: UUID | None = Field(None, description="Episode of the programme; by default the open episode.")


class VersionFields(ProgrammeItemsRequest):
    """The content of a version."""

    made_by: By = Field("", description="Name of the person who prescribes; empty: your name.", examples=["Aoki Rin"])
    note: Note = Field(
        "", description="Reason for this version.", examples=["Less range: pain after the last session."]
    )
    timer_minutes: Timer = None
    sessions_per_week: SessionsPerWeek = None


class ProgrammeCreate(VersionFields):
    """A new programme, with its first version."""

    name: Name = Field(examples=["Morning"])
    episode_id: UUID | None = Field(None, description="Episode of the programme; by default the open episode.")


class VersionCreate(VersionFields):
    """A new version of a programme."""

    based_on: Number = Field(
        description="Number of the version that the editor saw. If there is a newer version, nothing is saved."
    )


class ProgrammeUpdate(Schema):
    """A change of a programme's name, or its archiving or restoring.

    ``updated_at`` is the version that the editor saw. If the programme has changed since, nothing is saved.
    """

    name: Name | None = None
    archived: StrictBool | None = Field(None, description="True archives the programme, false restores it.")
    updated_at: Moment | None = None


class ProgrammeItem(ProgrammeItemRequest):
    """One recording of a version."""

    position: Position
    recording_name: str = Field(examples=["Flexion, take 1"])
    recording_archived: bool = Field(description="True if the recording must be restored before it can be played.")
    duration_s: Duration


class ProgrammeVersion(Schema):
    """A prescription that is valid from a date on. It never changes."""

    id: UUID
    number: Number
    made_at: Moment
    made_by: str
    note: str
    timer_minutes: Timer
    sessions_per_week: SessionsPerWeek
    duration_s: Duration
    items: list[ProgrammeItem]


class Programme(Schema):
    """A prescription within an episode, with its newest version."""

    id: UUID
    episode_id: UUID
    name: str
    side: Side
    archived_at: Moment | None
    updated_at: Moment
    current: ProgrammeVersion


class ProgrammePatient(Schema):
    """The patient of a programme."""

    id: UUID
    name: str


class ProgrammeDetail(Programme):
    """A programme with all its versions."""

    patient: ProgrammePatient
    closed: bool = Field(description="True if the programme's episode is closed, so that no new version is accepted.")
    versions: list[ProgrammeVersion] = Field(description="Newest first.")


class ItemPreview(Schema):
    """Duration of one item, or the reason why it cannot be played."""

    duration_s: float | None = Field(ge=0, description="Playing time, seconds; null if the item cannot be played.")
    problem: str | None = Field(description="Reason why the item cannot be played, as a sentence.")
    problem_key: OptionalKey = None


class Preview(Schema):
    """The result of the check, item by item."""

    duration_s: Duration = Field(description="Playing time of all playable items together, seconds.")
    items: list[ItemPreview]
