"""Request and response models of episodes of care."""

from typing import Annotated, Final, Literal, Self
from uuid import UUID

from pydantic import Field, StrictBool, StringConstraints, model_validator
from pydantic_core import PydanticCustomError

from kata.clinic.episodes.diagnoses import DiagnosisCode, Verification
from kata.motion.axes import BASIC_MOTIONS
from kata.station.schemas import ResistanceLevel
from kata.types import NO_NUL, Doer, Moment, Note, PastDay, Schema, Side

StageName = Literal["freezing", "frozen", "thawing"]
Diagnosis = Annotated[str, StringConstraints(strip_whitespace=True, max_length=200, pattern=NO_NUL)]

_LOWEST_DEG: Final = min(motion.range_deg[0] for motion in BASIC_MOTIONS)
_HIGHEST_DEG: Final = max(motion.range_deg[1] for motion in BASIC_MOTIONS)


class MotionLimit(Schema):
    """A doctor's limit of one of the six basic motions, as an angle of the body."""

    motion: int = Field(ge=1, le=6, description="Number of the motion in Table 2 of Sun et al. (2025).", examples=[4])
    lowest_deg: float | None = Field(
        None,
        ge=_LOWEST_DEG,
        le=_HIGHEST_DEG,
        description="Degrees; null: the apparatus's own limit.",
        examples=[0.0],
    )
    highest_deg: float | None = Field(
        None,
        ge=_LOWEST_DEG,
        le=_HIGHEST_DEG,
        description="Degrees; null: the apparatus's own limit.",
        examples=[90.0],
    )

    @model_validator(mode="after")
    def _is_a_limit(self) -> Self:
        if self.lowest_deg is None and self.highest_deg is None:
            raise PydanticCustomError("limit_without_angle", "must have a lowest or a highest angle")
        if self.lowest_deg is not None and self.highest_deg is not None and self.lowest_deg >= self.highest_deg:
            raise PydanticCustomError("limits_crossed", "must have a lowest angle below the highest one")
        return self


class _EpisodeFields(Schema):
    """Fields that requests to open and to change an episode have in common."""

    @model_validator(mode="after")
    def _each_motion_once(self) -> Self:
        limits: list[MotionLimit] = getattr(self, "limits", None) or []
        if len({limit.motion for limit in limits}) < len(limits):
            raise PydanticCustomError("motion_twice", "must name each motion once")
        return self


_LIMITS: Final = (
    "The doctor's limits, at most one entry for each motion. Only the apparatus limits a motion without an entry."
)
_LEVEL: Final = "Highest resistance level that the doctor allows; null: no limit."
_SPEED: Final = (
    "Highest speed that the doctor allows, degrees a second. No motor moves faster, also during approach and return. Null: the station's "
    "limit."
)
_SELF_PACED: Final = (
    "True if the doctor permits that the patient's effort sets the pace of a playback. It needs the name of the doctor."
)
_CODE: Final = "ICD-10 code of the diagnosis that the clinician chose. Empty: none was chosen."
_VERIFICATION: Final = "How certain the diagnosis is. Empty: not stated."
_DOCTOR: Final = "Name of the doctor who set the limits. Required if there are limits."
SPEED_RANGE_DEG_S: Final = (1.0, 150.0)
"""Lowest and highest limit in degrees per second. With a lower limit an approach would take minutes; no station moves a motor faster
than the highest.
"""
SpeedLimit = Annotated[float, Field(ge=SPEED_RANGE_DEG_S[0], le=SPEED_RANGE_DEG_S[1])]
Limits = Annotated[list[MotionLimit], Field(max_length=len(BASIC_MOTIONS), description=_LIMITS)]


class EpisodeCreate(_EpisodeFields):
    """A new episode of care."""

    side: Side
    diagnosis: Diagnosis = Field(
        "", description="Diagnosis as the clinician wrote it.", examples=["Adhesive capsulitis"]
    )
    diagnosis_code: DiagnosisCode = Field("", description=_CODE, examples=["M75.0"])
    verification: Verification = Field("", description=_VERIFICATION)
    onset_on: PastDay | None = Field(None, description="Day on which the complaint began.", examples=["2026-05-01"])
    contraindications: Note = Field("", examples=["No abduction beyond 90 degrees."])
    limits: Limits = Field(default_factory=list)
    max_resistance_level: ResistanceLevel | None = Field(None, description=_LEVEL)
    max_speed_deg_s: SpeedLimit | None = Field(None, description=_SPEED, examples=[20.0])
    self_paced_permitted: StrictBool = Field(False, description=_SELF_PACED)
    limits_by: Doer = Field("", description=_DOCTOR, examples=["Dr. Mori"])


class EpisodeUpdate(_EpisodeFields):
    """A change of an episode. ``updated_at`` is the version that the editor saw. If the episode has changed since, nothing is saved."""

    diagnosis: Diagnosis | None = None
    diagnosis_code: DiagnosisCode | None = Field(None, description=_CODE)
    verification: Verification | None = Field(None, description=_VERIFICATION)
    onset_on: PastDay | None = None
    contraindications: Note | None = None
    limits: Limits | None = None
    max_resistance_level: ResistanceLevel | None = Field(None, description=_LEVEL)
    max_speed_deg_s: SpeedLimit | None = Field(None, description=_SPEED)
    self_paced_permitted: StrictBool | None = Field(None, description=_SELF_PACED)
    limits_by: Doer | None = Field(None, description=_DOCTOR)
    updated_at: Moment | None = None


class EpisodeClose(Schema):
    """The end of an episode."""

    closing_note: Note = Field("", examples=["Discharged: full range, no pain."])
    updated_at: Moment | None = None


class StageCreate(Schema):
    """The stage of a shoulder from a given day on."""

    stage: StageName
    since: PastDay = Field(examples=["2026-08-01"])


class Stage(StageCreate):
    """A recorded stage."""

    id: UUID
    noted_at: Moment


class Episode(Schema):
    """The care of one shoulder, from referral to discharge."""

    id: UUID
    patient_id: UUID
    side: Side
    diagnosis: str = Field(description="Diagnosis as the clinician wrote it.")
    diagnosis_code: DiagnosisCode = Field(description=_CODE)
    verification: Verification = Field(description=_VERIFICATION)
    onset_on: PastDay | None
    contraindications: str
    limits: Limits
    max_resistance_level: ResistanceLevel | None = Field(description=_LEVEL)
    max_speed_deg_s: SpeedLimit | None = Field(description=_SPEED)
    self_paced_permitted: bool = Field(description=_SELF_PACED)
    limits_by: str = Field(description=_DOCTOR)
    opened_at: Moment
    closed_at: Moment | None
    closing_note: str
    updated_at: Moment
    stage: Stage | None = Field(description="The newest stage; null if none is recorded.")
    stages: list[Stage] = Field(description="Ordered by day.")
