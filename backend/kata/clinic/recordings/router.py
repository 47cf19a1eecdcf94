"""REST for recordings."""

import csv
import io
from collections.abc import Iterator
from uuid import UUID

from fastapi import APIRouter
from fastapi.responses import StreamingResponse

from kata.clinic import figures
from kata.clinic.dependencies import PROBLEMS, TheDatabase, TheFigures
from kata.clinic.patients import service as patients
from kata.clinic.problems import ProblemError
from kata.clinic.recordings import service
from kata.clinic.recordings.schemas import (
    Figure,
    MotorRange,
    Recording,
    RecordingDetail,
    RecordingList,
    RecordingUpdate,
)
from kata.database.engine import Database
from kata.motion.axes import AXES

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


@router.patch("/api/recordings/{recording_id}", responses=PROBLEMS.of(404, 422))
def update_recording(database: TheDatabase, recording_id: UUID, change: RecordingUpdate) -> RecordingDetail:
    """Rename, annotate, archive or restore; what was recorded does not change."""
    with database.write() as session:
        service.update(session, recording_id, change)
    return _detail(database, recording_id)


@router.get("/api/recordings/{recording_id}/figure", response_model=Figure, responses=PROBLEMS.of(404, 410, 422))
def get_recording_figure(database: TheDatabase, worker: TheFigures, recording_id: UUID) -> StreamingResponse:
    """The five motors' angles over time, one under the other."""
    with database.read() as session:
        service.samples(session, recording_id)
        blob = service.samples_blob(session, recording_id)
    return StreamingResponse(figures.pieces(worker.build(figures.recording, blob)), media_type="application/json")


@router.get(
    "/api/recordings/{recording_id}/samples.csv",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 410, 422) | {200: {"content": {"text/csv": {"schema": {"type": "string"}}}}},
)
def get_recording_samples(database: TheDatabase, recording_id: UUID) -> StreamingResponse:
    """The samples as CSV: ``time_s`` and ``motor_1_deg`` to ``motor_5_deg``."""
    with database.read() as session:
        taught = service.samples(session, recording_id)

    def lines() -> Iterator[str]:
        buffer = io.StringIO()
        writer = csv.writer(buffer)
        writer.writerow(["time_s", *(f"motor_{motor}_deg" for motor in AXES)])
        for time_s, angles in zip(taught.times_s, taught.angles_deg, strict=True):
            writer.writerow([f"{time_s:.6f}", *(f"{angle:.4f}" for angle in angles)])
            if buffer.tell() > 1 << 16:
                yield buffer.getvalue()
                buffer.seek(0)
                buffer.truncate()
        yield buffer.getvalue()

    headers = {"Content-Disposition": f'attachment; filename="recording-{recording_id}.csv"'}
    return StreamingResponse(lines(), media_type="text/csv", headers=headers)


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
