"""REST route of the progress charts."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Annotated, Any, Final
from uuid import UUID

import msgspec
from fastapi import APIRouter, Query, Response
from sqlalchemy.orm import Session

from kata.clinic.profile.zone import TheZone
from kata.clinic.progress import figures, notes, numbers, service
from kata.clinic.progress.schemas import Progress
from kata.clinic.progress.series import Chart
from kata.dependencies import PROBLEMS, TheDatabase
from kata.plotting.placed_texts import with_texts

Columns = Annotated[
    int, Query(ge=1, le=2, description="Panels of the chart rom beside each other; 1 for a narrow screen.")
]

router = APIRouter(tags=["progress"])

_Read = Callable[[Session, service.EpisodeTimeline], Any]
_CHARTS: Final[dict[Chart, tuple[_Read, Callable[[Any], figures.Figure], Callable[[Any], numbers.NumberTable]]]] = {
    "rom": (service.rom_panels, figures.rom, numbers.rom),
    "pain": (service.pain_lines, figures.pain, numbers.pain),
    "spadi": (service.spadi_points, figures.spadi, numbers.spadi),
    "questionnaires": (service.questionnaire_panels, figures.questionnaires, numbers.questionnaires),
    "tracking": (service.tracked, figures.tracking, numbers.tracking),
    "correction": (service.correction_lines, figures.correction, numbers.correction),
    "end_feel": (service.end_feel_points, figures.end_feel, numbers.end_feel),
    "end_range": (service.end_range, figures.end_range, numbers.end_range),
    "adherence": (service.weeks, figures.adherence, numbers.adherence),
}
"""For each chart, the functions that read, draw and tabulate it. The other two get the result of the first."""
_NOTES: Final[Mapping[Chart, Callable[[Any], list[notes.ChartNote]]]] = {
    "spadi": notes.spadi,
    "questionnaires": notes.questionnaires,
}
"""Charts with notes below them. The functions get the result of the one that reads."""
_WITHOUT_SESSIONS: Final = ("rom", "spadi", "questionnaires")
"""Charts of assessments only. They have no values of an apparatus."""


@router.get(
    "/api/episodes/{episode_id}/progress/{chart}",
    summary="Get a progress chart of an episode",
    response_model=Progress,
    responses=PROBLEMS.of(404, 422),
)
def get_progress(
    database: TheDatabase, zone: TheZone, episode_id: UUID, chart: Chart, columns: Columns = 2
) -> Response:
    """Return one chart of an episode over its weeks, with its numbers as a table.

    rom: range of motion, with baseline, other side and reference. pain: pain in assessments and around sessions. spadi: SPADI with the
    changes that matter. questionnaires: totals of the other questionnaires, likewise. tracking: error of the playbacks. correction: size of the learned correction. adherence: sessions per week,
    held and prescribed; weeks begin on Monday in the clinic's zone. end_feel: passive range at 60 % of the chosen torque.
    end_range: end-range time in each week of the episode and motion, with the gain of passive range.
    """
    read_data, draw, tabulate = _CHARTS[chart]
    with database.read() as session:
        data = read_data(session, service.timeline_of(session, episode_id, zone))
        simulated = chart not in _WITHOUT_SESSIONS and service.any_simulated(session, episode_id)
    table = with_texts(asdict(tabulate(data)))
    lines = _NOTES[chart](data) if chart in _NOTES else []
    figure = figures.rom(data, columns) if chart == "rom" else draw(data)
    parts = {
        "figure": with_texts(figure),
        "table": table,
        "notes": with_texts({"lines": [asdict(note) for note in lines]}),
        "simulated": simulated,
    }
    body = msgspec.json.encode(parts)
    return Response(body, media_type="application/json")
