"""REST routes of sessions."""

from typing import Annotated, Protocol
from uuid import UUID, uuid4

from fastapi import APIRouter, Depends, Query, Request

from kata.clinic import banner
from kata.clinic.banner import PatientBanner
from kata.clinic.event_spool import EventSpool
from kata.clinic.patients import service as patients
from kata.clinic.sessions import checks, service, signing
from kata.clinic.sessions.checklist import CheckName
from kata.clinic.sessions.identity import PatientIdentity
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.offline_sessions import OfflineSessions
from kata.clinic.sessions.schemas import (
    AddendumCreate,
    CheckConfirmation,
    Checklist,
    ReadyPatient,
    Session,
    SessionCreate,
    SessionEnd,
    SessionSign,
    SessionUpdate,
)
from kata.database.availability import DatabaseUnavailableError
from kata.dependencies import PROBLEMS, TheDatabase, TheStation
from kata.pagination import Page
from kata.types import Fixture, Side

router = APIRouter(tags=["sessions"])


class SessionServices(Protocol):
    """The services that this module uses. ``kata.api.services.Services`` provides them."""

    @property
    def offline_cache(self) -> OfflineCache:
        """Return the offline cache."""

    @property
    def offline_sessions(self) -> OfflineSessions:
        """Return the sessions that run without the database."""

    @property
    def event_spool(self) -> EventSpool:
        """Return the event spool."""


def _offline_cache(request: Request) -> OfflineCache:
    services: SessionServices = request.app.state.services
    return services.offline_cache


def _offline_sessions(request: Request) -> OfflineSessions:
    services: SessionServices = request.app.state.services
    return services.offline_sessions


def _event_spool(request: Request) -> EventSpool:
    services: SessionServices = request.app.state.services
    return services.event_spool


async def _on_apparatus(station: TheStation) -> UUID | None:
    run = station.live().run
    return run.session_id if run else None


TheOfflineCache = Annotated[OfflineCache, Depends(_offline_cache)]
TheOfflineSessions = Annotated[OfflineSessions, Depends(_offline_sessions)]
TheEventSpool = Annotated[EventSpool, Depends(_event_spool)]


async def _apparatus(station: TheStation, offline_cache: TheOfflineCache) -> checks.ApparatusState:
    # This runs in the event loop, because the station's state belongs to the event loop.
    tested = offline_cache.has_estop_test_since(station.verified_since_s)
    return checks.apparatus_state(station.info.name, station.live(), offline_cache.zone, tested_since_verified=tested)


TheApparatus = Annotated[checks.ApparatusState, Depends(_apparatus)]
OnApparatus = Annotated[UUID | None, Depends(_on_apparatus)]
"""The session with a loaded or playing run on the apparatus."""


@router.get("/api/station/ready-patients", summary="List patients who can be treated without the database")
def list_ready_patients(offline_cache: TheOfflineCache) -> Page[ReadyPatient]:
    """Return the patients whose session can begin or continue here while the database is unavailable.

    They had a session at this station today, or their record was opened here today. They have an open episode and a programme. Patients
    with a restricted record are left out. While the database is available, the list is empty. It has no pages.
    """
    return Page[ReadyPatient].complete(offline_cache.ready())


@router.get("/api/patients/{patient_id}/banner", summary="Get a patient's banner", responses=PROBLEMS.of(404, 422))
def get_patient_banner(database: TheDatabase, offline_cache: TheOfflineCache, patient_id: UUID) -> PatientBanner:
    """Return the patient's identity, and what forbids or limits a motion. While the database is unavailable, this works for today's
    patients.
    """
    try:
        with database.read() as session:
            today = checks.today(offline_cache.read_zone(session)).date()
            return banner.of_patient(session, patients.get(session, patient_id), today)
    except DatabaseUnavailableError:
        cached = offline_cache.find_patient(patient_id)
        if cached is None:
            raise
        return cached.banner


@router.post(
    "/api/sessions", summary="Begin or continue a session", status_code=201, responses=PROBLEMS.of(404, 409, 422)
)
def create_session(
    database: TheDatabase,
    station: TheStation,
    offline_sessions: TheOfflineSessions,
    event_spool: TheEventSpool,
    body: SessionCreate,
) -> Session:
    """Begin a session at this station, or continue the patient's open session. A patient has at most one open session.

    While the database is unavailable, a session can begin only for a patient and a programme of /api/station/ready-patients.
    """
    arguments = (body.patient_id, body.therapist, body.programme_version_id)
    # The id is generated here, so that a session that the database stored before it was lost is not stored again.
    session_id = uuid4()
    try:
        with database.write() as session:
            created = service.as_session(service.begin(session, *arguments, station.info.name, session_id))
    except DatabaseUnavailableError:
        offline = offline_sessions.open_session(session_id, *arguments)
        if offline is None:
            raise
        created, opened = offline
        if opened and not event_spool.put_offline_event(opened):
            event_spool.put_not_begun("session", opened.id)
            offline_sessions.discard_session(opened.id)
            raise
        return created
    offline_sessions.cache.attend(created.patient.id, created.id)
    return created


@router.get("/api/sessions/{session_id}", summary="Get a session with its runs", responses=PROBLEMS.of(404, 422))
def get_session(database: TheDatabase, offline_sessions: TheOfflineSessions, session_id: UUID) -> Session:
    """Return one session with its runs. While the database is unavailable, return only a session that is open here."""
    try:
        with database.read() as session:
            return service.as_session(service.get(session, session_id))
    except DatabaseUnavailableError:
        cached = offline_sessions.session(session_id)
        if cached is None:
            raise
        return cached


@router.patch("/api/sessions/{session_id}", summary="Change a session", responses=PROBLEMS.of(404, 409, 422))
def update_session(
    database: TheDatabase,
    offline_sessions: TheOfflineSessions,
    event_spool: TheEventSpool,
    session_id: UUID,
    change: SessionUpdate,
) -> Session:
    """Change note, pain, therapist or programme until the session is signed. While the database is unavailable, only pain can change."""
    try:
        with database.write() as session:
            changed = service.as_session(service.change(session, session_id, change))
    except DatabaseUnavailableError:
        offline = offline_sessions.update_session(session_id, change)
        if offline is None:
            raise
        changed, events = offline
        for event in events:
            event_spool.put_offline_event(event)
        return changed
    offline_sessions.cache.refresh_soon()
    return changed


@router.get(
    "/api/sessions/{session_id}/checklist",
    summary="Get the checklist of a session",
    responses=PROBLEMS.of(404, 410, 422),
)
def get_checklist(
    database: TheDatabase,
    apparatus: TheApparatus,
    offline_sessions: TheOfflineSessions,
    session_id: UUID,
    recording_id: Annotated[UUID | None, Query(description="Recording to play; it determines the fixtures.")] = None,
) -> Checklist:
    """Return the checklist of a recording with its answers. The apparatus itself answers some checks."""
    try:
        with database.read() as session:
            states = checks.checklist(session, session_id, recording_id, apparatus)
            patient = PatientIdentity.model_validate(service.get(session, session_id).patient)
            return checks.as_checklist(states, patient)
    except DatabaseUnavailableError:
        offline = offline_sessions.checklist(session_id, recording_id, apparatus)
        if offline is None:
            raise
        return checks.as_checklist(*offline)


@router.put(
    "/api/sessions/{session_id}/checklist/{check}",
    summary="Confirm a check of the checklist",
    responses=PROBLEMS.of(404, 409, 410, 422),
)
def confirm_check(
    database: TheDatabase,
    apparatus: TheApparatus,
    offline_sessions: TheOfflineSessions,
    event_spool: TheEventSpool,
    session_id: UUID,
    check: CheckName,
    body: CheckConfirmation,
) -> Checklist:
    """Confirm a check of the checklist. `identity` needs two identifiers that the patient stated."""
    try:
        with database.write() as session:
            confirmed = checks.confirm(session, session_id, check, body, apparatus)
            patient = service.get(session, session_id).patient
            patient_id = patient.id
            checklist = checks.as_checklist(confirmed, PatientIdentity.model_validate(patient))
    except DatabaseUnavailableError:
        ticked = offline_sessions.answer_check(session_id, check, body)
        offline = offline_sessions.checklist(session_id, body.recording_id, apparatus)
        if ticked is None or offline is None:
            raise
        event_spool.put_offline_event(ticked)
        return checks.as_checklist(*offline)
    offline_sessions.cache.attend(patient_id, session_id)
    return checklist


@router.get(
    "/api/patients/{patient_id}/teaching-checklist",
    summary="Get the checklist of a teaching",
    responses=PROBLEMS.of(404, 409, 422),
)
def get_teaching_checklist(
    database: TheDatabase,
    apparatus: TheApparatus,
    patient_id: UUID,
    fixtures: Annotated[list[Fixture], Query(min_length=1, max_length=3, description="Fixtures that hold the arm.")],
    side: Annotated[Side | None, Query(description="Shoulder; by default that of the patient's episode.")] = None,
) -> Checklist:
    """Return the checklist of a teaching, with the answers of the patient's open session."""
    with database.read() as session:
        patient = patients.get(session, patient_id)
        teach = checks.TeachingRequest(patient.id, checks.teaching_side(patient, side), set(fixtures))
        states = checks.teaching_checklist(session, teach, apparatus)
        return checks.as_checklist(states, PatientIdentity.model_validate(patient))


@router.post("/api/sessions/{session_id}/end", summary="End a session", responses=PROBLEMS.of(404, 409, 422))
def end_session(
    database: TheDatabase,
    offline_sessions: TheOfflineSessions,
    event_spool: TheEventSpool,
    played: OnApparatus,
    session_id: UUID,
    body: SessionEnd | None = None,
) -> Session:
    """End a session. A repeated call changes only the reason, if one is given.

    While the database is unavailable, a session that is open here ends with the given reason or without one.
    """
    reason = body.reason if body else None
    try:
        with database.write() as session:
            ended_session = service.as_session(service.end(session, session_id, reason))
    except DatabaseUnavailableError:
        offline = offline_sessions.end_session(session_id, reason, played)
        if offline is None:
            raise
        ended_session, closed = offline
        if closed:
            event_spool.put_offline_event(closed)
        return ended_session
    offline_sessions.cache.attend(ended_session.patient.id, None)
    return ended_session


@router.post("/api/sessions/{session_id}/sign", summary="Sign a session's note", responses=PROBLEMS.of(404, 409, 422))
def sign_session(database: TheDatabase, session_id: UUID, body: SessionSign) -> Session:
    """Sign the note of an ended session. The note cannot change afterwards; only addenda can be added."""
    with database.write() as session:
        return service.as_session(signing.sign(session, session_id, body))


@router.post(
    "/api/sessions/{session_id}/addenda",
    summary="Add an addendum to a signed note",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def add_addendum(database: TheDatabase, session_id: UUID, body: AddendumCreate) -> Session:
    """Add an addendum to a signed note."""
    with database.write() as session:
        return service.as_session(signing.add(session, session_id, body))
