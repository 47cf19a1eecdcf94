"""REST for progress."""

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
_CHARTS: Final[dict[Chart, tuple[_Read, Callable[[Any], figures.Figure], Callable[[Any], numbers.Table]]]] = {
    "rom": (service.rom_panels, figures.rom, numbers.rom),
    "pain": (service.pain_lines, figures.pain, numbers.pain),
    "spadi": (service.spadi_points, figures.spadi, numbers.spadi),
    "tracking": (service.tracked, figures.tracking, numbers.tracking),
    "correction": (service.correction_lines, figures.correction, numbers.correction),
    "adherence": (service.weeks, figures.adherence, numbers.adherence),
}
"""How each is read, drawn and tabulated: what the first returns the other two take."""


@router.get("/api/episodes/{episode_id}/progress/{chart}", response_model=Progress, responses=PROBLEMS.of(404, 422))
def get_progress(database: TheDatabase, episode_id: UUID, chart: Chart) -> Response:
    """One chart of an episode over its weeks, and the numbers behind it.

    rom: range of motion against baseline, other side and reference. pain: in assessments and around sessions. spadi: with its
    minimal important change. tracking: how well recordings were reproduced. correction: what the learned method has come to.
    adherence: sessions a week, as prescribed and done; weeks begin on Monday, UTC.
    """
    read, draw, tabulate = _CHARTS[chart]
    with database.read() as session:
        found = read(session, service.timeline_of(session, episode_id))
    table = with_texts(asdict(tabulate(found)))
    body = msgspec.json.encode({"figure": with_texts(draw(found)), "table": table})
    return Response(body, media_type="application/json")
