"""Request and response models of contraindications."""

from typing import Annotated
from uuid import UUID

from pydantic import Field, StringConstraints

from kata.clinic.contraindications.kinds import Code, Effect, Scope
from kata.station.schemas import OptionalKey
from kata.types import NO_NUL, By, Moment, Name, Note, Schema, Side

Reason = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=2000, pattern=NO_NUL)]


class ContraindicationKind(Schema):
    """One entry of the list, with its effect."""

    code: Code
    scope: Scope = Field(description="patient: concerns both shoulders. episode: concerns one shoulder.")
    effect: Effect = Field(
        description="block: teaching and playback are refused. sign_off: refused until a doctor allows them. warn: the banner warns."
    )
    name: str = Field(examples=["Fracture that has not united"])
    name_key: OptionalKey = None
    source: str = Field(description="Source of the effect.")
    source_key: OptionalKey = None


class ContraindicationCreate(Schema):
    """A new contraindication."""

    code: Code
    episode_id: UUID | None = Field(
        None, description="Episode of the shoulder; by default the open episode. Only for a condition of one shoulder."
    )
    note: Note = Field("", examples=["Humeral neck, 3 weeks ago."])
    noted_by: By = Field("", description="Name of the person who recorded it; empty: your name.")


class SignOff(Schema):
    """A doctor's permission to treat in spite of a contraindication."""

    doctor: Name = Field(description="Name of the doctor who allows the treatment.", examples=["Dr. Mori"])


class Resolution(Schema):
    """The end of a contraindication."""

    reason: Reason = Field(examples=["United on the X-ray of 2026-11-20."])
    resolved_by: By = Field("", description="Name of the person who resolved it; empty: your name.")


class Contraindication(ContraindicationKind):
    """A contraindication of a patient."""

    id: UUID
    patient_id: UUID
    episode_id: UUID | None = Field(description="Null for a condition that concerns both shoulders.")
    side: Side | None = Field(description="The shoulder that it concerns, in this and every later episode; null: both.")
    note: str
    noted_at: Moment
    noted_by: str
    signed_off_at: Moment | None
    signed_off_by: str
    resolved_at: Moment | None = Field(description="Time since which it no longer applies; null: it applies.")
    resolved_by: str
    resolution: str
    stops_motion: bool = Field(description="True if it presently forbids teaching and playback.")
