"""Types of values that schemas of several packages share."""

import re
from datetime import UTC, date, datetime, timedelta
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints
from pydantic_core import PydanticCustomError, PydanticKnownError

from kata.actor import CURRENT_ACTOR
from kata.database.base import utc_now

LONGEST_NAME: Final = 100
NO_NUL: Final = r"^[^\x00]*$"
"""Pattern of a text without a zero character, which PostgreSQL cannot store."""
Side = Literal["left", "right"]
Name = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=LONGEST_NAME, pattern=NO_NUL)]
Doer = Annotated[str, StringConstraints(strip_whitespace=True, max_length=LONGEST_NAME, pattern=NO_NUL)]
"""Name of the person who has done something. It may be empty."""


def side_of(stored: str) -> Side:
    """Return the side that is stored in a row."""
    return "left" if stored == "left" else "right"


def _or_own_name(name: str) -> str:
    actor = CURRENT_ACTOR.get()
    return name or (actor.name if actor else "")


By = Annotated[Doer, AfterValidator(_or_own_name), Field(validate_default=True)]
"""Name of the person who has done something. An empty name becomes the user's name. Use it with the default ``""``."""
Note = Annotated[str, StringConstraints(strip_whitespace=True, max_length=10_000, pattern=NO_NUL)]
_NUMBER: Final = re.compile(r"\s*[+-]?[\d.]+(e[+-]?\d+)?\s*", re.IGNORECASE)
_EASTERNMOST: Final = timedelta(hours=14)
"""The largest offset of a time zone from UTC."""


def _not_in_the_future(day: date) -> date:
    if not date(1900, 1, 1) <= day <= (utc_now() + _EASTERNMOST).date():
        raise PydanticCustomError("day_out_of_range", "must be between 1900 and today")
    return day


def _written_day(value: Any) -> Any:
    """Refuse a number, which pydantic would read as seconds since 1970."""
    if _is_number(value):
        raise PydanticKnownError("date_type")
    return value


def written_moment(value: Any) -> Any:
    """Refuse a number, which pydantic would read as seconds since 1970."""
    if _is_number(value):
        raise PydanticKnownError("datetime_type")
    return value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) or (isinstance(value, str) and _NUMBER.fullmatch(value) is not None)


def _in_utc(moment: datetime) -> datetime:
    """Return the time in UTC. A time at either end of the calendar cannot be converted and is returned unchanged; no record has such a
    time.
    """
    try:
        return moment.astimezone(UTC)
    except OverflowError:
        return moment.replace(tzinfo=UTC)


GivenMoment = Annotated[AwareDatetime, BeforeValidator(written_moment), AfterValidator(_in_utc)]
"""A time with its zone, as a filter of a request."""
PastDay = Annotated[date, BeforeValidator(_written_day), AfterValidator(_not_in_the_future)]
"""A date from 1900 to today in the easternmost time zone."""
Moment = Annotated[
    datetime, BeforeValidator(written_moment), Field(description="UTC.", examples=["2026-11-21T09:30:00Z"])
]
Fixture = Literal["arm_fixer_1", "arm_fixer_2", "elbow_fixer_1", "elbow_fixer_2"]
"""A fixture of the arm. Arm fixer 1 is for motions 1-5. Arm fixer 2 is for motion 6, with elbow fixer 1 during teaching and 2 during
playback.
"""
Pain = Annotated[int, Field(ge=0, le=10, description="0: no pain; 10: the worst imaginable pain.", examples=[3])]
Motor = Annotated[int, Field(ge=1, le=5, description="Motor number, 1 to 5.", examples=[3])]


class Schema(BaseModel):
    """Base of requests and responses. An unknown field is an error, so that a misspelt field is not ignored."""

    # Values must not appear in error messages and logs.
    model_config = ConfigDict(extra="forbid", from_attributes=True, hide_input_in_errors=True)
