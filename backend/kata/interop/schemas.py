"""What is exchanged, as it goes in and out."""

from typing import Annotated, Literal
from uuid import UUID

from pydantic import Field, StringConstraints

from kata.clinic.patients.schemas import Patient
from kata.clinic.recordings.schemas import MotorRange, RecordingDetail
from kata.types import NO_NUL, By, Moment, Note, Schema, Side

Reason = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=2000, pattern=NO_NUL)]


class UnderstoodMotion(Schema):
    """What a CSV file of a motion says, for whoever brought it to compare."""

    layout: Literal["poses", "motors"] = Field(
        description="poses: the body's five angles (scapula_abduction ...); motors: motor_1_deg to motor_5_deg."
    )
    separator: Literal["comma", "semicolon", "tab"]
    left_alone: list[str] = Field(description="Columns of the file that mean nothing here.", examples=[["remark"]])
    side: Side
    samples: int = Field(ge=2, description="Rows of numbers.", examples=[2210])
    duration_s: float = Field(ge=0, description="Seconds.", examples=[22.1])
    rate_hz: int = Field(ge=1, description="Rows a second, most of the time.", examples=[100])
    ranges: list[MotorRange] = Field(description="What each motor would do.")


class ImportedMotion(Schema):
    """A new recording, and what was understood of its file."""

    recording: RecordingDetail
    understood: UnderstoodMotion


class ImportedPatients(Schema):
    """Who was signed up, and what of the resources is not kept here."""

    items: list[Patient]
    left_out: list[str] = Field(
        description="Elements that were not taken over, by their path.", examples=[["Patient.telecom"]]
    )


class ErasureRequest(Schema):
    """A patient asks for the record to be erased."""

    reason: Reason = Field(examples=["Asked for it in writing on 20 November."])
    noted_by: By = Field("", description="Who noted it: you, unless somebody else is named.", examples=["Suzuki Aya"])


class ErasureRefusal(Schema):
    """The record is kept, and why."""

    explanation: Reason = Field(examples=["Records are kept by law for five years after the last visit."])
    decided_by: By = Field("", description="You, unless somebody else is named.", examples=["Director Kobayashi"])


class ErasureConsent(Schema):
    """What tells who the patient is, is taken away. Nothing brings it back."""

    clinic_number: str = Field(
        max_length=32, description="The patient's, typed once more: this cannot be undone.", examples=["K-0042"]
    )
    explanation: Note = Field("", description="Without naming the patient.", examples=["Nothing forbids it."])
    decided_by: By = Field("", description="You, unless somebody else is named.", examples=["Director Kobayashi"])


class Erasure(Schema):
    """A request for erasure, and what was decided."""

    id: UUID
    patient_id: UUID
    asked_at: Moment
    reason: str = Field(description="Empty once the record is erased: it may have named the patient.")
    noted_by: str
    decided_at: Moment | None
    decided_by: str
    decision: Literal["erased", "refused"] | None = Field(description="Null while nobody has decided.")
    explanation: str


class ErasureList(Schema):
    """Requests for erasure, oldest first."""

    items: list[Erasure]
