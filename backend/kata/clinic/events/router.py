"""REST route of the apparatus's events."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query

from kata.clinic.events import service
from kata.clinic.events.schemas import DeviceEvent, EventKind
from kata.clinic.events.service import EventFilter
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.pagination import After, Limit, Page

router = APIRouter(tags=["events"])


@router.get("/api/events", summary="List device events", responses=PROBLEMS.of(422))
def list_events(
    database: TheDatabase,
    actor: TheActor,
    station: Annotated[str | None, Query(max_length=100)] = None,
    session_id: UUID | None = None,
    patient_id: UUID | None = None,
    kind: EventKind | None = None,
    code: Annotated[str | None, Query(max_length=32)] = None,
    after: After = None,
    limit: Limit = 50,
) -> Page[DeviceEvent]:
    """Return the device's events, newest first.

    An alarm also has the time of its acknowledgement. The patient is named only to users who may see that record.
    """
    with database.read() as session:
        event_filter = EventFilter(station, session_id, patient_id, kind, code)
        rows, following = service.find(session, event_filter, limit, after)
        return Page[DeviceEvent](items=service.shown_to(session, actor, rows), next=following)
