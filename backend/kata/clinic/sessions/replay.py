"""Store the events of a session that was held while the database was unavailable.

Each event goes through the spool and is stored once, in the order in which it occurred. If the record was changed elsewhere in the
meantime, an alarm of the session says what differs.
"""

from collections.abc import Iterator
from datetime import datetime
from typing import Any, Final, Literal
from uuid import UUID, uuid4

import msgspec
from sqlalchemy import or_, select
from sqlalchemy.orm import Session as DatabaseSession

from kata.audit import chain
from kata.clinic import texts
from kata.clinic.contraindications import service as contraindications
from kata.clinic.episodes import limits as doctors_limits
from kata.clinic.episodes.limits import DoctorLimits
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes import service as programmes
from kata.clinic.programmes.tables import ProgrammeVersionRow
from kata.clinic.recordings import service as recordings
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.sessions import checks, runs, service
from kata.clinic.sessions.checklist import Answer, CheckName
from kata.clinic.sessions.schemas import EndReason, PainWhen
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.errors import ProblemError
from kata.messages import Template, Text, sent_key
from kata.motion import edit
from kata.motion.method import Method
from kata.types import side_of

CHANGED_MEANWHILE: Final = "changed_meanwhile"
Change = Literal[
    "ended", "archived", "closed", "limits", "contraindicated",
    "another", "programme", "care_closed", "patient_archived", "restricted", "ended_already",
]  # fmt: skip
CHANGED: Final[dict[Change, Text]] = {
    # Changes that concern a run.
    "ended": texts.PLAYED_IN_ENDED_SESSION(),
    "archived": texts.PLAYED_ARCHIVED_RECORDING(),
    "closed": texts.PLAYED_IN_CLOSED_EPISODE(),
    "limits": texts.PLAYED_UNDER_OLD_LIMITS(),
    "contraindicated": texts.PLAYED_CONTRAINDICATED(),
    # Changes that concern a session.
    "another": texts.BEGUN_BESIDE_ANOTHER(),
    "programme": texts.BEGUN_WITH_OLD_PROGRAMME(),
    "care_closed": texts.BEGUN_IN_CLOSED_EPISODE(),
    "patient_archived": texts.BEGUN_FOR_ARCHIVED_PATIENT(),
    "restricted": texts.BEGUN_FOR_RESTRICTED_PATIENT(),
    "ended_already": texts.ENDED_ALREADY(),
}
PAIN_DIFFERS: Final[dict[PainWhen, Template]] = {
    "pain_before": texts.PAIN_BEFORE_DIFFERS,
    "pain_during": texts.WORST_PAIN_DIFFERS,
    "pain_after": texts.PAIN_AFTER_DIFFERS,
}


class SessionOpened(msgspec.Struct, frozen=True, tag="opened"):
    """A session began while the database was unavailable. Its id is generated at the station."""

    id: UUID
    patient_id: UUID
    episode_id: UUID
    programme_version_id: UUID
    therapist: str
    station: str
    started_at: datetime


class PainRecorded(msgspec.Struct, frozen=True, tag="pained"):
    """A pain score was entered while the database was unavailable."""

    session_id: UUID
    when: PainWhen
    pain: int | None
    before: int | None
    """Score that the cached session had before."""
    at: datetime
    station: str


class SessionClosed(msgspec.Struct, frozen=True, tag="closed"):
    """A session was ended while the database was unavailable."""

    session_id: UUID
    reason: EndReason | None
    at: datetime
    station: str


class RunStarted(msgspec.Struct, frozen=True, tag="begun", omit_defaults=True):
    """A run began while the database was unavailable. Its id is generated at the station. The spool omits ``self_paced`` if it is False."""

    id: UUID
    session_id: UUID
    recording_id: UUID
    programme_position: int | None
    started_at: datetime
    resistance_level: int = msgspec.field(name="load_level")
    settings: edit.PlaybackSettings = msgspec.field(name="asked")
    """The spool stores the settings as ``asked``."""
    method: Method
    corrected_by: UUID | None
    allowed: str
    """The doctor's limits with which the run was checked (:func:`serialize_limits`)."""
    station: str
    self_paced: bool = False

    @property
    def row(self) -> RunRow:
        """Return the run's row in the database."""
        request = runs.RunRequest(
            self.session_id,
            self.recording_id,
            self.resistance_level,
            self.settings,
            self.method,
            self.programme_position,
            self.self_paced,
        )
        row = runs.new(self.id, self.started_at, request)
        row.corrected_by = self.corrected_by
        return row


class CheckAnswered(msgspec.Struct, frozen=True, tag="ticked"):
    """A check was answered while the database was unavailable."""

    session_id: UUID
    check: CheckName
    subject: str
    at: datetime
    by: str


OfflineEvent = SessionOpened | PainRecorded | SessionClosed | RunStarted | CheckAnswered


def store(session: DatabaseSession, event: OfflineEvent) -> None:
    """Store an event. If the record was changed elsewhere in the meantime, also store an alarm.

    :raises ValueError: if the record to which the event belongs no longer exists.
    """
    match event:
        case SessionOpened():
            _store_session(session, event)
        case PainRecorded():
            _store_pain(session, event)
        case SessionClosed():
            _store_end(session, event)
        case RunStarted():
            _store_run(session, event)
        case CheckAnswered():
            checks.store_answer(
                _clinic_session(session, event.session_id), Answer(event.check, event.subject, event.at, event.by)
            )


def serialize_limits(allowed: DoctorLimits) -> str:
    """Return the doctor's limits as a text that can be compared."""
    limits: dict[str, Any] = {
        "max_load_level": allowed.max_resistance_level,
        "motions": sorted(limit.model_dump_json() for limit in allowed.motions),
    }
    if allowed.max_speed_deg_s is not None:
        # Omitted if there is no limit, so that events from the spool of an older version compare equal.
        limits["max_speed_deg_s"] = allowed.max_speed_deg_s
    if allowed.self_paced_permitted:
        limits["self_paced_permitted"] = True
    return msgspec.json.encode(limits).decode()


def _store_session(session: DatabaseSession, opened: SessionOpened) -> None:
    # The database was tried first. A server that hung may still commit that attempt.
    chain.wait_for_others(session)
    if session.get(SessionRow, opened.id):
        return
    patient = session.get(PatientRow, opened.patient_id)
    version = session.get(ProgrammeVersionRow, opened.programme_version_id)
    if patient is None or version is None:
        raise ValueError(f"session {opened.id}: its patient or its programme no longer exists")
    clinic_session = service.new(opened.id, opened.patient_id, opened.episode_id, opened.station, opened.started_at)
    clinic_session.therapist, clinic_session.programme_version_id = opened.therapist, version.id
    session.add(clinic_session)
    session.flush()
    for change in _changes_of_session(session, clinic_session, patient, version):
        _add_alarm(session, clinic_session, opened.station, opened.started_at, CHANGED[change])


def _store_pain(session: DatabaseSession, recorded: PainRecorded) -> None:
    clinic_session = _clinic_session(session, recorded.session_id)
    if clinic_session.signed_at or getattr(clinic_session, recorded.when) not in (recorded.before, recorded.pain):
        sentence = PAIN_DIFFERS[recorded.when](pain="-" if recorded.pain is None else recorded.pain)
        _add_alarm(session, clinic_session, recorded.station, recorded.at, sentence)
        return
    setattr(clinic_session, recorded.when, recorded.pain)
    clinic_session.updated_at = recorded.at


def _store_end(session: DatabaseSession, closed: SessionClosed) -> None:
    clinic_session = _clinic_session(session, closed.session_id)
    if clinic_session.signed_at or clinic_session.ended_at:
        _add_alarm(session, clinic_session, closed.station, closed.at, CHANGED["ended_already"])
        return
    clinic_session.ended_at, clinic_session.end_reason, clinic_session.updated_at = closed.at, closed.reason, closed.at


def _store_run(session: DatabaseSession, started: RunStarted) -> None:
    clinic_session = _clinic_session(session, started.session_id)
    try:
        recording = recordings.get(session, started.recording_id)
    except ProblemError as error:
        raise ValueError(f"run {started.id}: {error}") from error
    session.add(started.row)
    clinic_session.run_count += 1
    for change in _changes_of_run(session, clinic_session, recording, started):
        _add_alarm(session, clinic_session, started.station, started.started_at, CHANGED[change], started.id)


def _clinic_session(session: DatabaseSession, session_id: UUID) -> SessionRow:
    clinic_session = session.get(SessionRow, session_id, with_for_update=True)
    if clinic_session is None:
        raise ValueError(f"session {session_id} no longer exists")
    return clinic_session


def _changes_of_session(
    session: DatabaseSession, clinic_session: SessionRow, patient: PatientRow, version: ProgrammeVersionRow
) -> Iterator[Change]:
    meanwhile = or_(SessionRow.ended_at.is_(None), SessionRow.ended_at > clinic_session.started_at)
    other_sessions = select(SessionRow.id).where(
        SessionRow.patient_id == patient.id, SessionRow.id != clinic_session.id, meanwhile
    )
    if session.scalars(other_sessions).first():
        yield "another"
    if version.programme.archived_at or programmes.newest_number(session, version.programme_id) != version.number:
        yield "programme"
    if not any(episode.id == clinic_session.episode_id and episode.closed_at is None for episode in patient.episodes):
        yield "care_closed"
    if patient.archived_at:
        yield "patient_archived"
    if patient.restricted:
        yield "restricted"


def _changes_of_run(
    session: DatabaseSession, clinic_session: SessionRow, recording: RecordingRow, started: RunStarted
) -> Iterator[Change]:
    if clinic_session.ended_at and clinic_session.ended_at <= started.started_at:
        yield "ended"
    if recording.archived_at and recording.archived_at <= started.started_at:
        yield "archived"
    try:
        contraindications.require_none(session, clinic_session.patient_id, recording.side)
    except ProblemError:
        yield "contraindicated"
    try:
        allowed = doctors_limits.allowed(session, clinic_session.patient_id, side_of(recording.side))
    except ProblemError:
        yield "closed"
    else:
        if serialize_limits(allowed) != started.allowed:
            yield "limits"


def _add_alarm(
    session: DatabaseSession,
    clinic_session: SessionRow,
    station: str,
    at: datetime,
    message: str,
    run_id: UUID | None = None,
) -> None:
    session.add(
        DeviceEventRow(
            id=uuid4(),
            station=station,
            at=at,
            ended_at=None,
            kind="alarm",
            code=CHANGED_MEANWHILE,
            message=str(message),
            message_key=sent_key(message),
            patient_id=clinic_session.patient_id,
            session_id=clinic_session.id,
            run_id=run_id,
        )
    )
