"""REST routes of runs."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query
from fastapi.responses import StreamingResponse

from kata.clinic.recordings.motion_preview import MotionPreview, motion_preview
from kata.clinic.sessions import patient_angles, played_motion, runs, service
from kata.clinic.sessions.played_motion import PlayedMotion
from kata.clinic.sessions.schemas import Run, RunFigures
from kata.dependencies import PROBLEMS, TheDatabase, TheFigures, TheWindow
from kata.plotting import figures
from kata.types import side_of

router = APIRouter(tags=["sessions"])


@router.get("/api/runs/{run_id}", summary="Get a run", responses=PROBLEMS.of(404, 422))
def get_run(database: TheDatabase, run_id: UUID) -> Run:
    """Return one run with its tracking errors."""
    with database.read() as session:
        row = runs.get(session, run_id)
        angles = patient_angles.of_session(service.get(session, row.session_id))
        return runs.as_run(row, angles=angles)


@router.get(
    "/api/runs/{run_id}/motion",
    summary="Get a run's motion for the 3-D apparatus",
    responses=PROBLEMS.of(404, 410, 422),
)
def get_run_motion(database: TheDatabase, run_id: UUID) -> MotionPreview:
    """Return one repetition of a run's motion for the 3-D apparatus, with at most 20 samples a second.

    The motion has the run's range and speed, so that a therapist can watch it before it moves a patient.
    """
    with database.read() as session:
        row = runs.get(session, run_id)
        return motion_preview(runs.motion_of(session, row, single=True), side_of(row.recording.side))


@router.get(
    "/api/runs/{run_id}/played",
    summary="Get what a run played, for the 3-D apparatus",
    responses=PROBLEMS.of(404, 409, 410, 422),
)
def get_played_motion(database: TheDatabase, run_id: UUID) -> PlayedMotion:
    """Return the measured angles and the setpoints of a run on the run's own clock, with at most 20 samples a second. The answer also
    contains the times at which resistance took the arm back.
    """
    with database.read() as session:
        return played_motion.of_run(session, runs.get(session, run_id))


@router.get(
    "/api/runs/{run_id}/figures",
    summary="Get a run's figures",
    response_model=RunFigures,
    responses=PROBLEMS.of(404, 409, 410, 422),
)
def get_run_figures(
    database: TheDatabase,
    worker: TheFigures,
    window: TheWindow,
    run_id: UUID,
    clock: Annotated[
        figures.Clock, Query(description="path: time on the motion. wall: real time since the motion began.")
    ] = "path",
) -> StreamingResponse:
    """Return a figure per motor, as in the paper: teaching and playback on the left axis, error on the right axis.

    Peaks are preserved. For a short run or window the figures contain every sample.
    """
    with database.read() as session:
        parts = runs.figure_samples(session, run_id, window, clock)
    return StreamingResponse(figures.chunks(worker.build(figures.run, parts)), media_type="application/json")
