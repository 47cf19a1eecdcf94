"""Request and response models of questionnaires."""

from pydantic import Field

from kata.i18n import Language
from kata.types import Schema


class ChangeThreshold(Schema):
    """A change of the total, and its source."""

    points: float
    up_to_points: float | None = Field(description="Upper end of the range, if the source gives a range.")
    source: str


class Questionnaire(Schema):
    """A questionnaire that Kata can score."""

    code: str = Field(examples=["quickdash"])
    title: str
    highest_points: float = Field(description="Highest total. The lowest total is 0, except for a T-score.")
    better: str = Field(description="lower or higher: which total is better.", examples=["lower"])
    items: int = Field(ge=1)
    most_unanswered: int = Field(ge=0, description="Maximum number of unanswered items; with more there is no score.")
    scoring_source: str
    copyright: str
    important: ChangeThreshold = Field(description="Smallest change that patients call important.")
    detectable: ChangeThreshold = Field(description="Largest change of one patient that may be due to chance.")
    languages: list[Language] = Field(description="Languages whose licensed texts the clinic has imported.")
