"""REST routes of goniometer readings."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Depends

from kata.clinic.sessions import goniometer, service
from kata.clinic.sessions.schemas import GoniometerReadingCreate, Session
from kata.dependencies import PROBLEMS, TheDatabase, TheStation
from kata.station.schemas import Live

router = APIRouter(tags=["sessions"])


async def _live(station: TheStation) -> tuple[str, Live]:
    # This runs in the event loop, because the station's state belongs to the event loop.
    return station.info.name, station.live()


@router.post(
    "/api/sessions/{session_id}/goniometer-readings",
    summary="Add a goniometer reading",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def add_goniometer_reading(
    database: TheDatabase,
    now: Annotated[tuple[str, Live], Depends(_live)],
    session_id: UUID,
    body: GoniometerReadingCreate,
) -> Session:
    """Store a goniometer reading at the present pose, or at a given apparatus angle.

    From readings of a motion at two or more poses, the patient's angles during the session's runs are estimated.
    """
    station, live = now
    measured_deg = goniometer.measured_deg(live, body.motion)
    with database.write() as session:
        return service.as_session(goniometer.add(session, session_id, body, station=station, measured_deg=measured_deg))


@router.delete(
    "/api/sessions/{session_id}/goniometer-readings/{reading_id}",
    summary="Remove a goniometer reading",
    responses=PROBLEMS.of(404, 409, 422),
)
def remove_goniometer_reading(database: TheDatabase, session_id: UUID, reading_id: UUID) -> Session:
    """Remove a reading that was entered by mistake. A signed session keeps its readings."""
    with database.write() as session:
        return service.as_session(goniometer.remove(session, session_id, reading_id))
