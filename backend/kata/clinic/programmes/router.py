"""REST routes of programmes, session plans and adherence."""

from collections.abc import Sequence
from uuid import UUID

from fastapi import APIRouter

from kata.clinic.profile.zone import TheZone
from kata.clinic.programmes import adherence, checks, planned, service
from kata.clinic.programmes.adherence import Adherence
from kata.clinic.programmes.checks import CheckData
from kata.clinic.programmes.planned import SessionPlan
from kata.clinic.programmes.schemas import (
    ItemPreview,
    Preview,
    Programme,
    ProgrammeCreate,
    ProgrammeDetail,
    ProgrammeItemRequest,
    ProgrammePreviewRequest,
    ProgrammeUpdate,
    VersionCreate,
)
from kata.dependencies import PROBLEMS, TheDatabase, TheFigures, TheStation
from kata.errors import ProblemError
from kata.pagination import Page
from kata.plotting.figures import FigureWorker
from kata.station.schemas import TextKey
from kata.station.station import Station

router = APIRouter(tags=["programmes"])


@router.get(
    "/api/patients/{patient_id}/programmes", summary="List a patient's programmes", responses=PROBLEMS.of(404, 422)
)
def list_programmes(database: TheDatabase, patient_id: UUID) -> Page[Programme]:
    """Return a patient's programmes in their newest versions, the last changed first and archived ones last.

    A patient has few, so the list has no pages.
    """
    with database.read() as session:
        return Page[Programme].complete([service.as_programme(row) for row in service.of_patient(session, patient_id)])


@router.post(
    "/api/patients/{patient_id}/programmes",
    summary="Create a programme",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def create_programme(
    database: TheDatabase, worker: TheFigures, station: TheStation, patient_id: UUID, body: ProgrammeCreate
) -> ProgrammeDetail:
    """Create a programme. Each item is checked as it is when it is loaded; an item that this station cannot play is refused."""
    with database.read() as session:
        episode = service.open_episode(session, patient_id, body.episode_id)
        data = checks.look_up(session, episode, body.items)
    durations_s = _durations(worker, data, body.items, station)
    with database.write() as session:
        return service.as_detail(session, service.create(session, patient_id, body, durations_s))


@router.post(
    "/api/patients/{patient_id}/programmes/preview",
    summary="Check a programme without storing it",
    responses=PROBLEMS.of(404, 409, 422),
)
def preview_programme(
    database: TheDatabase, worker: TheFigures, station: TheStation, patient_id: UUID, body: ProgrammePreviewRequest
) -> Preview:
    """Return how long each item would take, or why it cannot be played. Nothing is stored."""
    with database.read() as session:
        episode = service.open_episode(session, patient_id, body.episode_id)
        data = checks.look_up(session, episode, body.items)
    checked = checks.check(worker, data, body.items, station.config)
    items = [
        ItemPreview(duration_s=None, problem=result.message, problem_key=TextKey.of(result.message))
        if isinstance(result, ProblemError)
        else ItemPreview(duration_s=result, problem=None)
        for result in checked
    ]
    return Preview(duration_s=sum(item.duration_s or 0.0 for item in items), items=items)


@router.get(
    "/api/programmes/{programme_id}", summary="Get a programme with its versions", responses=PROBLEMS.of(404, 422)
)
def get_programme(database: TheDatabase, programme_id: UUID) -> ProgrammeDetail:
    """Return one programme with all its versions."""
    with database.read() as session:
        return service.as_detail(session, service.get(session, programme_id))


@router.patch(
    "/api/programmes/{programme_id}",
    summary="Rename, archive or restore a programme",
    responses=PROBLEMS.of(404, 409, 422),
)
def update_programme(database: TheDatabase, programme_id: UUID, change: ProgrammeUpdate) -> ProgrammeDetail:
    """Rename, archive or restore a programme. Changing its items needs a new version."""
    with database.write() as session:
        return service.as_detail(session, service.update(session, programme_id, change))


@router.post(
    "/api/programmes/{programme_id}/versions",
    summary="Add a version to a programme",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def create_programme_version(
    database: TheDatabase, worker: TheFigures, station: TheStation, programme_id: UUID, body: VersionCreate
) -> ProgrammeDetail:
    """Add a version to a programme. It is checked like a new programme. Older versions stay readable."""
    with database.read() as session:
        row = service.changeable(session, programme_id)
        data = checks.look_up(session, row.episode, body.items)
    durations_s = _durations(worker, data, body.items, station)
    with database.write() as session:
        return service.as_detail(session, service.add_version(session, programme_id, body, durations_s))


@router.get(
    "/api/sessions/{session_id}/plan", summary="Compare plan and result of a session", responses=PROBLEMS.of(404, 422)
)
def get_session_plan(database: TheDatabase, session_id: UUID) -> SessionPlan:
    """Return each item of the session's programme with its result, and the runs that were not planned."""
    with database.read() as session:
        return planned.of_session(session, session_id)


@router.get(
    "/api/episodes/{episode_id}/adherence", summary="Get an episode's weekly adherence", responses=PROBLEMS.of(404, 422)
)
def get_adherence(
    database: TheDatabase,
    episode_id: UUID,
    zone: TheZone,
) -> Adherence:
    """Return, for each week, the sessions held and prescribed and the repetitions completed and planned."""
    with database.read() as session:
        return adherence.of_episode(session, episode_id, zone)


def _durations(
    worker: FigureWorker, data: CheckData, items: Sequence[ProgrammeItemRequest], station: Station
) -> list[float]:
    """:raises ProblemError: names the first item that cannot be played, with the reason."""
    durations_s = []
    for checked in checks.check(worker, data, items, station.config):
        if isinstance(checked, ProblemError):
            raise checked
        durations_s.append(checked)
    return durations_s
