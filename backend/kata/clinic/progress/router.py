"""REST route of the progress charts."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any, Final
from uuid import UUID

import msgspec
from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from kata.clinic.progress import figures, numbers, service
from kata.clinic.progress.schemas import Progress
from kata.clinic.progress.series import Chart
from kata.dependencies import PROBLEMS, TheDatabase
from kata.plotting.placed_texts import with_texts

router = APIRouter(tags=["progress"])

_Read = Callable[[Session, service.EpisodeTimeline], Any]
_CHARTS: Final[dict[Chart, tuple[_Read, Callable[[Any], figures.Figure], Callable[[Any], numbers.NumberTable]]]] = {
    "rom": (service.rom_panels, figures.rom, numbers.rom),
    "pain": (service.pain_lines, figures.pain, numbers.pain),
    "spadi": (service.spadi_points, figures.spadi, numbers.spadi),
    "tracking": (service.tracked, figures.tracking, numbers.tracking),
    "correction": (service.correction_lines, figures.correction, numbers.correction),
    "adherence": (service.weeks, figures.adherence, numbers.adherence),
}
"""For each chart, the functions that read, draw and tabulate it. The other two get the result of the first."""


@router.get(
    "/api/episodes/{episode_id}/progress/{chart}",
    summary="Get a progress chart of an episode",
    response_model=Progress,
    responses=PROBLEMS.of(404, 422),
)
def get_progress(database: TheDatabase, episode_id: UUID, chart: Chart) -> Response:
    """Return one chart of an episode over its weeks, with its numbers as a table.

    rom: range of motion, with baseline, other side and reference. pain: pain in assessments and around sessions. spadi: SPADI with its
    minimal important change. tracking: error of the playbacks. correction: size of the learned correction. adherence: sessions per week,
    held and prescribed; weeks begin on Monday, UTC.
    """
    read, draw, tabulate = _CHARTS[chart]
    with database.read() as session:
        found = read(session, service.timeline_of(session, episode_id))
        simulated = chart not in ("rom", "spadi") and service.any_simulated(session, episode_id)
    table = with_texts(asdict(tabulate(found)))
    body = msgspec.json.encode({"figure": with_texts(draw(found)), "table": table, "simulated": simulated})
    return Response(body, media_type="application/json")
