"""Request and response models of patients."""

from datetime import date
from typing import Annotated, Literal
from uuid import UUID

from pydantic import Field, StrictBool, StringConstraints

from kata.types import NO_NUL, Moment, Name, Note, PastDay, Schema, Side

Sex = Literal["female", "male", "other", "unknown"]
ClinicNumber = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=32, pattern=NO_NUL)]


class PatientCreate(Schema):
    """A new patient."""

    clinic_number: ClinicNumber = Field(description="Unique number that the clinic has given.", examples=["K-0042"])
    name: Name = Field(examples=["Yamada Hanako"])
    kana: Name | None = Field(None, description="Reading of the name in kana.", examples=["ヤマダ ハナコ"])
    birth_date: PastDay | None = Field(None, examples=["1968-04-12"])
    sex: Sex = "unknown"
    dominant_side: Side | None = None
    affected_side: Side = Field(description="The treated shoulder. An episode of care is opened for this shoulder.")
    notes: Note = Field("", examples=["Sleeps badly on the left side."])


class PatientUpdate(Schema):
    """A change of a record. ``updated_at`` is the version that the editor saw. If the record has changed since, nothing is saved."""

    clinic_number: ClinicNumber | None = None
    name: Name | None = None
    kana: Name | None = None
    birth_date: PastDay | None = None
    sex: Sex | None = None
    dominant_side: Side | None = None
    notes: Note | None = None
    archived: StrictBool | None = Field(None, description="True archives the record, false restores it.")
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
    affected_side: Side | None = Field(
        description="Shoulder of the open episode, else of the last one; null without an episode."
    )
    episode_id: UUID | None = Field(description="The open episode, else the last one; null without an episode.")
    notes: str
    created_at: Moment
    updated_at: Moment
    archived_at: Moment | None
    erased_at: Moment | None = Field(description="Time at which the identifying data were erased. UTC.")
    restricted: bool = Field(
        description="True if only the care team sees the record. Other users need a break-glass access."
    )

    def without_record(self) -> "Patient":
        """Return the record with only name and clinic number, for a user without access to it."""
        nothing = dict.fromkeys(("kana", "birth_date", "dominant_side", "affected_side", "episode_id", "erased_at"))
        return self.model_copy(update=nothing | {"sex": "unknown", "notes": ""})
