"""Patients as they go in and out."""

from datetime import date
from typing import Annotated, Literal
from uuid import UUID

from pydantic import Field, StrictBool, StringConstraints

from kata.pagination import Next
from kata.types import NO_NUL, Moment, Name, Note, PastDay, Schema, Side

Sex = Literal["female", "male", "other", "unknown"]
ClinicNumber = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=32, pattern=NO_NUL)]


class PatientCreate(Schema):
    """What is needed to sign a patient up."""

    clinic_number: ClinicNumber = Field(description="The clinic's own number, unique.", examples=["K-0042"])
    name: Name = Field(examples=["Yamada Hanako"])
    kana: Name | None = Field(None, description="Reading of the name.", examples=["ヤマダ ハナコ"])
    birth_date: PastDay | None = Field(None, examples=["1968-04-12"])
    sex: Sex = "unknown"
    dominant_side: Side | None = None
    affected_side: Side = Field(description="The shoulder that is treated; its episode of care is opened with this.")
    notes: Note = Field("", examples=["Sleeps badly on the left side."])


class PatientUpdate(Schema):
    """Any part of it. ``updated_at`` is the one the editor saw; if the record has changed since, nothing is saved."""

    clinic_number: ClinicNumber | None = None
    name: Name | None = None
    kana: Name | None = None
    birth_date: PastDay | None = None
    sex: Sex | None = None
    dominant_side: Side | None = None
    notes: Note | None = None
    archived: StrictBool | None = Field(None, description="True archives, false restores.")
    updated_at: Moment | None = None


class Patient(Schema):
    """A patient's record."""

    id: UUID
    clinic_number: str = Field(examples=["K-0042"])
    name: str = Field(examples=["Yamada Hanako"])
    kana: str | None
    birth_date: date | None
    sex: Sex
    dominant_side: Side | None
    affected_side: Side | None = Field(description="Of the episode that goes on, or was the last; null without any.")
    episode_id: UUID | None = Field(description="Of the episode that goes on, or was the last; null without any.")
    notes: str
    created_at: Moment
    updated_at: Moment
    archived_at: Moment | None
    erased_at: Moment | None = Field(description="When what tells who this is was taken away. UTC.")
    restricted: bool = Field(description="Only a care team sees the record; others break the glass.")

    def without_record(self) -> "Patient":
        """Who it is, and nothing of what is known of them: for whoever has not broken the glass yet."""
        nothing = dict.fromkeys(("kana", "birth_date", "dominant_side", "affected_side", "episode_id", "erased_at"))
        return self.model_copy(update=nothing | {"sex": "unknown", "notes": ""})


class PatientPage(Schema):
    """Some of the patients that match, in the order of their names."""

    items: list[Patient]
    next: Next
