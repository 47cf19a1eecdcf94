"""Route that loads an end-feel test, its baseline, or a stretch. The therapist starts it as a playback: approach, then play."""

from uuid import UUID

from fastapi import APIRouter
from fastapi.concurrency import run_in_threadpool
from pydantic import Field

from kata.api import texts
from kata.api.errors import refused
from kata.api.lease_dependencies import Operator
from kata.api.run_start import RunStores, StartedRun, TheRunStores, send_load, writing
from kata.clinic.contraindications import service as contraindications
from kata.clinic.episodes import limits as doctors_limits
from kata.clinic.recordings import service as recordings
from kata.clinic.sessions import checks, end_feel, runs
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.end_feel import EndFeelRequest
from kata.clinic.sessions.end_feel_schemas import EndFeelSpeed, HoldTime, Repetitions
from kata.clinic.sessions.router import TheApparatus
from kata.clinic.sessions.schemas import EndFeelKind, Run
from kata.dependencies import PROBLEMS, TheStation
from kata.device import ipc_messages
from kata.device.config import StationConfig
from kata.errors import ProblemError
from kata.messages import Text
from kata.motion.end_feel import SPEED_DEG_S, STRETCH_REPETITIONS
from kata.station.schemas import PatientRef, ResistanceLevel
from kata.types import Schema, side_of

router = APIRouter(prefix="/api/station", tags=["station"])


class EndFeelLoadRequest(Schema):
    """An end-feel test, its baseline, or a stretch, along a recorded motion."""

    session_id: UUID
    recording_id: UUID
    kind: EndFeelKind = Field(
        description="baseline: a test weight in the form of an arm is in the fixers, not the patient. test: the patient's arm. "
        "stretch: the patient's arm is held at the torque."
    )
    torque_nm: float = Field(
        ge=0.3,
        le=4.0,
        description="Torque between apparatus and shoulder at which a test takes the arm back and a stretch holds it, newton metres. A baseline "
        "ignores it.",
        examples=[2.0],
    )
    resistance_level: ResistanceLevel
    speed_deg_s: EndFeelSpeed = SPEED_DEG_S
    hold_s: HoldTime = 30.0
    repetitions: Repetitions = STRETCH_REPETITIONS
    largest_deg: float | None = Field(
        None,
        ge=-360,
        le=360,
        description="Largest apparatus angle of the motor in a stretch, degrees; null: only the limits of apparatus and doctor. The arm is held "
        "there if the torque is not reached before.",
    )


@router.post(
    "/load-end-feel",
    responses=PROBLEMS.of(404, 409, 410, 422, 503),
    summary="Load an end-feel test, its baseline, or a stretch",
)
async def load_end_feel(
    station: TheStation,
    stores: TheRunStores,
    apparatus: TheApparatus,
    operator: Operator,
    body: EndFeelLoadRequest,
) -> Run:
    """Check a way out along a recording against all limits, and load it as a new run of the session.

    Refused as `load` is; also without a baseline of today, for a recording that moves no motor of the shoulder joint far enough, and for a
    torque above the patient's level. A stretch also needs a level that carries arm and torque together. While the database does not answer, no test begins; the result of a test that has begun arrives later.
    """
    if refusal := station.refusal("load"):
        raise refused(refusal)
    request = EndFeelRequest(**body.model_dump())
    started_run, end_feel_test = await run_in_threadpool(_begin, stores, request, apparatus, station.config)
    stores.offline_sessions.cache.attend(started_run.patient.id, body.session_id)
    command = ipc_messages.Load(
        run_id=str(started_run.run.id),
        recording_id=str(started_run.run.recording_id),
        times_s=started_run.motion.times_s.astype("<f8").tobytes(),
        angles_deg=started_run.motion.angles_deg.astype("<f8").tobytes(),
        side=started_run.side,
        resistance_level=body.resistance_level,
        limits_deg=started_run.limits,
        arm_limits=started_run.allowed.arm,
        max_speed_deg_s=started_run.allowed.max_speed_deg_s,
        end_feel=end_feel_test,
    )
    return await send_load(station, stores, operator, started_run, command, (_changes(body),))


def _changes(body: EndFeelLoadRequest) -> Text:
    match body.kind:
        case "baseline":
            return texts.END_FEEL_BASELINE()
        case "test":
            return texts.END_FEEL_TEST(torque_nm=body.torque_nm)
        case _:
            return texts.STRETCHED(torque_nm=body.torque_nm, hold_s=body.hold_s, repetitions=body.repetitions)


def _begin(
    stores: RunStores, request: EndFeelRequest, apparatus: checks.ApparatusState, config: StationConfig
) -> tuple[StartedRun, ipc_messages.EndFeel]:
    run_request = runs.RunRequest(request.session_id, request.recording_id, request.resistance_level)
    with stores.database.read() as session:
        runs.prepare(session, run_request, apparatus.station)
        recording = recordings.get(session, request.recording_id)
        side = side_of(recording.side)
        contraindications.require_none(session, recording.patient_id, side)
        allowed = doctors_limits.allowed(session, recording.patient_id, side)
        taught = runs.taught(session, recording.id)
        farthest_deg = end_feel.farthest_deg(session, request, config.name, apparatus.today)
    path = end_feel.longest_outward_path(taught, allowed, config, request.speed_deg_s, farthest_deg)
    if request.kind == "stretch":
        path = end_feel.up_to(path, request.largest_deg)
    limits = allowed.check(path.motion, request.resistance_level, "smooth")
    with writing(stores.database, stores.event_spool, "run") as (session, began):
        prepared = end_feel.prepare(session, request, path, config, apparatus.today)
        row = runs.begin(session, run_request, apparatus.station)
        began.append(row.id)
        end_feel.add(session, row, request, prepared, config.name)
        contraindications.require_none(session, recording.patient_id, side)
        if doctors_limits.allowed(session, recording.patient_id, side) != allowed:
            raise ProblemError(409, "edited_meanwhile", texts.LIMITS_CHANGED_MEANWHILE(), texts.LOAD_AGAIN())
        # Checked last, so that users do not prepare a patient for a recording that may not be played.
        checks.require(session, request.session_id, request.recording_id, apparatus)
        patient = sessions.get(session, request.session_id).patient
        started_run = StartedRun(
            run=runs.as_run(row),
            motion=path.motion,
            learned=None,
            side=side,
            limits=limits,
            allowed=allowed,
            patient=PatientRef(id=patient.id, name=patient.name),
        )
        return started_run, prepared.test
