"""REST routes of session lists. Include them before the other session routes, which would interpret these paths as ids."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query

from kata.clinic.patients import service as patients
from kata.clinic.restricted import service as restricted
from kata.clinic.sessions import lists
from kata.clinic.sessions.lists import SessionFilter, SessionFilterOptions, SessionSummary
from kata.dependencies import PROBLEMS, TheActor, TheDatabase
from kata.pagination import After, Limit, Page
from kata.types import LONGEST_NAME, NO_NUL, GivenMoment

router = APIRouter(tags=["sessions"])


def _name(description: str, example: str) -> object:
    return Query(min_length=1, max_length=LONGEST_NAME, pattern=NO_NUL, description=description, examples=[example])


@router.get("/api/sessions", summary="List sessions of all patients", responses=PROBLEMS.of(422))
def list_sessions(
    database: TheDatabase,
    actor: TheActor,
    since: Annotated[
        GivenMoment | None,
        Query(description="Only sessions that started at this time or later.", examples=["2026-11-01T00:00:00Z"]),
    ] = None,
    until: Annotated[
        GivenMoment | None,
        Query(description="Only sessions that started before this time.", examples=["2026-12-01T00:00:00Z"]),
    ] = None,
    therapist: Annotated[str | None, _name("Only sessions that this therapist led.", "Sato")] = None,
    station: Annotated[str | None, _name("Only sessions at this station.", "Station 1")] = None,
    stop: Annotated[
        str | None, _name("Only sessions in which this cause stopped a playback; code of the cause.", "estop_pressed")
    ] = None,
    unsigned: Annotated[
        bool, Query(description="True: only sessions that have ended and whose note is not signed.")
    ] = False,
    limit: Limit = 50,
    after: After = None,
) -> Page[SessionSummary]:
    """Return sessions of all patients whose records you may see, newest first. All given filters must match."""
    with database.read() as session:
        hidden = restricted.hidden(actor)
        chosen = SessionFilter(
            since=since, until=until, therapist=therapist, station=station, stop=stop, unsigned=unsigned, hidden=hidden
        )
        items, further = lists.find(session, chosen, limit, after)
        return Page[SessionSummary](items=items, next=further)


@router.get("/api/sessions/filter-options", summary="List filter options of sessions", responses=PROBLEMS.of(422))
def get_session_filter_options(database: TheDatabase) -> SessionFilterOptions:
    """Return the therapists, stations and stop causes by which sessions can be filtered."""
    with database.read() as session:
        return lists.filter_options(session)


@router.get("/api/patients/{patient_id}/sessions", summary="List a patient's sessions", responses=PROBLEMS.of(404, 422))
def list_patient_sessions(
    database: TheDatabase, patient_id: UUID, limit: Limit = 50, after: After = None
) -> Page[SessionSummary]:
    """Return a patient's sessions, newest first."""
    with database.read() as session:
        patients.get(session, patient_id)
        items, further = lists.find(session, SessionFilter(patient_id=patient_id), limit, after)
        return Page[SessionSummary](items=items, next=further)
