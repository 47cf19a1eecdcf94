"""Kinds of values that several subjects' schemas share."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

Side = Literal["left", "right"]
Name = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=100)]
Note = Annotated[str, StringConstraints(strip_whitespace=True, max_length=10_000)]
Moment = Annotated[datetime, Field(description="UTC.", examples=["2026-11-21T09:30:00Z"])]
Motor = Annotated[int, Field(ge=1, le=5, description="Motor number, 1 to 5.", examples=[3])]


class Schema(BaseModel):
    """Base of what goes in and out; unknown fields are errors, so that a misspelt one is not lost in silence."""

    model_config = ConfigDict(extra="forbid", from_attributes=True)
