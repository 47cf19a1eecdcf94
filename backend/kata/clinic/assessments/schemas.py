"""Request and response models of assessments."""

from datetime import UTC, datetime, timedelta
from typing import Annotated, Final, Self
from uuid import UUID

from pydantic import AwareDatetime, Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from kata.clinic.assessments import rom, spadi
from kata.database.base import utc_now
from kata.pagination import Page
from kata.types import By, Moment, Name, Note, Schema, Side

_CLOCKS_DIFFER: Final = timedelta(minutes=5)
_EARLIEST_YEAR: Final = 1990

Pain = Annotated[int, Field(ge=0, le=10, description="0 is no pain, 10 the worst imaginable pain.", examples=[4])]
SpadiAnswer = Annotated[int, Field(ge=0, le=spadi.HIGHEST)]
SpadiAnswers = Annotated[
    list[SpadiAnswer | None],
    Field(
        min_length=len(spadi.ITEMS),
        max_length=len(spadi.ITEMS),
        description="Answers to the 13 items in their order, 0 to 10 each; null for an unanswered item.",
        examples=[[7, 8, 6, 5, 4, 5, 7, 4, 3, 3, 6, 7, None]],
    ),
]
AssessedAt = Annotated[
    AwareDatetime, Field(description="Time of the examination. UTC.", examples=["2026-11-21T09:30:00Z"])
]


def _in_the_past(assessed_at: datetime | None) -> datetime | None:
    if assessed_at is None:
        return None
    if assessed_at.year < _EARLIEST_YEAR or assessed_at > utc_now() + _CLOCKS_DIFFER:
        raise PydanticCustomError("moment_out_of_range", "must be between {year} and now", {"year": _EARLIEST_YEAR})
    return assessed_at.astimezone(UTC)


class RomEntry(Schema):
    """The angle that a shoulder reached in one direction."""

    side: Side
    motion: rom.MotionId
    kind: rom.Kind
    position: rom.Position = Field(
        "", validate_default=True, description="Position of the arm, for rotation only. Empty for every other motion."
    )
    angle_deg: float = Field(
        ge=min(measure.lowest_deg for measure in rom.MEASURES),
        le=max(measure.highest_deg for measure in rom.MEASURES),
        allow_inf_nan=False,
        description="Degrees; negative if the arm does not reach neutral. The plausible range depends on the motion.",
        examples=[125.0],
    )

    @field_validator("position")
    @classmethod
    def _of_the_motion(cls, position: rom.Position, info: ValidationInfo) -> rom.Position:
        motion = info.data.get("motion")
        if motion and position not in rom.positions_of(motion):
            allowed = " or ".join(rom.positions_of(motion)) or "empty"
            raise PydanticCustomError(
                "position_of_another_motion", "must be {allowed} for this motion", {"allowed": allowed}
            )
        return position

    @field_validator("angle_deg")
    @classmethod
    def _plausible(cls, angle_deg: float, info: ValidationInfo) -> float:
        measure = rom.measure_of(info.data.get("motion", ""), info.data.get("position", ""))
        if measure and not measure.lowest_deg <= angle_deg <= measure.highest_deg:
            raise PydanticCustomError(
                "angle_implausible",
                "must be between {lowest} and {highest} degrees for this motion",
                {"lowest": measure.lowest_deg, "highest": measure.highest_deg},
            )
        return angle_deg


def _each_once(entries: list[RomEntry] | None) -> list[RomEntry] | None:
    keys = [(entry.side, entry.motion, entry.kind, entry.position) for entry in entries or []]
    if len(set(keys)) < len(keys):
        raise PydanticCustomError("measured_twice", "must contain each side, motion, kind and position once")
    return entries


_MOST_ENTRIES: Final = 2 * len(rom.KINDS) * len(rom.MEASURES)
RomEntries = Annotated[list[RomEntry], Field(max_length=_MOST_ENTRIES)]


class AssessmentCreate(Schema):
    """A new assessment. It must contain at least one finding."""

    assessed_at: AssessedAt
    assessed_by: By = Field("", description="Name of the examiner; empty: your name.", examples=["Kimura Jun"])
    rom: RomEntries = Field(default_factory=list)
    pain_rest: Pain | None = None
    pain_active: Pain | None = None
    pain_passive: Pain | None = None
    pain_average: Pain | None = None
    spadi: SpadiAnswers | None = None
    note: Note = ""

    _assessed_at = field_validator("assessed_at")(_in_the_past)
    _rom = field_validator("rom")(_each_once)

    @model_validator(mode="after")
    def _not_empty(self) -> Self:
        if not has_findings(self):
            raise PydanticCustomError("nothing_found", "must contain at least one finding")
        return self


class AssessmentUpdate(Schema):
    """A change of an assessment. A given field replaces the stored value: ``rom`` replaces all entries, and null removes a value.

    ``updated_at`` is the version that the editor saw. If the assessment has changed since, nothing is saved.
    """

    updated_at: AwareDatetime = Field(description="UTC.", examples=["2026-11-21T09:30:00Z"])
    assessed_at: AssessedAt | None = None
    assessed_by: Name | None = None
    rom: RomEntries | None = None
    pain_rest: Pain | None = None
    pain_active: Pain | None = None
    pain_passive: Pain | None = None
    pain_average: Pain | None = None
    spadi: SpadiAnswers | None = None
    note: Note | None = None

    _assessed_at = field_validator("assessed_at")(_in_the_past)
    _rom = field_validator("rom")(_each_once)


class AssessmentWithdraw(Schema):
    """The withdrawal of an assessment that was entered by mistake."""

    updated_at: AwareDatetime = Field(
        description="Version that the user saw. An assessment that has changed since is not withdrawn. UTC.",
        examples=["2026-11-21T09:30:00Z"],
    )


class SpadiScore(Schema):
    """Scores from 0 (none) to 100 (worst). Null if more than two of the 13 items are unanswered."""

    pain: float | None = Field(ge=0, le=100)
    disability: float | None = Field(ge=0, le=100)
    total: float | None = Field(ge=0, le=100, description="The mean of both subscales.", examples=[54.6])


class QuestionnaireScore(Schema):
    """An answered questionnaire."""

    code: str = Field(examples=["quickdash"])
    title: str
    answers: list[int | None] = Field(description="One answer for each item in order; null if unanswered.")
    total_points: float | None = Field(description="Null if too many items are unanswered.")
    highest_points: float | None = Field(description="The highest total.")
    is_t_score: bool = Field(
        description="True if the total is a T-score. 50 is the mean of a reference population, and 10 is its standard deviation."
    )


class Assessment(Schema):
    """The findings of one day."""

    id: UUID
    episode_id: UUID
    assessed_at: Moment
    assessed_by: str
    rom: list[RomEntry]
    pain_rest: Pain | None
    pain_active: Pain | None
    pain_passive: Pain | None
    pain_average: Pain | None = Field(description="Average over the last week.")
    spadi: SpadiAnswers | None
    spadi_score: SpadiScore | None = Field(description="Null if the questionnaire was not answered.")
    questionnaires: list[QuestionnaireScore] = Field([], description="Questionnaires other than the SPADI.")
    note: str
    updated_at: Moment
    withdrawn_at: Moment | None = Field(description="Time at which the assessment was withdrawn. UTC.")


class EpisodeAssessments(Page[Assessment]):
    """An episode's assessments with their baseline."""

    baseline: Assessment | None = Field(description="The first assessment that was not withdrawn.")


class RomZero(Schema):
    """A second zero that is also in use for the same measurement."""

    adds_deg: float = Field(description="Degrees by which an angle counted from this zero is larger.")
    fits_from_deg: float = Field(
        description="Degrees; an angle beyond this, in the direction of `adds_deg`, fits this zero better."
    )


class RomMeasure(Schema):
    """One motion with the arm in one position."""

    motion: rom.MotionId
    position: rom.Position
    name: str = Field(examples=["External rotation, arm at the side"])
    name_ja: str = Field(examples=["外旋(1st)"])
    lowest_deg: float = Field(description="Lowest plausible angle, degrees.")
    highest_deg: float = Field(description="Highest plausible angle, degrees.")
    reference_deg: float = Field(description="Reference of a healthy shoulder, degrees.")
    other_zero: RomZero | None = Field(description="The second zero; null if only one zero is in use.")


class SpadiItem(Schema):
    """One question, in our own words."""

    subscale: spadi.Subscale
    text: str = Field(examples=["Washing the hair"])
    text_ja: str = Field(examples=["髪を洗う"])


class AssessmentForm(Schema):
    """The content of an assessment, in the order of the form."""

    rom: list[RomMeasure]
    spadi: list[SpadiItem]
    spadi_mcid_lower: float = Field(ge=0, le=100, description="Points. A smaller change is not important to patients.")
    spadi_mcid_upper: float = Field(
        ge=0, le=100, description="Points. A change of at least this size is important to patients."
    )
    spadi_mdc: float = Field(ge=0, le=100, description="Points. A smaller change of one patient may be due to chance.")


def has_findings(assessment: "AssessmentCreate | Assessment") -> bool:
    """True if the assessment contains a finding."""
    pains = (assessment.pain_rest, assessment.pain_active, assessment.pain_passive, assessment.pain_average)
    has_spadi = any(answer is not None for answer in assessment.spadi or [])
    questionnaires = isinstance(assessment, Assessment) and assessment.questionnaires
    return bool(
        assessment.rom or assessment.note or has_spadi or questionnaires or any(pain is not None for pain in pains)
    )
