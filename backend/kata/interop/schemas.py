"""Request and response models of import, export and erasure."""

from typing import Annotated, Literal
from uuid import UUID

from pydantic import Field, StringConstraints

from kata.clinic.patients.schemas import Patient
from kata.clinic.recordings.schemas import MotorRange, ReachMargin, RecordingDetail
from kata.types import NO_NUL, By, Moment, Note, Schema, Side

Reason = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=2000, pattern=NO_NUL)]


class UnderstoodMotion(Schema):
    """The content of a CSV file, for comparison by the user."""

    layout: Literal["poses", "motors"] = Field(
        description="poses: the body's five angles (scapula_abduction ...); motors: motor_1_deg to motor_5_deg."
    )
    separator: Literal["comma", "semicolon", "tab"]
    left_alone: list[str] = Field(description="Columns of the file that are ignored.", examples=[["remark"]])
    side: Side
    samples: int = Field(ge=2, description="Number of data rows.", examples=[2210])
    duration_s: float = Field(ge=0, description="Seconds.", examples=[22.1])
    rate_hz: int = Field(ge=1, description="Usual number of rows a second.", examples=[100])
    ranges: list[MotorRange] = Field(description="Range and speed of each motor.")
    margin: ReachMargin = Field(description="Smallest margin to the reachable set.")
    simulated: bool = Field(False, description="True if the file was exported from a simulated apparatus.")


class ImportedMotion(Schema):
    """A new recording and the content of its file."""

    recording: RecordingDetail
    understood: UnderstoodMotion


class ImportedPatients(Schema):
    """The registered patients and the elements that were not stored."""

    items: list[Patient]
    left_out: list[str] = Field(
        description="Elements that were not imported, by their path.", examples=[["Patient.telecom"]]
    )
    left_out_further: int = Field(ge=0, description="Number of further elements that were not imported.")


class ErasureRequest(Schema):
    """A patient's request for erasure of the record."""

    reason: Reason = Field(examples=["Asked for it in writing on 20 November."])
    noted_by: By = Field(
        "", description="Name of the person who recorded the request; empty: your name.", examples=["Suzuki Aya"]
    )


class ErasureRefusal(Schema):
    """The refusal of a request, with its reason."""

    explanation: Reason = Field(examples=["Records are kept by law for five years after the last visit."])
    decided_by: By = Field(
        "", description="Name of the person who decided; empty: your name.", examples=["Director Kobayashi"]
    )


class ErasureConsent(Schema):
    """The approval of a request. The identifying data are erased and cannot be restored."""

    clinic_number: str = Field(
        max_length=32,
        description="The patient's clinic number, typed again as confirmation: this cannot be undone.",
        examples=["K-0042"],
    )
    explanation: Note = Field("", description="The text must not name the patient.", examples=["Nothing forbids it."])
    decided_by: By = Field(
        "", description="Name of the person who decided; empty: your name.", examples=["Director Kobayashi"]
    )


class Erasure(Schema):
    """A request for erasure and its decision."""

    id: UUID
    patient_id: UUID
    asked_at: Moment
    reason: str = Field(description="Empty once the record is erased, because it may have named the patient.")
    noted_by: str
    decided_at: Moment | None
    decided_by: str
    decision: Literal["erased", "refused"] | None = Field(description="Null while undecided.")
    explanation: str
