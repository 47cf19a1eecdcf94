"""Routes of import and export."""

from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Annotated, Any, Final, Protocol
from uuid import UUID

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Body, Depends, Query, Request
from fastapi.responses import StreamingResponse
from sqlalchemy.orm import Session

from kata.clinic import texts as clinic_texts
from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import Patient
from kata.clinic.profile import service as profile
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.schemas import Recording, RecordingDetail
from kata.database.engine import Database
from kata.database.series import Series, unpack
from kata.dependencies import PROBLEMS, TheDatabase, TheFigures, TheStation
from kata.errors import ProblemError
from kata.interop import bundle, patient_export, sample_file, service, texts
from kata.interop.codes import PATIENT_NUMBERS, ExportSettings
from kata.interop.fhir_import import FhirImportError, UnreadableFhirError, read_file
from kata.interop.files import file_response
from kata.interop.motion_csv import ParsedMotion, parse_motion
from kata.interop.sample_file import Origin, SampleFormat
from kata.interop.schemas import ImportedMotion, ImportedPatients, UnderstoodMotion
from kata.messages import text_of
from kata.motion.csv_table import TableError
from kata.plotting.figures import FigureWorker
from kata.settings import Settings
from kata.station.station import Station
from kata.types import By, Name, Side

router = APIRouter(tags=["import and export"])

_LARGEST_CSV: Final = 64_000_000
"""Maximum number of characters of a CSV file. An hour at 100 Hz takes about 20 MB."""
_MEDIA: Final[dict[SampleFormat, str]] = {
    "csv": "text/csv",
    "parquet": "application/vnd.apache.parquet",
    "mcap": "application/octet-stream",
    "lerobot.zip": "application/zip",
}
_CSV: Final[dict[int | str, dict[str, Any]]] = {200: {"content": {"text/csv": {"schema": {"type": "string"}}}}}
_PARQUET: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {_MEDIA["parquet"]: {"schema": {"type": "string", "format": "binary"}}}}
}
_MCAP: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {_MEDIA["mcap"]: {"schema": {"type": "string", "format": "binary"}}}}
}
_FHIR: Final[dict[int | str, dict[str, Any]]] = {200: {"content": {bundle.MEDIA_TYPE: {"schema": {"type": "object"}}}}}
_ZIP: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}}}
}
_MEND: Final = clinic_texts.MEND_FILE()

MotionName = Annotated[Name, Query(description="Name of the recording.")]
MotionSide = Annotated[Side, Query(description="The shoulder of the motion.")]
MotionCsv = Annotated[
    bytes,
    Body(
        media_type="text/csv",
        min_length=1,
        max_length=_LARGEST_CSV,
        description="UTF-8 with a header: time_s and the five columns of a pose, or motor_1_deg to motor_5_deg; degrees.",
    ),
]


_FHIR_BODY: Final[dict[str, Any]] = {
    "requestBody": {
        "required": True,
        "content": {
            bundle.MEDIA_TYPE: {
                "schema": {
                    "type": "object",
                    "additionalProperties": True,
                    "title": "Resource",
                    "description": "A FHIR R4 Patient, or a Bundle with Patients.",
                }
            }
        },
    }
}


class InteropServices(Protocol):
    """The services of these routes. ``kata.api.services.Services`` provides them."""

    @property
    def settings(self) -> Settings:
        """Return the settings."""


def _export_settings(request: Request, database: TheDatabase) -> ExportSettings:
    services: InteropServices = request.app.state.services
    settings = services.settings
    with database.read() as session:
        zone = profile.time_zone(session, settings)
    return ExportSettings(settings.fhir_identifier_system or PATIENT_NUMBERS, settings.fhir_profile_of, zone)


TheExportSettings = Annotated[ExportSettings, Depends(_export_settings)]


async def _file(request: Request) -> bytes:
    """Return the body as bytes, because FastAPI would parse it in the event loop."""
    return await request.body()


@router.get(
    "/api/recordings/{recording_id}/samples.csv",
    summary="Download a recording's samples as CSV",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 410, 422) | _CSV,
)
def get_recording_samples(database: TheDatabase, worker: TheFigures, recording_id: UUID) -> StreamingResponse:
    """Return a recording's samples as CSV: ``time_s`` and ``motor_1_deg`` to ``motor_5_deg``."""
    return _samples(database, worker, service.of_recording, recording_id, "csv")


@router.get(
    "/api/recordings/{recording_id}/samples.parquet",
    summary="Download a recording's samples as Parquet",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 410, 422) | _PARQUET,
)
def get_recording_parquet(database: TheDatabase, worker: TheFigures, recording_id: UUID) -> StreamingResponse:
    """Return a recording's samples as Parquet, with their origin in the file's metadata and units in the columns' metadata."""
    return _samples(database, worker, service.of_recording, recording_id, "parquet")


@router.get(
    "/api/recordings/{recording_id}/samples.mcap",
    summary="Download a recording's samples as MCAP",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 410, 422) | _MCAP,
)
def get_recording_mcap(database: TheDatabase, worker: TheFigures, recording_id: UUID) -> StreamingResponse:
    """Return a recording's samples as MCAP: one JSON message per sample on the topic ``recording``, with its schema, and the origin as
    metadata.
    """
    return _samples(database, worker, service.of_recording, recording_id, "mcap")


@router.get(
    "/api/runs/{run_id}/samples.csv",
    summary="Download a run's samples as CSV",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 409, 410, 422) | _CSV,
)
def get_run_samples(database: TheDatabase, worker: TheFigures, run_id: UUID) -> StreamingResponse:
    """Return a run's samples as CSV: time, phase, position on the motion, real time on the motion, and setpoint, angle and torque of each
    motor.

    For a simulated apparatus the file also has the column ``simulated``.
    """
    return _samples(database, worker, service.of_run, run_id, "csv")


@router.get(
    "/api/runs/{run_id}/samples.parquet",
    summary="Download a run's samples as Parquet",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 409, 410, 422) | _PARQUET,
)
def get_run_parquet(database: TheDatabase, worker: TheFigures, run_id: UUID) -> StreamingResponse:
    """Return a run's samples as Parquet, with their origin in the file's metadata and units in the columns' metadata."""
    return _samples(database, worker, service.of_run, run_id, "parquet")


@router.get(
    "/api/runs/{run_id}/samples.mcap",
    summary="Download a run's samples as MCAP",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 409, 410, 422) | _MCAP,
)
def get_run_mcap(database: TheDatabase, worker: TheFigures, run_id: UUID) -> StreamingResponse:
    """Return a run's samples as MCAP: one JSON message per sample on the topic ``run``, with its schema, and the origin as metadata."""
    return _samples(database, worker, service.of_run, run_id, "mcap")


@router.get(
    "/api/runs/{run_id}/samples.lerobot.zip",
    summary="Download a run's samples as a LeRobotDataset",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 409, 410, 422) | _ZIP,
)
def get_run_lerobot(database: TheDatabase, worker: TheFigures, run_id: UUID) -> StreamingResponse:
    """Return a run's samples as a LeRobotDataset v3.0 with one episode. Its rows are at the run's rate; ``observation.time_s`` is the
    measured time.
    """
    return _samples(database, worker, service.of_run, run_id, "lerobot.zip")


@router.post(
    "/api/patients/{patient_id}/recordings/import/preview",
    summary="Check a CSV file of a motion without importing it",
    responses=PROBLEMS.of(404, 422),
)
def preview_imported_motion(
    database: TheDatabase, worker: TheFigures, station: TheStation, patient_id: UUID, side: MotionSide, csv: MotionCsv
) -> UnderstoodMotion:
    """Parse and check a CSV file of a motion in the same way as the import. Nothing is stored."""
    with database.read() as session:
        patients.get(session, patient_id)
    return _as_understood(_parsed(worker, station, csv, side), side)


@router.post(
    "/api/patients/{patient_id}/recordings/import",
    summary="Import a motion from CSV",
    status_code=201,
    responses=PROBLEMS.of(404, 409, 422),
)
def import_motion(
    database: TheDatabase,
    worker: TheFigures,
    station: TheStation,
    patient_id: UUID,
    name: MotionName,
    side: MotionSide,
    csv: MotionCsv,
    taught_by: Annotated[By, Query(description="Name of the person who imports the motion; empty: your name.")] = "",
) -> ImportedMotion:
    """Import a motion from a CSV file as a recording. It is checked against the station's limits as it is when it is loaded.

    Errors are reported with line and column. A file with an error is not imported, and nothing is corrected.
    """
    with database.read() as session:
        patients.get(session, patient_id)
    parsed = _parsed(worker, station, csv, side)
    understood = _as_understood(parsed, side)
    with database.write() as session:
        row = service.store_imported_motion(
            session, patient_id, parsed, name=name, taught_by=taught_by, station=station.config.name
        )
    plain = Recording.model_validate(row).model_dump()
    return ImportedMotion(
        recording=RecordingDetail(**plain, readable=True, ranges=understood.ranges, margin=understood.margin),
        understood=understood,
    )


@router.get(
    "/api/patients/{patient_id}/fhir",
    summary="Export a patient as FHIR",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 409, 422) | _FHIR,
)
def get_patient_fhir(database: TheDatabase, clinic: TheExportSettings, patient_id: UUID) -> StreamingResponse:
    """Return the patient's record as an HL7 FHIR R4 transaction. Sending it again changes nothing at the receiver. What an
    earlier export stated and the record no longer has is marked as entered in error, and a changed value as amended.
    """

    def write(path: Path) -> None:
        bundle.export(database, patient_id, path, clinic)

    return file_response(write, bundle.MEDIA_TYPE, f"patient-{patient_id}.fhir.json")


@router.post(
    "/api/patients/import/fhir",
    summary="Import patients from FHIR",
    status_code=201,
    responses=PROBLEMS.of(409, 422),
    openapi_extra=_FHIR_BODY,
)
def import_fhir_patients(
    database: TheDatabase,
    worker: TheFigures,
    clinic: TheExportSettings,
    affected_side: Annotated[
        Side, Query(description="The treated shoulder. An episode of care is opened for this shoulder.")
    ],
    file: Annotated[bytes, Depends(_file)],
) -> ImportedPatients:
    """Register the patients of a FHIR resource. If an element is not understood or a clinic number is taken, none of them is registered.

    Elements that are not stored here, such as a telephone number, are listed in the answer. Existing records do not change.
    """
    try:
        imported, left_out, further = worker.build(read_file, file, affected_side, clinic.identifier_system)
    except UnreadableFhirError as error:
        raise ProblemError(422, "invalid", error.args[0], _MEND) from error
    except FhirImportError as error:
        raise ProblemError(
            422, "not_understood", texts.IMPORT_REFUSED(reasons=error.texts), _MEND, error.places
        ) from error
    with database.write() as session:
        rows = service.register_patients(session, imported)
    items = [Patient.model_validate(row) for row in rows]
    return ImportedPatients(items=items, left_out=left_out, left_out_further=further)


@router.get(
    "/api/patients/{patient_id}/export.zip",
    summary="Export a patient's complete record",
    response_class=StreamingResponse,
    responses=PROBLEMS.of(404, 409, 422) | _ZIP,
)
def export_patient(
    database: TheDatabase, worker: TheFigures, clinic: TheExportSettings, patient_id: UUID
) -> StreamingResponse:
    """Return a patient's complete record as a ZIP: record, sessions with notes and signatures, FHIR, and every recording and run."""
    with database.read() as session:
        service.identified_patient(session, patient_id)
    headers = {"Content-Disposition": f'attachment; filename="patient-{patient_id}.zip"'}
    chunks = patient_export.chunks(database, worker, patient_id, clinic)
    return StreamingResponse(in_turn(chunks, worker.exporting), media_type="application/zip", headers=headers)


async def in_turn(chunks: Iterator[bytes], limiter: CapacityLimiter) -> AsyncIterator[bytes]:
    """Yield the chunks of a file. A thread makes each chunk and first waits for its turn."""
    while (chunk := await to_thread.run_sync(next, chunks, None, limiter=limiter)) is not None:
        yield chunk


def _samples(
    database: Database,
    worker: FigureWorker,
    of: Callable[[Session, UUID], tuple[Series, Origin]],
    id_: UUID,
    sample_format: SampleFormat,
) -> StreamingResponse:
    with database.read() as session:
        series, origin = of(session, id_)
    name = f"{origin.kind}-{origin.marked_id}.{sample_format}"
    return file_response(
        lambda path: worker.build(sample_file.write, series, origin, sample_format, path), _MEDIA[sample_format], name
    )


def _parsed(worker: FigureWorker, station: Station, csv: bytes, side: Side) -> ParsedMotion:
    try:
        return worker.build(parse_motion, csv, side, station.config)
    except TableError as error:
        raise ProblemError(
            422,
            "not_a_motion",
            texts.FILE_REFUSED(reason=text_of(error)),
            _MEND,
            [(problem.place, problem.what) for problem in error.problems],
        ) from error


def _as_understood(parsed: ParsedMotion, side: Side) -> UnderstoodMotion:
    columns = unpack(parsed.series)
    motion = recordings.Samples(columns["time_s"], columns["angle_deg"])
    return UnderstoodMotion(
        layout=parsed.layout,
        separator=parsed.separator,
        left_alone=list(parsed.left_alone),
        side=side,
        samples=parsed.samples,
        duration_s=parsed.duration_s,
        rate_hz=parsed.rate_hz,
        ranges=recordings.ranges(motion),
        margin=recordings.margin(motion, side),
        simulated=parsed.simulated,
    )
