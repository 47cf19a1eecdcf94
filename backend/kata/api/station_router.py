"""Routes for the station: the therapist's commands. Each writes its records before it sends the command."""

from functools import partial
from typing import Annotated, Any, Final
from uuid import UUID, uuid4

from fastapi import APIRouter, Depends, Request
from fastapi.concurrency import run_in_threadpool
from pydantic import Field, StrictBool
from sqlalchemy.orm import Session

from kata.actor import note_detail
from kata.api import texts
from kata.api.contraindication_watch import require_allowed
from kata.api.errors import refused
from kata.api.lease_dependencies import Operator, Watcher, record_takeover
from kata.api.live_serializer import LiveStateSerializer
from kata.api.redaction import Redaction
from kata.api.run_start import StartedRun, TheRunStores, send_load, writing
from kata.api.seen_state import Guarded
from kata.api.services import services_of
from kata.api.simulator_router import AnySimulation
from kata.api.stopping import stop_by_user
from kata.clinic import texts as clinic_texts
from kata.clinic.contraindications import service as contraindications
from kata.clinic.episodes import limits as doctors_limits
from kata.clinic.episodes import service as episodes
from kata.clinic.episodes import stages
from kata.clinic.event_spool import EventSpool
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes import planned
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.schemas import Fixtures
from kata.clinic.recordings.tables import TeachingRow
from kata.clinic.sessions import checks, correction_learning, end_range, plans, runs, stored_corrections
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.checklist import CheckName
from kata.clinic.sessions.identity import Identifiers
from kata.clinic.sessions.offline_sessions import OfflineSessions
from kata.clinic.sessions.router import TheApparatus, TheEventSpool, TheOfflineCache
from kata.clinic.sessions.schemas import PlaybackSettings, Run
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.dependencies import PROBLEMS, TheActor, TheDatabase, TheStation
from kata.device import ipc_messages
from kata.device.config import StationConfig
from kata.errors import ProblemError
from kata.messages import Text
from kata.motion.ilc import Correction
from kata.motion.method import Method
from kata.station.lease import Browser
from kata.station.schemas import DriveTrendPoint, LeaseLive, Live, PatientRef, ResistanceLevel, StationInfo
from kata.station.snapshot_tracker import Occupation
from kata.station.station import NO_ANSWER, Station
from kata.types import By, Name, Schema, Side, side_of

router = APIRouter(prefix="/api/station", tags=["station"])

_METHOD_TEXTS: Final[dict[tuple[Method, bool], tuple[Text, ...]]] = {
    ("smooth", False): (),
    ("paper", False): (texts.PLAYED_PAPER(),),
    ("learned", False): (texts.PLAYED_LEARNED_NOTHING(),),
    ("learned", True): (texts.PLAYED_LEARNED(),),
}
"""Texts by playback method and by whether the run has a correction. The page shows them with the changes to the recording."""
_COMMAND: Final[dict[int | str, dict[str, Any]]] = PROBLEMS.of(409, 503)
_GUARDED: Final[dict[int | str, dict[str, Any]]] = PROBLEMS.of(409, 422, 503)


class StationState(Schema):
    """The station and its newest state."""

    station: StationInfo
    live: Live


class SideRequest(Schema):
    """The shoulder for which the apparatus is set up."""

    side: Side


class Accepted(Schema):
    """The device process has accepted the command. The live state shows its result."""

    accepted: bool = Field(True, description="Always true: a refusal is a problem document.")


def _live_serializer(request: Request) -> LiveStateSerializer:
    return services_of(request).live_serializer


TheLiveSerializer = Annotated[LiveStateSerializer, Depends(_live_serializer)]


class TeachRequest(Schema):
    """The patient and motion to teach."""

    patient_id: UUID
    name: Name = Field("Motion", description="Name of the new recordings.", examples=["Flexion"])
    side: Side | None = Field(None, description="Shoulder; by default that of the patient's episode.")
    taught_by: By = Field("", description="Name of the person who guides the arm; empty: your name.", examples=["Sato"])
    fixtures: Annotated[Fixtures, Field(min_length=1)]
    looked_at: set[CheckName] = Field(
        default_factory=set,
        max_length=6,
        description="Checks that the person who teaches has just made for this side and these fixtures. Checks that the "
        "patient's open session contains need not be repeated.",
        examples=[["side", "fixtures", "belt"]],
    )
    identifiers: Identifiers = Field(
        default_factory=set,
        description="Identifiers that the patient has just stated and that agree with the record. Two are needed unless the "
        "identity is confirmed in the patient's open session.",
        examples=[["name", "birth_date"]],
    )


class Teaching(Schema):
    """A teaching that has begun. Each press of the pedal makes one recording."""

    teaching_id: UUID


class LoadRequest(PlaybackSettings):
    """The recording to play, the playback settings, and the session."""

    session_id: UUID
    recording_id: UUID
    programme_position: int | None = Field(
        None,
        ge=1,
        le=1000,
        description="Position in the session's programme; null: the recording was chosen outside the programme.",
    )
    resistance_level: ResistanceLevel
    method: Method = Field(
        "smooth",
        description="paper: 10 Hz, each sample held until the next, as in Sun et al. (2025). smooth: interpolated. learned: smooth, with a "
        "correction from earlier runs of this recording with these settings on this station.",
    )
    self_paced: StrictBool = Field(
        False,
        description="True: the patient's effort sets the pace, up to the recording's speed. Needs the doctor's permission in the episode, the "
        "method smooth, and a station whose load is identified.",
    )


class LeaseRequest(Schema):
    """A request to operate the apparatus from this browser."""

    take_over: StrictBool = Field(
        False, description="Take the lease even if another browser holds it; that browser is notified."
    )


class DriveTrendData(Schema):
    """Voltage and temperature of the drives over the last hours."""

    points: list[DriveTrendPoint]


@router.get("", summary="Read the station's state")
async def get_station(
    station: TheStation,
    database: TheDatabase,
    live_serializer: TheLiveSerializer,
    offline_cache: TheOfflineCache,
    actor: TheActor,
    watcher: Watcher,
) -> StationState:
    """Return the station and its newest state. The WebSocket /api/live sends updates. Patients whom you may not see are left out."""
    state = await Redaction(actor, database, offline_cache).apply(live_serializer.state(watcher))
    return StationState(station=station.info, live=Live.model_validate(state))


@router.get("/drive-trend", summary="Read voltage and temperature of the drives over the last hours")
async def get_drive_trend(station: TheStation) -> DriveTrendData:
    """Return one point every ten seconds of the last three hours, oldest first, since the service started."""
    return DriveTrendData(points=station.drive_trend.points())


@router.post("/lease", responses=PROBLEMS.of(409, 422), summary="Take the lease of the apparatus")
async def take_lease(request: Request, station: TheStation, watcher: Watcher, body: LeaseRequest) -> LeaseLive:
    """Operate the apparatus from this browser. The first command also takes the lease if it is free.

    Other browsers can watch and can stop the apparatus. If the operator's browser has been absent for 2 s, playback pauses, and after
    30 s the motors release the arm. A page that hangs is absent from 1 s after its last shown state.
    """
    before = station.lease_manager.holder
    refusal = station.lease_manager.take(watcher, take_over=body.take_over)
    if refusal:
        raise refused(refusal)
    if before and before.id != watcher.id:
        record_takeover(services_of(request).audit_log, before)
    return station.lease_manager.lease_for(watcher)


@router.delete("/lease", responses=PROBLEMS.of(409), summary="Release the lease of the apparatus")
async def release_lease(station: TheStation, watcher: Watcher) -> LeaseLive:
    """Stop operating the apparatus. Refused while the motors move or hold the arm, or may do either."""
    refusal = station.lease_manager.release(watcher, station.torque)
    if refusal:
        raise refused(refusal)
    return station.lease_manager.lease_for(watcher)


@router.post("/side", responses=PROBLEMS.of(409, 422), summary="Set the side of the apparatus")
async def set_side(station: TheStation, simulation: AnySimulation, operator: Operator, body: SideRequest) -> Accepted:
    """Confirm that the apparatus has been turned, with its pin, to a shoulder. A simulated apparatus is turned by this request.

    Before this request, motions of the other shoulder can be neither taught nor played, because motors 3 and 4 turn in the opposite
    direction. The control program restarts, which takes about a second; then the emergency stop must be tested again. Refused while the
    motors hold an arm or may hold one. An apparatus that is switched off can be turned.
    """

    async def meanwhile() -> None:
        if simulation:
            await run_in_threadpool(simulation.set_side, body.side)

    refusal = await station.set_side(body.side, meanwhile)
    if refusal:
        raise refused(refusal)
    return Accepted(accepted=True)


@router.post("/teach", responses=PROBLEMS.of(404, 409, 422, 503), summary="Begin teaching")
async def teach(
    station: TheStation,
    database: TheDatabase,
    event_spool: TheEventSpool,
    apparatus: TheApparatus,
    operator: Operator,
    body: TeachRequest,
) -> Teaching:
    """Begin teaching: torque is off, and samples are recorded while the pedal is pressed.

    Refused while the checklist is incomplete, with or without a session, and if a contraindication forbids motion. In another mode,
    teaching is refused before any record is read.
    """
    _refuse_by_mode(station, "teach")
    teaching, patient = await run_in_threadpool(_begin_teaching, database, event_spool, body, apparatus)
    occupation = Occupation(str(teaching.id), PatientRef(id=patient.id, name=patient.name))
    command = ipc_messages.Teach(teaching_id=str(teaching.id), side=side_of(teaching.side))
    never_begun = partial(event_spool.put_not_begun, "teaching", teaching.id)
    refusal = await station.command(command, occupation, by=operator, refused_late=never_begun)
    if refusal:
        if refusal.code != NO_ANSWER:
            never_begun()
        raise refused(refusal)
    return Teaching(teaching_id=teaching.id)


@router.post("/finish-teaching", responses=_COMMAND, summary="Finish teaching")
async def finish_teaching(station: TheStation, operator: Operator) -> Accepted:
    """End teaching and save its takes."""
    return await _send(station, ipc_messages.FinishTeaching(), operator)


@router.post("/load", responses=PROBLEMS.of(404, 409, 410, 422, 503), summary="Load a recording for playback")
async def load(
    station: TheStation,
    stores: TheRunStores,
    apparatus: TheApparatus,
    operator: Operator,
    body: LoadRequest,
) -> Run:
    """Check a recording with its settings against the apparatus' limits and load it as a new run.

    Refused while the session's checklist is incomplete, and if a contraindication forbids motion. While the database does not answer, this
    station's running session continues with prefetched data. In another mode, loading is refused before any record is read.
    """
    _refuse_by_mode(station, "load")
    # No database access from here until the device has answered: if the database failed in between, the run would never end.
    try:
        started_run = await run_in_threadpool(
            _begin_run, stores.database, stores.event_spool, body, apparatus, station.config
        )
    except DatabaseUnavailableError:
        offline_run = await run_in_threadpool(
            _begin_without_database, stores.offline_sessions, stores.event_spool, body, apparatus, station.config
        )
        if offline_run is None:
            raise
        started_run = offline_run
    else:
        stores.offline_sessions.cache.attend(started_run.patient.id, body.session_id)
    run, motion, learned = started_run.run, started_run.motion, started_run.learned
    command = ipc_messages.Load(
        run_id=str(run.id),
        recording_id=str(run.recording_id),
        times_s=motion.times_s.astype("<f8").tobytes(),
        angles_deg=motion.angles_deg.astype("<f8").tobytes(),
        side=started_run.side,
        resistance_level=body.resistance_level,
        limits_deg=started_run.limits,
        arm_limits=started_run.allowed.arm,
        max_speed_deg_s=started_run.allowed.max_speed_deg_s,
        method=body.method,
        self_paced=body.self_paced,
        correction_deg=learned.angles_deg.astype("<f8").tobytes() if learned else b"",
        correction_step_s=learned.step_s if learned else 0.0,
        repetition_s=motion.duration_s / body.repetitions,
    )
    own_pace = (texts.PATIENT_SETS_PACE(),) if body.self_paced else ()
    changes = (*motion.done, *_METHOD_TEXTS[body.method, learned is not None], *_learning_notes(learned), *own_pace)
    return await send_load(station, stores, operator, started_run, command, changes)


@router.post("/unload", responses=_COMMAND, summary="Unload the recording")
async def unload(station: TheStation, operator: Operator) -> Accepted:
    """Unload the recording without playing it."""
    return await _send(station, ipc_messages.Unload(), operator)


@router.post("/approach", responses=_GUARDED, summary="Move to the start of the recording")
async def approach(station: TheStation, stores: TheRunStores, guard: Guarded, operator: Operator) -> Accepted:
    """Switch torque on, move slowly to the recording's start, and hold there. Refused if a contraindication forbids motion."""
    await require_allowed(station, stores.offline_sessions.cache, stores.database)
    return await _send(station, ipc_messages.Approach(stops=guard.stops, expires_ns=guard.expires_ns), operator)


@router.post("/play", responses=_GUARDED, summary="Play the recording")
async def play(station: TheStation, stores: TheRunStores, guard: Guarded, operator: Operator) -> Accepted:
    """Play from the current position on the path. Refused if a contraindication forbids motion."""
    await require_allowed(station, stores.offline_sessions.cache, stores.database)
    return await _send(station, ipc_messages.Play(stops=guard.stops, expires_ns=guard.expires_ns), operator)


@router.post("/pause", responses=_COMMAND, summary="Pause the playback")
async def pause(station: TheStation, operator: Operator) -> Accepted:
    """Slow down on the path and hold."""
    return await _send(station, ipc_messages.Pause(), operator)


@router.post("/reduce-range", responses=_COMMAND, summary="Reduce the range of motion")
async def reduce_range(station: TheStation, operator: Operator) -> Accepted:
    """Reduce the range by a tenth during playback, towards the recording's rest posture.

    The reduced range recovers slowly with each repetition.
    """
    return await _send(station, ipc_messages.ReduceRange(), operator)


@router.post("/return", responses=_GUARDED, summary="Return and release torque")
async def return_to_rest(station: TheStation, guard: Guarded, operator: Operator) -> Accepted:
    """Return slowly to the pose where the approach began, then switch torque off."""
    return await _send(station, ipc_messages.Return(stops=guard.stops, expires_ns=guard.expires_ns), operator)


@router.post("/stop", responses=_COMMAND, summary="Stop the apparatus")
async def stop(request: Request) -> Accepted:
    """Ramp down, switch torque off and latch the stop. Accepted at any time from any browser, without waiting.

    This is not an emergency stop, because it needs a network.
    """
    refusal = await stop_by_user(services_of(request))
    if refusal:
        raise refused(refusal)
    return Accepted(accepted=True)


@router.post("/release-torque", responses=_GUARDED, summary="Release torque found at connection")
async def release_torque(station: TheStation, guard: Guarded, operator: Operator) -> Accepted:
    """Switch off torque that was already on when the drives were connected. The arm must be supported. Only possible while stopped."""
    return await _send(station, ipc_messages.ReleaseTorque(stops=guard.stops, expires_ns=guard.expires_ns), operator)


@router.post("/acknowledge", responses=_GUARDED, summary="Acknowledge a stop")
async def acknowledge(station: TheStation, guard: Guarded, operator: Operator) -> Accepted:
    """Acknowledge a stop whose causes have cleared. This starts no motion."""
    return await _send(station, ipc_messages.Acknowledge(stops=guard.stops, expires_ns=guard.expires_ns), operator)


def _refuse_by_mode(station: Station, name: ipc_messages.CommandName) -> None:
    if refusal := station.refusal(name):
        raise refused(refusal)


async def _send(station: Station, command: ipc_messages.Command, operator: Browser | None) -> Accepted:
    refusal = await station.command(command, by=operator)
    if refusal:
        raise refused(refusal)
    return Accepted(accepted=True)


def _begin_teaching(
    database: Database, event_spool: EventSpool, requested: TeachRequest, apparatus: checks.ApparatusState
) -> tuple[TeachingRow, PatientRow]:
    with writing(database, event_spool, "teaching") as (session, began):
        patient = patients.get(session, requested.patient_id)
        if patient.archived_at:
            raise ProblemError(
                409,
                "archived",
                clinic_texts.PATIENT_ARCHIVED(patient=patient.name),
                clinic_texts.RESTORE_PATIENT_FIRST(),
            )
        side = checks.teaching_side(patient, requested.side)
        contraindications.require_none(session, patient.id, side)
        request = checks.TeachingRequest(patient.id, side, requested.fixtures)
        confirmed = checks.ConfirmedNow(requested.looked_at, requested.identifiers, requested.taught_by)
        checks.require_teaching(session, request, confirmed, apparatus)
        row = TeachingRow(
            id=uuid4(),
            patient_id=patient.id,
            name=requested.name,
            side=side,
            taught_by=requested.taught_by,
            fixtures=sorted(requested.fixtures),
            started_at=utc_now(),
        )
        began.append(row.id)
        session.add(row)
    return row, patient


def _learning_notes(learned: Correction | None) -> list[Text]:
    """Return why the playback that taught a correction used an earlier correction; empty if it did not."""
    return correction_learning.fall_back(learned.learned_from) if learned and learned.learned_from else []


def _run_request(requested: LoadRequest) -> runs.RunRequest:
    settings = runs.settings_of(requested)
    position = requested.programme_position
    return runs.RunRequest(
        requested.session_id,
        requested.recording_id,
        requested.resistance_level,
        settings,
        requested.method,
        position,
        requested.self_paced,
    )


def _begin_run(
    database: Database,
    event_spool: EventSpool,
    requested: LoadRequest,
    apparatus: checks.ApparatusState,
    config: StationConfig,
) -> StartedRun:
    """Check the recording in a read session, which takes seconds for an hour of motion, then write. Other writers need not wait for the
    check.
    """
    request = _run_request(requested)
    with database.read() as session:
        prepared = runs.prepare(session, request, apparatus.station)
        if requested.programme_position is not None:
            planned.check_timer(session, requested.session_id)
        learned = stored_corrections.correction(session, prepared.corrected_by)
        recording = recordings.get(session, requested.recording_id)
        side = side_of(recording.side)
        contraindications.require_none(session, recording.patient_id, side)
        allowed = doctors_limits.allowed(session, recording.patient_id, side)
        taught = runs.taught(session, recording.id)
    allowed.check_self_paced(self_paced=requested.self_paced)
    motion = runs.with_settings(taught, request.settings)
    limits = allowed.check(motion, requested.resistance_level, requested.method)
    with writing(database, event_spool, "run") as (session, began):
        row = runs.begin(session, request, apparatus.station, prepared=prepared)
        began.append(row.id)
        if requested.programme_position is not None:
            planned.check_timer(session, requested.session_id)
        contraindications.require_none(session, recording.patient_id, side)
        if doctors_limits.allowed(session, recording.patient_id, side) != allowed:
            raise ProblemError(
                409,
                "edited_meanwhile",
                texts.LIMITS_CHANGED_MEANWHILE(),
                texts.LOAD_AGAIN(),
            )
        # Checked last, so that users do not prepare a patient for a recording that may not be played.
        checks.require(session, requested.session_id, requested.recording_id, apparatus)
        patient = sessions.get(session, requested.session_id).patient
        _note_exceeded(session, patient.id, side, requested)
        return StartedRun(
            run=runs.as_run(row),
            motion=motion,
            learned=learned,
            side=side,
            limits=limits,
            allowed=allowed,
            patient=PatientRef(id=patient.id, name=patient.name),
            end_range=end_range.live(
                taught, side, config, plans.end_range_of(session, row), requested.resistance_level
            ),
        )


def _note_exceeded(session: Session, patient_id: UUID, side: Side, requested: LoadRequest) -> None:
    """Record in the audit trail the settings that exceed the stage's proposal. They are played as requested."""
    episode = episodes.open_episode(session, patient_id, side)
    stage = episode.stage.stage if episode and episode.stage else None
    if exceeded := stages.exceeded(stage, requested.resistance_level, requested):
        # The audit trail stores the level by its column's name.
        stored = ["load_level" if name == "resistance_level" else name for name in exceeded]
        note_detail("beyond_stage", "+".join(stored))


def _begin_without_database(
    offline_sessions: OfflineSessions,
    event_spool: EventSpool,
    requested: LoadRequest,
    apparatus: checks.ApparatusState,
    config: StationConfig,
) -> StartedRun | None:
    """Begin a run from the offline cache. Return None if the cache lacks data or the spool cannot store the run."""
    checked = offline_sessions.start_run(_run_request(requested), apparatus)
    if checked is None:
        return None
    for event in checked.new_answers:
        event_spool.put_offline_event(event)
    if not event_spool.put_offline_event(checked.started):
        event_spool.put_not_begun("run", checked.started.id)
        offline_sessions.finish_run(checked.started.id, None)
        return None
    return StartedRun(
        checked.run,
        checked.motion,
        checked.learned,
        checked.recording.side,
        checked.limits,
        checked.recording.allowed,
        PatientRef(id=checked.patient.id, name=checked.patient.name),
        end_range.live(
            checked.recording.taught, checked.recording.side, config, checked.end_range, requested.resistance_level
        ),
        without_database=True,
    )
