"""Request and response models of questionnaires."""

from pydantic import Field

from kata.i18n import Language
from kata.types import Schema


class ChangeThreshold(Schema):
    """A change of the total and where it comes from."""

    points: float
    up_to_points: float | None = Field(description="The upper end if the source gives a range.")
    source: str


class Questionnaire(Schema):
    """A questionnaire that Kata can score."""

    code: str = Field(examples=["quickdash"])
    title: str
    highest_points: float = Field(description="The highest total. The lowest is 0, except of a T-score.")
    better: str = Field(description="lower or higher: which total is better.", examples=["lower"])
    items: int = Field(ge=1)
    most_unanswered: int = Field(ge=0, description="With more unanswered items there is no score.")
    scoring_source: str
    copyright: str
    important: ChangeThreshold = Field(description="The smallest change that patients call important.")
    detectable: ChangeThreshold = Field(description="A change of one patient up to this may be chance.")
    languages: list[Language] = Field(description="Languages whose licensed texts the clinic has imported.")
