"""REST for sessions and runs."""

from typing import Annotated, Protocol
from uuid import UUID, uuid4

from fastapi import APIRouter, Depends, Query, Request
from fastapi.responses import StreamingResponse

from kata.clinic.event_spool import EventSpool
from kata.clinic.patients import service as patients
from kata.clinic.recordings.motion_preview import MotionPreview, motion_preview
from kata.clinic.sessions import checks, runs, service, signing
from kata.clinic.sessions.checklist import CheckName
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.schemas import (
    AddendumCreate,
    CheckConfirmation,
    Checklist,
    ReadyPatient,
    Run,
    RunFigures,
    Session,
    SessionCreate,
    SessionEnd,
    SessionSign,
    SessionUpdate,
)
from kata.database.availability import DatabaseUnavailableError
from kata.dependencies import PROBLEMS, TheDatabase, TheFigures, TheStation, TheWindow
from kata.plotting import figures
from kata.types import Fixture, Side, side_of

router = APIRouter(tags=["sessions"])


async def _apparatus(station: TheStation) -> checks.ApparatusState:
    # In the event loop, where the station lives.
    return checks.apparatus_state(station.info.name, station.live())


class SessionServices(Protocol):
    """The services that this module uses. ``kata.api.services.Services`` provides them."""

    @property
    def offline_cache(self) -> OfflineCache:
        """Return the offline cache."""

    @property
    def event_spool(self) -> EventSpool:
        """Return the event spool."""


def _offline_cache(request: Request) -> OfflineCache:
    services: SessionServices = request.app.state.services
    return services.offline_cache


def _event_spool(request: Request) -> EventSpool:
    services: SessionServices = request.app.state.services
    return services.event_spool


async def _on_apparatus(station: TheStation) -> UUID | None:
    run = station.live().run
    return run.session_id if run else None


TheOfflineCache = Annotated[OfflineCache, Depends(_offline_cache)]
TheEventSpool = Annotated[EventSpool, Depends(_event_spool)]
TheApparatus = Annotated[checks.ApparatusState, Depends(_apparatus)]
OnApparatus = Annotated[UUID | None, Depends(_on_apparatus)]
"""The session that something is loaded or played in just now."""


@router.get("/api/station/ready-patients")
def list_ready_patients(offline_cache: TheOfflineCache) -> list[ReadyPatient]:
    """While the database does not answer: whom a session can begin or goes on for here. They are the patients of this day.

    Who had a session at this station today, or whose record was opened here, as long as care goes on, with a programme; nobody whose
    record is restricted. Nobody at all while the database answers.
    """
    return offline_cache.ready()


@router.post("/api/sessions", status_code=201, responses=PROBLEMS.of(404, 409, 422))
def create_session(
    database: TheDatabase,
    station: TheStation,
    offline_cache: TheOfflineCache,
    event_spool: TheEventSpool,
    wanted: SessionCreate,
) -> Session:
    """Begin a session at this station. A patient has one open session at most: if there is one, it goes on.

    While the database does not answer: for one of those of whom /api/station/ready-patients tells, by the programme that it tells.
    """
    what = (wanted.patient_id, wanted.therapist, wanted.programme_version_id)
    # RunMotions here: what the database may have written before it was lost is the same session.
    session_id = uuid4()
    try:
        with database.write() as session:
            begun = service.as_session(service.begin(session, *what, station.info.name, session_id))
    except DatabaseUnavailableError:
        found = offline_cache.open_session(session_id, *what)
        if found is None:
            raise
        begun, opened = found
        if opened and not event_spool.put_offline_event(opened):
            event_spool.put_not_begun("session", opened.id)
            offline_cache.discard_session(opened.id)
            raise
        return begun
    offline_cache.attend(begun.patient.id, begun.id)
    return begun


@router.get("/api/sessions/{session_id}", responses=PROBLEMS.of(404, 422))
def get_session(database: TheDatabase, offline_cache: TheOfflineCache, session_id: UUID) -> Session:
    """One session with its runs; while the database does not answer, one that goes on here."""
    try:
        with database.read() as session:
            return service.as_session(service.get(session, session_id))
    except DatabaseUnavailableError:
        known = offline_cache.session(session_id)
        if known is None:
            raise
        return known


@router.patch("/api/sessions/{session_id}", responses=PROBLEMS.of(404, 409, 422))
def update_session(
    database: TheDatabase,
    offline_cache: TheOfflineCache,
    event_spool: TheEventSpool,
    session_id: UUID,
    change: SessionUpdate,
) -> Session:
    """Change note, pain, therapist or programme, until it is signed; while the database does not answer, pain alone."""
    try:
        with database.write() as session:
            changed = service.as_session(service.change(session, session_id, change))
    except DatabaseUnavailableError:
        said = offline_cache.update_session(session_id, change)
        if said is None:
            raise
        changed, events = said
        for event in events:
            event_spool.put_offline_event(event)
        return changed
    offline_cache.refresh_soon()
    return changed


@router.get("/api/sessions/{session_id}/checklist", responses=PROBLEMS.of(404, 410, 422))
def get_checklist(
    database: TheDatabase,
    apparatus: TheApparatus,
    offline_cache: TheOfflineCache,
    session_id: UUID,
    recording_id: Annotated[UUID | None, Query(description="What is to be played: it says which fixtures.")] = None,
) -> Checklist:
    """What has to be in order before a recording is played, and who has looked; some of it the apparatus tells itself."""
    try:
        with database.read() as session:
            return checks.as_checklist(checks.checklist(session, session_id, recording_id, apparatus))
    except DatabaseUnavailableError:
        known = offline_cache.checklist(session_id, recording_id, apparatus)
        if known is None:
            raise
        return checks.as_checklist(known)


@router.put("/api/sessions/{session_id}/checklist/{check}", responses=PROBLEMS.of(404, 409, 410, 422))
def confirm_check(
    database: TheDatabase,
    apparatus: TheApparatus,
    offline_cache: TheOfflineCache,
    event_spool: TheEventSpool,
    session_id: UUID,
    check: CheckName,
    given: CheckConfirmation,
) -> Checklist:
    """Somebody has looked, and it is in order."""
    try:
        with database.write() as session:
            checklist = checks.as_checklist(checks.confirm(session, session_id, check, given, apparatus))
            patient_id = service.get(session, session_id).patient_id
    except DatabaseUnavailableError:
        ticked = offline_cache.answer_check(session_id, given.recording_id, check, given.checked_by)
        known = offline_cache.checklist(session_id, given.recording_id, apparatus)
        if ticked is None or known is None:
            raise
        event_spool.put_offline_event(ticked)
        return checks.as_checklist(known)
    offline_cache.attend(patient_id, session_id)
    return checklist


@router.get("/api/patients/{patient_id}/teaching-checklist", responses=PROBLEMS.of(404, 409, 422))
def get_teaching_checklist(
    database: TheDatabase,
    apparatus: TheApparatus,
    patient_id: UUID,
    fixtures: Annotated[list[Fixture], Query(min_length=1, max_length=3, description="What the arm is in.")],
    side: Annotated[Side | None, Query(description="The side of the patient's episode unless given.")] = None,
) -> Checklist:
    """What has to be in order before a motion is taught, and what the patient's open session knows of it already."""
    with database.read() as session:
        patient = patients.get(session, patient_id)
        teach = checks.TeachingRequest(patient.id, checks.teaching_side(patient, side), set(fixtures))
        return checks.as_checklist(checks.teaching_checklist(session, teach, apparatus))


@router.post("/api/sessions/{session_id}/end", responses=PROBLEMS.of(404, 409, 422))
def end_session(
    database: TheDatabase,
    offline_cache: TheOfflineCache,
    event_spool: TheEventSpool,
    played: OnApparatus,
    session_id: UUID,
    given: SessionEnd | None = None,
) -> Session:
    """End a session; ending it again changes nothing but the reason, if one is given.

    While the database does not answer, a session that goes on here is ended with the reason that is given, or none.
    """
    reason = given.reason if given else None
    try:
        with database.write() as session:
            ended = service.as_session(service.end(session, session_id, reason))
    except DatabaseUnavailableError:
        found = offline_cache.end_session(session_id, reason, played)
        if found is None:
            raise
        ended, closed = found
        if closed:
            event_spool.put_offline_event(closed)
        return ended
    offline_cache.attend(ended.patient.id, None)
    return ended


@router.post("/api/sessions/{session_id}/sign", responses=PROBLEMS.of(404, 409, 422))
def sign_session(database: TheDatabase, session_id: UUID, given: SessionSign) -> Session:
    """Sign the note of an ended session. From then on it stays as it is, and only addenda are added."""
    with database.write() as session:
        return service.as_session(signing.sign(session, session_id, given))


@router.post("/api/sessions/{session_id}/addenda", status_code=201, responses=PROBLEMS.of(404, 409, 422))
def add_addendum(database: TheDatabase, session_id: UUID, given: AddendumCreate) -> Session:
    """Add to a signed note."""
    with database.write() as session:
        return service.as_session(signing.add(session, session_id, given))


@router.get("/api/runs/{run_id}", responses=PROBLEMS.of(404, 422))
def get_run(database: TheDatabase, run_id: UUID) -> Run:
    """One playback, with its errors."""
    with database.read() as session:
        return runs.as_run(runs.get(session, run_id))


@router.get("/api/runs/{run_id}/motion", responses=PROBLEMS.of(404, 410, 422))
def get_run_motion(database: TheDatabase, run_id: UUID) -> MotionPreview:
    """What a run asks of the motors, one repetition of it, for the 3-D apparatus: at most 20 samples a second.

    Its range and speed are the run's, so that it can be watched before it touches anybody.
    """
    with database.read() as session:
        row = runs.get(session, run_id)
        return motion_preview(runs.motion_of(session, row, once=True), side_of(row.recording.side))


@router.get("/api/runs/{run_id}/figures", response_model=RunFigures, responses=PROBLEMS.of(404, 409, 410, 422))
def get_run_figures(database: TheDatabase, worker: TheFigures, window: TheWindow, run_id: UUID) -> StreamingResponse:
    """For each motor the paper's figure: teaching and playback on the left axis, error on the right one.

    Each line with its peaks; of a short run, or of a window that is short, every sample.
    """
    with database.read() as session:
        parts = runs.figure_samples(session, run_id, window)
    return StreamingResponse(figures.pieces(worker.build(figures.run, parts)), media_type="application/json")
