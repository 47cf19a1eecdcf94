"""REST routes of end-feel tests: results, curves, and what can be measured in a session."""

from uuid import UUID

from fastapi import APIRouter, Response

from kata.clinic.sessions import end_feel_results
from kata.clinic.sessions.end_feel_schemas import EndFeelCurves, EndFeelGuide
from kata.clinic.sessions.router import TheApparatus, TheOfflineCache
from kata.dependencies import PROBLEMS, TheDatabase

router = APIRouter(tags=["sessions"])


@router.get(
    "/api/sessions/{session_id}/end-feel",
    summary="Get what an end-feel test can measure in a session",
    responses=PROBLEMS.of(404, 422),
)
def get_end_feel_guide(database: TheDatabase, apparatus: TheApparatus, session_id: UUID) -> EndFeelGuide:
    """Return the recordings along which the patient can be measured, with today's baselines at this station and the session's tests."""
    with database.read() as session:
        return end_feel_results.guide(session, session_id, apparatus.station, apparatus.today)


@router.get("/api/runs/{run_id}/end-feel", summary="Get an end-feel test", responses=PROBLEMS.of(404, 422))
def get_end_feel(database: TheDatabase, offline_cache: TheOfflineCache, run_id: UUID) -> EndFeelCurves:
    """Return an end-feel test with its torque-angle curve, earlier ones of the same motion, and the newest of the other side.

    The torque is the drive's current times its nominal factor. It was tried in simulation only.
    """
    with database.read() as session:
        return end_feel_results.curves(session, run_id, offline_cache.read_zone(session))


@router.get(
    "/api/runs/{run_id}/end-feel.csv",
    summary="Download an end-feel test's curve as CSV",
    response_class=Response,
    responses=PROBLEMS.of(404, 409, 422) | {200: {"content": {"text/csv": {}}}},
)
def get_end_feel_csv(database: TheDatabase, run_id: UUID) -> Response:
    """Return the torque-angle curve: angle, torque on the way out and back, and their mean. Figures and origin are in the first rows."""
    with database.read() as session:
        content = end_feel_results.as_csv(session, run_id)
    return Response(
        content,
        media_type="text/csv; charset=utf-8",
        headers={"Content-Disposition": f'attachment; filename="end-feel-{run_id}.csv"'},
    )
