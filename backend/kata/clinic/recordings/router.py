"""REST routes of recordings."""

from uuid import UUID

from fastapi import APIRouter
from fastapi.responses import StreamingResponse

from kata.clinic import texts
from kata.clinic.patients import service as patients
from kata.clinic.recordings import service
from kata.clinic.recordings.derive import Derived, Source, derive
from kata.clinic.recordings.edits import Edit
from kata.clinic.recordings.motion_preview import MotionPreview, motion_preview
from kata.clinic.recordings.schemas import (
    Figure,
    MotorRange,
    ReachMargin,
    Recording,
    RecordingDetail,
    RecordingUpdate,
)
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheDatabase, TheFigures, TheStation, TheWindow
from kata.errors import ProblemError
from kata.messages import text_of
from kata.motion.edit import EditError, Motion
from kata.motion.trajectory import TrajectoryError
from kata.pagination import After, Limit, Page
from kata.plotting import figures
from kata.plotting.figures import FigureWorker
from kata.station.station import Station
from kata.types import side_of

router = APIRouter(tags=["recordings"])


@router.get(
    "/api/patients/{patient_id}/recordings", summary="List a patient's recordings", responses=PROBLEMS.of(404, 422)
)
def list_recordings(database: TheDatabase, patient_id: UUID, limit: Limit = 50, after: After = None) -> Page[Recording]:
    """Return a patient's recordings, newest first, archived ones last."""
    with database.read() as session:
        patients.get(session, patient_id)
        rows, further = service.of_patient(session, patient_id, limit, after)
        return Page[Recording](items=[Recording.model_validate(row) for row in rows], next=further)


@router.get("/api/recordings/{recording_id}", summary="Get a recording", responses=PROBLEMS.of(404, 422))
def get_recording(database: TheDatabase, recording_id: UUID) -> RecordingDetail:
    """Return one recording with the range and speed of each motor."""
    return _detail(database, recording_id)


@router.patch(
    "/api/recordings/{recording_id}",
    summary="Rename, annotate, archive or restore a recording",
    responses=PROBLEMS.of(404, 409, 422),
)
def update_recording(database: TheDatabase, recording_id: UUID, change: RecordingUpdate) -> RecordingDetail:
    """Rename, annotate, archive or restore a recording. Its samples do not change."""
    with database.write() as session:
        service.update(session, recording_id, change)
    return _detail(database, recording_id)


@router.post(
    "/api/recordings/{recording_id}/derived",
    summary="Edit a recording into a new one",
    status_code=201,
    responses=PROBLEMS.of(404, 410, 422),
)
def derive_recording(
    database: TheDatabase, worker: TheFigures, station: TheStation, recording_id: UUID, body: Edit
) -> RecordingDetail:
    """Apply an edit and store the result as a new recording of the same patient. The original stays unchanged.

    The result is checked against the station's limits as it is when it is loaded. A refusal names motor and time.
    """
    _, derived = _derived(database, worker, station, recording_id, body)
    with database.write() as session:
        new_id = service.store_derived(session, recording_id, derived, body.name, station.config.name).id
    return _detail(database, new_id)


@router.post(
    "/api/recordings/{recording_id}/derived/preview",
    summary="Preview an edit of a recording",
    response_model=Figure,
    responses=PROBLEMS.of(404, 410, 422),
)
def preview_derived_recording(
    database: TheDatabase, worker: TheFigures, station: TheStation, recording_id: UUID, body: Edit
) -> StreamingResponse:
    """Return a figure of the edited motion over the original. The edit is checked in the same way as for storing, but not stored."""
    source, derived = _derived(database, worker, station, recording_id, body)
    figure = worker.build(figures.derived, source.series, derived.series)
    return StreamingResponse(figures.chunks(figure), media_type="application/json")


@router.get(
    "/api/recordings/{recording_id}/figure",
    summary="Get a recording's figure",
    response_model=Figure,
    responses=PROBLEMS.of(404, 410, 422),
)
def get_recording_figure(
    database: TheDatabase, worker: TheFigures, window: TheWindow, recording_id: UUID
) -> StreamingResponse:
    """Return a figure of the five motor angles over time. Peaks are preserved.

    For a short recording or window the figure contains every sample. The window is given in seconds of the figure's clock.
    """
    with database.read() as session:
        parts = service.figure_samples(session, recording_id, window)
    return StreamingResponse(figures.chunks(worker.build(figures.recording, parts)), media_type="application/json")


@router.get(
    "/api/recordings/{recording_id}/motion",
    summary="Get a recording's motion for the 3-D apparatus",
    responses=PROBLEMS.of(404, 410, 422),
)
def get_recording_motion(database: TheDatabase, recording_id: UUID) -> MotionPreview:
    """Return the taught motion for the 3-D apparatus, with at most 20 samples a second."""
    with database.read() as session:
        taught = service.samples(session, recording_id)
        return motion_preview(
            Motion(taught.times_s, taught.angles_deg), side_of(service.get(session, recording_id).side)
        )


def _derived(
    database: Database, worker: FigureWorker, station: Station, recording_id: UUID, edit: Edit
) -> tuple[Source, Derived]:
    with database.read() as session:
        service.samples(session, recording_id)
        source = service.source(session, recording_id, edit)
    try:
        return source, worker.build(derive, source, edit, station.config)
    except EditError as error:
        raise ProblemError(
            422,
            "impossible",
            texts.EDIT_REFUSED(reason=text_of(error)),
            texts.CHOOSE_OTHER_NUMBERS(),
        ) from error
    except TrajectoryError as error:
        raise ProblemError(
            422,
            "unplayable",
            texts.EDITED_NOT_PLAYABLE(reason=text_of(error)),
            texts.CHOOSE_OTHER_NUMBERS(),
        ) from error


def _detail(database: Database, recording_id: UUID) -> RecordingDetail:
    with database.read() as session:
        row = service.get(session, recording_id)
        ranges: list[MotorRange] = []
        margin: ReachMargin | None = None
        readable = True
        try:
            taught = service.samples(session, recording_id)
            ranges, margin = service.ranges(taught), service.margin(taught, side_of(row.side))
        except ProblemError:
            readable = False
        plain = Recording.model_validate(row).model_dump()
        return RecordingDetail(**plain, readable=readable, ranges=ranges, margin=margin)
