"""REST routes of the rhythm."""

from uuid import UUID

from fastapi import APIRouter

from kata.clinic.rhythm import service
from kata.clinic.rhythm.schemas import ApparatusRhythm, SoundRhythm
from kata.dependencies import PROBLEMS, TheDatabase, TheFigures, TheStation

router = APIRouter()


@router.get(
    "/api/recordings/{recording_id}/rhythm",
    summary="Get a recording's scapulohumeral rhythm",
    tags=["recordings"],
    responses=PROBLEMS.of(404, 410, 422),
)
def get_recording_rhythm(database: TheDatabase, worker: TheFigures, recording_id: UUID) -> ApparatusRhythm:
    """Return the upward rotation of the scapula over the elevation of the upper arm, and the ratio of joint to scapula by phase.

    The angles are those of the apparatus's links. The rhythm is compared with the newest recording of the same motion on the sound side.
    """
    with database.read() as session:
        stored = service.of_recording(session, recording_id)
    return service.rhythm(worker, stored)


@router.get(
    "/api/runs/{run_id}/rhythm",
    summary="Get a run's scapulohumeral rhythm",
    tags=["sessions"],
    responses=PROBLEMS.of(404, 409, 410, 422),
)
def get_run_rhythm(database: TheDatabase, worker: TheFigures, run_id: UUID) -> ApparatusRhythm:
    """Return the rhythm as it was played and as it was taught. Parts in which resistance took the arm back are left out."""
    with database.read() as session:
        stored = service.of_run(session, run_id)
    return service.rhythm(worker, stored)


@router.get(
    "/api/patients/{patient_id}/sound-rhythm",
    summary="Get the scapulohumeral rhythm of a patient's sound side",
    tags=["recordings"],
    responses=PROBLEMS.of(404, 422),
)
def get_sound_rhythm(database: TheDatabase, worker: TheFigures, station: TheStation, patient_id: UUID) -> SoundRhythm:
    """Return the curves of the sound side's newest recordings, with which the station page compares a live motion.

    Of a simulated station these are recordings of simulated apparatus, of a real station recordings of real apparatus.
    """
    with database.read() as session:
        stored = service.of_sound_side(session, patient_id, simulated=station.info.simulated)
    return service.sound_rhythm(worker, stored)
