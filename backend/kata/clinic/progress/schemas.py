"""Response models of progress charts."""

from typing import Literal

from pydantic import Field

from kata.clinic.recordings.schemas import Figure, PlacedText
from kata.types import Schema


class ProgressColumn(Schema):
    """One column of a table."""

    name: str = Field(examples=["Angle, °"])
    kind: Literal["text", "moment", "number"] = Field(description="moment: UTC, to be shown in local time.")
    digits: int = Field(0, ge=0, le=3, description="Decimal digits of a number.")


class ProgressTable(Schema):
    """The numbers of a figure."""

    columns: list[ProgressColumn]
    rows: list[list[str | float | None]] = Field(description="One value per column; null if there is no value.")
    texts: list[PlacedText] = Field([], description="Codes of the table's English texts, for translation.")


class ProgressNote(Schema):
    """Note on the change of a questionnaire that matters."""

    title: str = Field(description="Title of the questionnaire.", examples=["QuickDASH"])
    sentence: str = Field(examples=["A change of 17.1 points or less may be chance."])
    source: str = Field(description="Publication.", examples=["van Kampen et al. 2013, J Orthop Surg Res 8, 40"])


class ProgressNotes(Schema):
    """Notes below a figure."""

    lines: list[ProgressNote]
    texts: list[PlacedText] = Field([], description="Codes of the English sentences, for translation.")


class Progress(Schema):
    """A chart with its numbers."""

    figure: Figure
    table: ProgressTable
    notes: ProgressNotes
    simulated: bool = Field(False, description="True if some of the sessions were on a simulated apparatus.")
