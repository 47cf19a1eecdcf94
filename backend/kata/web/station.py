"""REST for the station: the therapist's commands, each with what the clinic has to write down first."""

from typing import Any, Final
from uuid import UUID, uuid4

from fastapi import APIRouter
from fastapi.concurrency import run_in_threadpool
from pydantic import Field

from kata.clinic.dependencies import PROBLEMS, TheDatabase, TheStation
from kata.clinic.fields import Name, Schema, Side
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import PatientRow
from kata.clinic.problems import ProblemError
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import TeachingRow
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.schemas import Run
from kata.clinic.sessions.tables import RunRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.device import messages
from kata.station.schemas import Live, LoadLevel, PatientRef, StationInfo
from kata.station.station import NO_ANSWER, Occupation, Station
from kata.web.problems import refused

router = APIRouter(prefix="/api/station", tags=["station"])

_COMMAND: Final[dict[int | str, dict[str, Any]]] = PROBLEMS.of(409, 503)


class StationState(Schema):
    """The station and its newest state."""

    station: StationInfo
    live: Live


class Accepted(Schema):
    """The device process has accepted the command; what comes of it, the live state tells."""

    accepted: bool = Field(True, description="Always true: a refusal is a problem document.")


class TeachRequest(Schema):
    """Whom to teach a motion."""

    patient_id: UUID
    name: Name = Field("Motion", description="What its recordings will be called.", examples=["Flexion"])
    side: Side | None = Field(None, description="The patient's affected side unless given.")


class Teaching(Schema):
    """A teaching that has begun; each press of the pedal becomes one recording."""

    teaching_id: UUID


class LoadRequest(Schema):
    """What to play, and in which session."""

    session_id: UUID
    recording_id: UUID
    load_level: LoadLevel = messages.LOAD_LEVELS


@router.get("")
async def get_station(station: TheStation) -> StationState:
    """The station and its newest state; the WebSocket /api/live keeps telling it."""
    return StationState(station=station.info, live=station.live())


@router.post("/teach", responses=PROBLEMS.of(404, 409, 422, 503))
async def teach(station: TheStation, database: TheDatabase, wanted: TeachRequest) -> Teaching:
    """Begin teaching: torque is off, and samples are recorded while the pedal is down."""
    teaching, patient = await run_in_threadpool(_begin_teaching, database, wanted)
    occupation = Occupation(str(teaching.id), PatientRef(id=patient.id, name=patient.name))
    refusal = await station.command(messages.Teach(teaching_id=str(teaching.id)), occupation)
    if refusal:
        if refusal.code != NO_ANSWER:
            await run_in_threadpool(_forget, database, teaching)
        raise refused(refusal)
    return Teaching(teaching_id=teaching.id)


@router.post("/finish-teaching", responses=_COMMAND)
async def finish_teaching(station: TheStation) -> Accepted:
    """End teaching; its takes are saved."""
    return await _send(station, messages.FinishTeaching())


@router.post("/load", responses=PROBLEMS.of(404, 409, 410, 422, 503))
async def load(station: TheStation, database: TheDatabase, wanted: LoadRequest) -> Run:
    """Check a recording against the apparatus' limits and make it the one to be played: a new run."""
    run, taught = await run_in_threadpool(_begin_run, database, wanted)
    command = messages.Load(
        run_id=str(run.id),
        recording_id=str(run.recording_id),
        times_s=taught.times_s.astype("<f8").tobytes(),
        angles_deg=taught.angles_deg.astype("<f8").tobytes(),
        load_level=wanted.load_level,
    )
    patient = await run_in_threadpool(_patient_of, database, wanted.session_id)
    refusal = await station.command(command, Occupation(str(run.id), patient, run.recording_name, run.session_id))
    if refusal:
        if refusal.code != NO_ANSWER:
            await run_in_threadpool(_forget_run, database, run.id)
        raise refused(refusal)
    return run


@router.post("/unload", responses=_COMMAND)
async def unload(station: TheStation) -> Accepted:
    """Forget the loaded recording, unplayed."""
    return await _send(station, messages.Unload())


@router.post("/approach", responses=_COMMAND)
async def approach(station: TheStation) -> Accepted:
    """Torque on, slowly to the recording's start, and hold there."""
    return await _send(station, messages.Approach())


@router.post("/play", responses=_COMMAND)
async def play(station: TheStation) -> Accepted:
    """Play on from where the path stands."""
    return await _send(station, messages.Play())


@router.post("/pause", responses=_COMMAND)
async def pause(station: TheStation) -> Accepted:
    """Slow down on the path and hold."""
    return await _send(station, messages.Pause())


@router.post("/return", responses=_COMMAND)
async def return_to_rest(station: TheStation) -> Accepted:
    """Slowly back to where the approach began, then torque off."""
    return await _send(station, messages.Return())


@router.post("/stop", responses=_COMMAND)
async def stop(station: TheStation) -> Accepted:
    """Ramp down, torque off, latch. Always accepted; waits behind nothing. Not an emergency stop: it needs a network."""
    return await _send(station, messages.Stop())


@router.post("/acknowledge", responses=_COMMAND)
async def acknowledge(station: TheStation) -> Accepted:
    """Acknowledge a stop whose causes have cleared. Starts nothing."""
    return await _send(station, messages.Acknowledge())


async def _send(station: Station, command: messages.Command) -> Accepted:
    refusal = await station.command(command)
    if refusal:
        raise refused(refusal)
    return Accepted(accepted=True)


def _begin_teaching(database: Database, wanted: TeachRequest) -> tuple[TeachingRow, PatientRow]:
    with database.write() as session:
        patient = patients.get(session, wanted.patient_id)
        if patient.archived_at:
            raise ProblemError(409, "archived", f"{patient.name} is archived.", "Restore the patient's record first.")
        row = TeachingRow(
            id=uuid4(),
            patient_id=patient.id,
            name=wanted.name,
            side=wanted.side or patient.affected_side,
            started_at=utc_now(),
        )
        session.add(row)
    return row, patient


def _begin_run(database: Database, wanted: LoadRequest) -> tuple[Run, recordings.Samples]:
    with database.write() as session:
        row = sessions.begin_run(session, wanted.session_id, wanted.recording_id, wanted.load_level)
        return sessions.as_run(row), recordings.samples(session, wanted.recording_id)


def _patient_of(database: Database, session_id: UUID) -> PatientRef:
    with database.read() as session:
        patient = sessions.get(session, session_id).patient
        return PatientRef(id=patient.id, name=patient.name)


def _forget(database: Database, teaching: TeachingRow) -> None:
    """The device refused: it never began."""
    with database.write() as session:
        session.delete(session.merge(teaching))


def _forget_run(database: Database, run_id: UUID) -> None:
    with database.write() as session:
        row = session.get(RunRow, run_id)
        if row and row.outcome == "loaded":
            session.delete(row)
