"""Programmes as they go in and out."""

from typing import Annotated
from uuid import UUID

from pydantic import Field, StrictBool

from kata.clinic.sessions.schemas import PlaybackSettings
from kata.motion.method import Method
from kata.station.schemas import LoadLevel, OptionalKey
from kata.types import By, Moment, Name, Note, Schema, Side

MOST_ITEMS = 50

Position = Annotated[int, Field(ge=1, le=MOST_ITEMS, description="Place in the programme, from 1.", examples=[1])]
Number = Annotated[int, Field(ge=1, description="Number of the version, from 1.", examples=[2])]
Duration = Annotated[
    float, Field(ge=0, description="Playing time with repetitions and pauses, seconds.", examples=[180.0])
]
Timer = Annotated[
    float | None,
    Field(
        ge=1,
        le=240,
        description="After so many minutes of playing in a session no further item is begun. Null: there is no timer.",
        examples=[20.0],
    ),
]
Wish = Annotated[
    int | None, Field(ge=1, le=21, description="How many sessions a week it is to be done in.", examples=[3])
]


class ItemWanted(PlaybackSettings):
    """One recording to be played, and how. Unless given, as it was taught, once."""

    recording_id: UUID
    load_level: LoadLevel
    method: Method = "smooth"


class ItemsWanted(Schema):
    """Recordings in the order in which they are to be played."""

    items: list[ItemWanted] = Field(min_length=1, max_length=MOST_ITEMS)


class PreviewWanted(ItemsWanted):
    """What a programme would say."""

    episode_id: UUID | None = Field(None, description="Unless given, the episode that goes on.")


class VersionWanted(ItemsWanted):
    """What a programme is to say from now on."""

    made_by: By = Field("", description="Who prescribes it: you, unless somebody else is named.", examples=["Aoki Rin"])
    note: Note = Field("", description="Why.", examples=["Less range: pain after the last session."])
    timer_minutes: Timer = None
    sessions_per_week: Wish = None


class ProgrammeCreate(VersionWanted):
    """A new programme, with its first version."""

    name: Name = Field(examples=["Morning"])
    episode_id: UUID | None = Field(None, description="Unless given, the episode that goes on.")


class VersionCreate(VersionWanted):
    """A new version of a programme."""

    based_on: Number = Field(description="The version that the editor saw; if there is a newer one, nothing is saved.")


class ProgrammeUpdate(Schema):
    """Any part of what is no prescription. ``updated_at`` is the one the editor saw; if it has changed since, nothing is saved."""

    name: Name | None = None
    archived: StrictBool | None = Field(None, description="True archives, false restores.")
    updated_at: Moment | None = None


class ProgrammeItem(ItemWanted):
    """One recording of a version."""

    position: Position
    recording_name: str = Field(examples=["Flexion, take 1"])
    recording_archived: bool = Field(description="True: it cannot be played until it is restored.")
    duration_s: Duration


class ProgrammeVersion(Schema):
    """What was prescribed from a moment on; it never changes."""

    id: UUID
    number: Number
    made_at: Moment
    made_by: str
    note: str
    timer_minutes: Timer
    sessions_per_week: Wish
    duration_s: Duration
    items: list[ProgrammeItem]


class Programme(Schema):
    """A prescription within an episode, as it stands."""

    id: UUID
    episode_id: UUID
    name: str
    side: Side
    archived_at: Moment | None
    updated_at: Moment
    current: ProgrammeVersion


class ProgrammeList(Schema):
    """A patient's programmes, the one changed last first, archived ones last."""

    items: list[Programme]


class ProgrammePatient(Schema):
    """Whose programme it is."""

    id: UUID
    name: str


class ProgrammeDetail(Programme):
    """A programme with all that it ever said."""

    patient: ProgrammePatient
    closed: bool = Field(description="Its episode is closed: it takes no new version.")
    versions: list[ProgrammeVersion] = Field(description="Newest first.")


class ItemPreview(Schema):
    """How long one item would take, or why it cannot be one."""

    duration_s: float | None = Field(ge=0, description="Playing time, seconds; null where it cannot be played.")
    problem: str | None = Field(description="Why not, in a sentence.")
    problem_key: OptionalKey = None


class Preview(Schema):
    """What would come of it, item by item."""

    duration_s: Duration = Field(description="Of those that can be played together, seconds.")
    items: list[ItemPreview]
