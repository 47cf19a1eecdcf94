"""Patients as they go in and out."""

from datetime import date
from typing import Annotated, Literal
from uuid import UUID

from pydantic import Field, StringConstraints, field_validator

from kata.clinic.fields import Moment, Name, Note, Schema, Side
from kata.database.base import utc_now

Sex = Literal["female", "male", "other", "unknown"]
ClinicNumber = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=32)]


def _not_in_the_future(birth_date: date | None) -> date | None:
    if birth_date and not date(1900, 1, 1) <= birth_date <= utc_now().date():
        raise ValueError("must be between 1900 and today")
    return birth_date


class PatientCreate(Schema):
    """What is needed to sign a patient up."""

    clinic_number: ClinicNumber = Field(description="The clinic's own number, unique.", examples=["K-0042"])
    name: Name = Field(examples=["Yamada Hanako"])
    kana: Name | None = Field(None, description="Reading of the name.", examples=["ヤマダ ハナコ"])
    birth_date: date | None = Field(None, examples=["1968-04-12"])
    sex: Sex = "unknown"
    affected_side: Side = Field(description="The shoulder that is treated.")
    notes: Note = Field("", examples=["Sleeps badly on the left side."])

    _birth_date = field_validator("birth_date")(_not_in_the_future)


class PatientUpdate(Schema):
    """Any part of it. ``updated_at`` is the one the editor saw; if the record has changed since, nothing is saved."""

    clinic_number: ClinicNumber | None = None
    name: Name | None = None
    kana: Name | None = None
    birth_date: date | None = None
    sex: Sex | None = None
    affected_side: Side | None = None
    notes: Note | None = None
    archived: bool | None = Field(None, description="True archives, false restores.")
    updated_at: Moment | None = None

    _birth_date = field_validator("birth_date")(_not_in_the_future)


class Patient(Schema):
    """A patient's record."""

    id: UUID
    clinic_number: str = Field(examples=["K-0042"])
    name: str = Field(examples=["Yamada Hanako"])
    kana: str | None
    birth_date: date | None
    sex: Sex
    affected_side: Side
    notes: str
    created_at: Moment
    updated_at: Moment
    archived_at: Moment | None


class PatientPage(Schema):
    """Some of the patients that match."""

    items: list[Patient]
    total: int = Field(ge=0, description="How many match in all.")
