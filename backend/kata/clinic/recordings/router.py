"""REST for recordings."""

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
    Recording,
    RecordingDetail,
    RecordingList,
    RecordingUpdate,
)
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheDatabase, TheFigures, TheStation, TheWindow
from kata.errors import ProblemError
from kata.messages import text_of
from kata.motion.edit import EditError, Motion
from kata.motion.trajectory import TrajectoryError
from kata.plotting import figures
from kata.plotting.figures import FigureWorker
from kata.station.station import Station
from kata.types import side_of

router = APIRouter(tags=["recordings"])


@router.get("/api/patients/{patient_id}/recordings", responses=PROBLEMS.of(404, 422))
def list_recordings(database: TheDatabase, patient_id: UUID) -> RecordingList:
    """A patient's recordings, newest first, archived ones last."""
    with database.read() as session:
        patients.get(session, patient_id)
        rows = service.of_patient(session, patient_id)
        return RecordingList(items=[Recording.model_validate(row) for row in rows])


@router.get("/api/recordings/{recording_id}", responses=PROBLEMS.of(404, 422))
def get_recording(database: TheDatabase, recording_id: UUID) -> RecordingDetail:
    """One recording, with the range and speed of each motor."""
    return _detail(database, recording_id)


@router.patch("/api/recordings/{recording_id}", responses=PROBLEMS.of(404, 409, 422))
def update_recording(database: TheDatabase, recording_id: UUID, change: RecordingUpdate) -> RecordingDetail:
    """Rename, annotate, archive or restore; what was recorded does not change."""
    with database.write() as session:
        service.update(session, recording_id, change)
    return _detail(database, recording_id)


@router.post("/api/recordings/{recording_id}/derived", status_code=201, responses=PROBLEMS.of(404, 410, 422))
def derive_recording(
    database: TheDatabase, worker: TheFigures, station: TheStation, recording_id: UUID, wanted: Edit
) -> RecordingDetail:
    """Do something to a recording, and keep what comes of it as a new one of the same patient; the old one stays as it is.

    It is checked against the station's limits first, as at loading: what leaves them is refused with motor and time.
    """
    _, made = _derived(database, worker, station, recording_id, wanted)
    with database.write() as session:
        new_id = service.store_derived(session, recording_id, made, wanted.name, station.config.name).id
    return _detail(database, new_id)


@router.post(
    "/api/recordings/{recording_id}/derived/preview", response_model=Figure, responses=PROBLEMS.of(404, 410, 422)
)
def preview_derived_recording(
    database: TheDatabase, worker: TheFigures, station: TheStation, recording_id: UUID, wanted: Edit
) -> StreamingResponse:
    """What would come of it, over what it is made of; checked in the same way, and not kept."""
    source, made = _derived(database, worker, station, recording_id, wanted)
    figure = worker.build(figures.derived, source.series, made.series)
    return StreamingResponse(figures.pieces(figure), media_type="application/json")


@router.get("/api/recordings/{recording_id}/figure", response_model=Figure, responses=PROBLEMS.of(404, 410, 422))
def get_recording_figure(
    database: TheDatabase, worker: TheFigures, window: TheWindow, recording_id: UUID
) -> StreamingResponse:
    """The five motors' angles over time, one under the other; each line with its peaks.

    Of a short one, or of a window that is short, every sample; a window is given in seconds of the figure's clock.
    """
    with database.read() as session:
        parts = service.figure_samples(session, recording_id, window)
    return StreamingResponse(figures.pieces(worker.build(figures.recording, parts)), media_type="application/json")


@router.get("/api/recordings/{recording_id}/motion", responses=PROBLEMS.of(404, 410, 422))
def get_recording_motion(database: TheDatabase, recording_id: UUID) -> MotionPreview:
    """What was taught, as the 3-D apparatus plays it before it is played to a patient: at most 20 samples a second."""
    with database.read() as session:
        taught = service.samples(session, recording_id)
        return motion_preview(
            Motion(taught.times_s, taught.angles_deg), side_of(service.get(session, recording_id).side)
        )


def _derived(
    database: Database, worker: FigureWorker, station: Station, recording_id: UUID, wanted: Edit
) -> tuple[Source, Derived]:
    with database.read() as session:
        service.samples(session, recording_id)
        source = service.source(session, recording_id)
    try:
        return source, worker.build(derive, source, wanted, station.config)
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
        readable = True
        try:
            ranges = service.ranges(service.samples(session, recording_id))
        except ProblemError:
            readable = False
        plain = Recording.model_validate(row).model_dump()
        return RecordingDetail(**plain, readable=readable, ranges=ranges)
