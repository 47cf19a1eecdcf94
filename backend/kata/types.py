"""Kinds of values that several subjects' schemas share."""

import re
from datetime import date, datetime, timedelta
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints
from pydantic_core import PydanticCustomError, PydanticKnownError

from kata.actor import CURRENT_ACTOR
from kata.database.base import utc_now

LONGEST_NAME: Final = 100
NO_NUL: Final = r"^[^\x00]*$"
"""PostgreSQL stores no text with a zero character in it, and nobody means one."""
Side = Literal["left", "right"]
Name = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=LONGEST_NAME, pattern=NO_NUL)]
Doer = Annotated[str, StringConstraints(strip_whitespace=True, max_length=LONGEST_NAME, pattern=NO_NUL)]
"""Who has done something, by name; empty where nobody has said."""


def side_of(stored: str) -> Side:
    """A side as a row keeps it."""
    return "left" if stored == "left" else "right"


def _or_whoever_asks(given: str) -> str:
    actor = CURRENT_ACTOR.get()
    return given or (actor.name if actor else "")


By = Annotated[Doer, AfterValidator(_or_whoever_asks), Field(validate_default=True)]
"""Who has done something: whoever asks, where nobody is named. Given ``""`` as its default."""
Note = Annotated[str, StringConstraints(strip_whitespace=True, max_length=10_000, pattern=NO_NUL)]
_NUMBER: Final = re.compile(r"\s*[+-]?[\d.]+(e[+-]?\d+)?\s*", re.IGNORECASE)
_EASTERNMOST: Final = timedelta(hours=14)
"""So far ahead of UTC it is somewhere already the next day."""


def _not_in_the_future(day: date) -> date:
    if not date(1900, 1, 1) <= day <= (utc_now() + _EASTERNMOST).date():
        raise PydanticCustomError("day_out_of_range", "must be between 1900 and today")
    return day


def _written_day(given: Any) -> Any:
    """A bare number is no day: read as seconds since 1970, a slip of the keys would become somebody's birthday."""
    if _is_number(given):
        raise PydanticKnownError("date_type")
    return given


def written_moment(given: Any) -> Any:
    """Nor is it a moment."""
    if _is_number(given):
        raise PydanticKnownError("datetime_type")
    return given


def _is_number(given: Any) -> bool:
    return isinstance(given, int | float) or (isinstance(given, str) and _NUMBER.fullmatch(given) is not None)


PastDay = Annotated[date, BeforeValidator(_written_day), AfterValidator(_not_in_the_future)]
"""Today wherever the clinic is, or before."""
Moment = Annotated[
    datetime, BeforeValidator(written_moment), Field(description="UTC.", examples=["2026-11-21T09:30:00Z"])
]
Fixture = Literal["arm_fixer_1", "arm_fixer_2", "elbow_fixer_1", "elbow_fixer_2"]
"""What holds the arm: arm fixer 1 for motions 1-5; arm fixer 2 for motion 6, with elbow fixer 1 in teaching, 2 in playback."""
Pain = Annotated[int, Field(ge=0, le=10, description="0 none, 10 the worst imaginable.", examples=[3])]
Motor = Annotated[int, Field(ge=1, le=5, description="Motor number, 1 to 5.", examples=[3])]


class Schema(BaseModel):
    """Base of what goes in and out; unknown fields are errors, so that a misspelt one is not lost in silence."""

    # What was sent stands in no error message, and so in no log.
    model_config = ConfigDict(extra="forbid", from_attributes=True, hide_input_in_errors=True)
