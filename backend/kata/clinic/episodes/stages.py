"""The settings that each stage of a frozen shoulder proposes for a playback. Pure functions.

The order of the stages is that of Kelley MJ et al., "Shoulder pain and mobility deficits: adhesive capsulitis", clinical practice guideline,
J Orthop Sports Phys Ther 2013; 43(5): A1-A31: the more irritable the shoulder, the gentler and shorter the stretching; and of Diercks RL,
Stevens M, "Gentle thawing of the frozen shoulder", J Shoulder Elbow Surg 2004; 13: 499-502: exercise within the limits of pain. Neither
publication gives a resistance level, a speed, a range or a number of repetitions for this apparatus, so the numbers are the clinic's decision.

A proposal changes no setting. The page warns about a setting that exceeds it, and the audit trail names the exceeded settings of a load.
"""

from types import MappingProxyType
from typing import Final, Literal, Protocol

from pydantic import Field

from kata.clinic import texts
from kata.clinic.episodes.schemas import StageName
from kata.station.schemas import OptionalKey, ResistanceLevel, TextKey
from kata.types import Schema

ProposedSetting = Literal["resistance_level", "speed_percent", "range_percent", "repetitions"]


class StageProposal(Schema):
    """The highest settings that a stage proposes."""

    stage: StageName
    resistance_level: ResistanceLevel
    speed_percent: float = Field(description="Percent of the taught speed.", examples=[50.0])
    range_percent: float = Field(description="Percent of the taught range.", examples=[80.0])
    repetitions: int = Field(description="Repetitions of one recording.", examples=[5])
    source: str = Field(description="Source of the proposal.")
    source_key: OptionalKey = None


class _Settings(Protocol):
    @property
    def speed_percent(self) -> float: ...
    @property
    def range_percent(self) -> float: ...
    @property
    def repetitions(self) -> int: ...


def _proposal(stage: StageName, resistance_level: int, percent: tuple[float, float], repetitions: int) -> StageProposal:
    source = texts.SOURCE_STAGE()
    return StageProposal(
        stage=stage,
        resistance_level=resistance_level,
        speed_percent=percent[0],
        range_percent=percent[1],
        repetitions=repetitions,
        source=source,
        source_key=TextKey.of(source),
    )


PROPOSALS: Final = MappingProxyType(
    {
        "freezing": _proposal("freezing", 8, (50.0, 80.0), 5),
        "frozen": _proposal("frozen", 15, (75.0, 100.0), 10),
        "thawing": _proposal("thawing", 20, (100.0, 100.0), 20),
    }
)


def exceeded(stage: str | None, resistance_level: int, settings: _Settings) -> list[ProposedSetting]:
    """Return the settings that exceed the proposal of a stage. Without a stage the list is empty."""
    proposal = PROPOSALS.get(stage or "")
    if proposal is None:
        return []
    values: dict[ProposedSetting, float] = {
        "resistance_level": resistance_level,
        "speed_percent": settings.speed_percent,
        "range_percent": settings.range_percent,
        "repetitions": settings.repetitions,
    }
    return [name for name, value in values.items() if value > getattr(proposal, name)]
