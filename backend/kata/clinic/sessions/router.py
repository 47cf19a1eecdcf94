"""REST for sessions and runs."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query
from fastapi.responses import StreamingResponse

from kata.clinic import figures
from kata.clinic.dependencies import PROBLEMS, TheDatabase, TheFigures
from kata.clinic.patients import service as patients
from kata.clinic.sessions import service
from kata.clinic.sessions.schemas import Run, RunFigures, Session, SessionCreate, SessionPage, SessionUpdate

router = APIRouter(tags=["sessions"])
Limit = Annotated[int, Query(ge=1, le=200)]
Offset = Annotated[int, Query(ge=0)]


@router.get("/api/sessions", responses=PROBLEMS.of(422))
def list_sessions(database: TheDatabase, limit: Limit = 50, offset: Offset = 0) -> SessionPage:
    """Sessions of all patients, newest first."""
    return _page(database, None, limit, offset)


@router.get("/api/patients/{patient_id}/sessions", responses=PROBLEMS.of(404, 422))
def list_patient_sessions(
    database: TheDatabase, patient_id: UUID, limit: Limit = 50, offset: Offset = 0
) -> SessionPage:
    """A patient's sessions, newest first."""
    with database.read() as session:
        patients.get(session, patient_id)
    return _page(database, patient_id, limit, offset)


@router.post("/api/sessions", status_code=201, responses=PROBLEMS.of(404, 409, 422))
def create_session(database: TheDatabase, wanted: SessionCreate) -> Session:
    """Begin a session. A patient has one open session at most: if there is one, it goes on."""
    with database.write() as session:
        return service.as_session(service.begin(session, wanted.patient_id))


@router.get("/api/sessions/{session_id}", responses=PROBLEMS.of(404, 422))
def get_session(database: TheDatabase, session_id: UUID) -> Session:
    """One session with its runs."""
    with database.read() as session:
        return service.as_session(service.get(session, session_id))


@router.patch("/api/sessions/{session_id}", responses=PROBLEMS.of(404, 422))
def update_session(database: TheDatabase, session_id: UUID, change: SessionUpdate) -> Session:
    """Change the note."""
    with database.write() as session:
        return service.as_session(service.change(session, session_id, change))


@router.post("/api/sessions/{session_id}/end", responses=PROBLEMS.of(404, 409, 422))
def end_session(database: TheDatabase, session_id: UUID) -> Session:
    """End a session; ending it again changes nothing."""
    with database.write() as session:
        return service.as_session(service.end(session, session_id))


@router.get("/api/runs/{run_id}", responses=PROBLEMS.of(404, 422))
def get_run(database: TheDatabase, run_id: UUID) -> Run:
    """One playback, with its errors."""
    with database.read() as session:
        return service.as_run(service.get_run(session, run_id))


@router.get("/api/runs/{run_id}/figures", response_model=RunFigures, responses=PROBLEMS.of(404, 409, 410, 422))
def get_run_figures(database: TheDatabase, worker: TheFigures, run_id: UUID) -> StreamingResponse:
    """For each motor the paper's figure: teaching and playback on the left axis, error on the right one."""
    with database.read() as session:
        taught, run = service.figure_blobs(session, run_id)
    return StreamingResponse(figures.pieces(worker.build(figures.run, taught, run)), media_type="application/json")


def _page(database: TheDatabase, patient_id: UUID | None, limit: int, offset: int) -> SessionPage:
    with database.read() as session:
        rows, total = service.find(session, patient_id=patient_id, limit=limit, offset=offset)
        return SessionPage(items=[service.as_summary(row) for row in rows], total=total)
