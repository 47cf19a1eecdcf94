"""Assessments as they go in and out."""

from datetime import UTC, datetime, timedelta
from typing import Annotated, Final, Self
from uuid import UUID

from pydantic import AwareDatetime, Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from kata.clinic.assessments import rom, spadi
from kata.database.base import utc_now
from kata.pagination import Next
from kata.types import By, Moment, Name, Note, Schema, Side

_CLOCKS_DIFFER: Final = timedelta(minutes=5)
_EARLIEST_YEAR: Final = 1990

Pain = Annotated[int, Field(ge=0, le=10, description="0 is none, 10 the worst imaginable.", examples=[4])]
SpadiAnswer = Annotated[int, Field(ge=0, le=spadi.HIGHEST)]
SpadiAnswers = Annotated[
    list[SpadiAnswer | None],
    Field(
        min_length=len(spadi.ITEMS),
        max_length=len(spadi.ITEMS),
        description="The 13 items in their order, 0 to 10 each; null where one was not answered.",
        examples=[[7, 8, 6, 5, 4, 5, 7, 4, 3, 3, 6, 7, None]],
    ),
]
AssessedAt = Annotated[AwareDatetime, Field(description="When it was found. UTC.", examples=["2026-11-21T09:30:00Z"])]


def _in_the_past(assessed_at: datetime | None) -> datetime | None:
    if assessed_at is None:
        return None
    if assessed_at.year < _EARLIEST_YEAR or assessed_at > utc_now() + _CLOCKS_DIFFER:
        raise PydanticCustomError("moment_out_of_range", "must be between {year} and now", {"year": _EARLIEST_YEAR})
    return assessed_at.astimezone(UTC)


class RomEntry(Schema):
    """How far a shoulder went in one direction."""

    side: Side
    motion: rom.MotionId
    kind: rom.Kind
    position: rom.Position = Field(
        "", validate_default=True, description="Where the arm was; of rotation only. Empty for every other motion."
    )
    angle_deg: float = Field(
        ge=min(measure.lowest_deg for measure in rom.MEASURES),
        le=max(measure.highest_deg for measure in rom.MEASURES),
        allow_inf_nan=False,
        description="Degrees; below zero where neutral is not reached. What is plausible depends on the motion.",
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
        raise PydanticCustomError("measured_twice", "must hold each side, motion, kind and position once")
    return entries


_MOST_ENTRIES: Final = 2 * len(rom.KINDS) * len(rom.MEASURES)
RomEntries = Annotated[list[RomEntry], Field(max_length=_MOST_ENTRIES)]


class AssessmentCreate(Schema):
    """What was found. Nothing has to be measured, but something."""

    assessed_at: AssessedAt
    assessed_by: By = Field("", description="You, unless somebody else is named.", examples=["Kimura Jun"])
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
            raise PydanticCustomError("nothing_found", "must hold something that was found")
        return self


class AssessmentUpdate(Schema):
    """Any part of it. What is given replaces what was there: ``rom`` all its entries, null what is taken back.

    ``updated_at`` is the one the editor saw; if it has been changed since, nothing is saved.
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
    """It was entered by mistake."""

    updated_at: AwareDatetime = Field(
        description="The one that was seen: what has been changed since is not withdrawn. UTC.",
        examples=["2026-11-21T09:30:00Z"],
    )


class SpadiScore(Schema):
    """0 is none, 100 the worst; null where more than two items of a subscale were left unanswered."""

    pain: float | None = Field(ge=0, le=100)
    disability: float | None = Field(ge=0, le=100)
    total: float | None = Field(ge=0, le=100, description="The mean of both.", examples=[54.6])


class Assessment(Schema):
    """What was found on a day."""

    id: UUID
    episode_id: UUID
    assessed_at: Moment
    assessed_by: str
    rom: list[RomEntry]
    pain_rest: Pain | None
    pain_active: Pain | None
    pain_passive: Pain | None
    pain_average: Pain | None = Field(description="Over the last week.")
    spadi: SpadiAnswers | None
    spadi_score: SpadiScore | None = Field(description="Null where it was not asked.")
    note: str
    updated_at: Moment
    withdrawn_at: Moment | None = Field(description="When it was said to have been entered by mistake. UTC.")


class AssessmentPage(Schema):
    """Some of them, newest first; withdrawn ones are among them."""

    items: list[Assessment]
    next: Next


class EpisodeAssessments(AssessmentPage):
    """An episode's, and what they are held against."""

    baseline: Assessment | None = Field(description="The first that was not withdrawn.")


class RomMeasure(Schema):
    """One motion with the arm in one position."""

    motion: rom.MotionId
    position: rom.Position
    name: str = Field(examples=["External rotation, arm at the side"])
    name_ja: str = Field(examples=["外旋(1st)"])
    lowest_deg: float = Field(description="Less is not plausible, degrees.")
    highest_deg: float = Field(description="More is not plausible, degrees.")
    reference_deg: float = Field(description="Of a healthy shoulder, degrees.")


class SpadiItem(Schema):
    """One question, in words of our own."""

    subscale: spadi.Subscale
    text: str = Field(examples=["Washing the hair"])
    text_ja: str = Field(examples=["髪を洗う"])


class AssessmentForm(Schema):
    """What an assessment may hold, in the order in which it is asked for."""

    rom: list[RomMeasure]
    spadi: list[SpadiItem]
    spadi_perhaps_important: float = Field(ge=0, le=100, description="Less of a change is not important to patients.")
    spadi_important: float = Field(ge=0, le=100, description="As much of a change, or more, is.")


def has_findings(assessment: "AssessmentCreate | Assessment") -> bool:
    """Whether anything stands in it."""
    pains = (assessment.pain_rest, assessment.pain_active, assessment.pain_passive, assessment.pain_average)
    answered = any(answer is not None for answer in assessment.spadi or [])
    return bool(assessment.rom or assessment.note or answered or any(pain is not None for pain in pains))
