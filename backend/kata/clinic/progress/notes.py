"""Notes below a chart: which change of a questionnaire's total matters, and the sources."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from kata.clinic import texts
from kata.clinic.progress.series import QuestionnairePanel, SpadiPoint
from kata.clinic.questionnaires.definitions import SPADI, Definition


@dataclass(frozen=True)
class ChartNote:
    """A note in the form that is sent (:class:`kata.clinic.progress.schemas.ProgressNote`)."""

    title: str
    sentence: str
    source: str


def spadi(points: Sequence[SpadiPoint]) -> list[ChartNote]:
    """Return the notes on the SPADI, if it was answered."""
    return list(_changes(SPADI)) if points else []


def questionnaires(panels: Sequence[QuestionnairePanel]) -> list[ChartNote]:
    """Return the notes on each answered questionnaire."""
    return [note for panel in panels for note in _changes(panel.definition)]


def _changes(definition: Definition) -> Iterator[ChartNote]:
    title, important, detectable = definition.title, definition.important, definition.detectable
    if definition.total == "t_score":
        yield ChartNote(title, texts.FIGURE_T_SCORE_NOTE(), definition.scoring_source)
    if important.up_to is None:
        matters = texts.FIGURE_IMPORTANT_NOTE(least_points=important.points)
    else:
        matters = texts.FIGURE_IMPORTANT_RANGE_NOTE(least_points=important.points, most_points=important.up_to)
    yield ChartNote(title, matters, important.source)
    yield ChartNote(title, texts.FIGURE_DETECTABLE_NOTE(detectable_points=detectable.points), detectable.source)
