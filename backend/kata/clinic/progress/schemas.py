"""Progress as it goes out."""

from typing import Literal

from pydantic import Field

from kata.clinic.recordings.schemas import Figure, PlacedText
from kata.types import Schema


class ProgressColumn(Schema):
    """What stands in one column."""

    name: str = Field(examples=["Angle, deg"])
    kind: Literal["text", "moment", "number"] = Field(description="moment: UTC, to be shown in local time.")
    digits: int = Field(0, ge=0, le=3, description="Of a number, after the point.")


class ProgressTable(Schema):
    """The numbers behind a figure."""

    columns: list[ProgressColumn]
    rows: list[list[str | float | None]] = Field(description="A value a column; null where there is none.")
    texts: list[PlacedText] = Field([], description="For the translation of its English texts.")


class Progress(Schema):
    """A chart, and its numbers for whoever cannot see it or wants to know."""

    figure: Figure
    table: ProgressTable
