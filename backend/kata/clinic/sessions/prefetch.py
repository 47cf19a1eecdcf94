"""Load the records that sessions of some patients need. A dozen queries serve all patients, and only new samples are loaded."""

import logging
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session as DatabaseSession
from sqlalchemy.orm import selectinload

from kata.clinic import banner
from kata.clinic.banner import PatientBanner
from kata.clinic.episodes import limits as doctors_limits
from kata.clinic.episodes.limits import DoctorLimits
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes import planned
from kata.clinic.programmes import service as programmes
from kata.clinic.recordings import service as recordings
from kata.clinic.sessions import checks, plans, runs, service, stored_corrections
from kata.clinic.sessions.checklist import Need
from kata.clinic.sessions.identity import PatientIdentity
from kata.clinic.sessions.schemas import ReadyPatient, Session, SessionItem, SessionPatient, SessionProgramme
from kata.clinic.sessions.tables import SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError
from kata.motion import edit
from kata.motion.ilc import Correction
from kata.types import Side, side_of

log = logging.getLogger(__name__)

_MOST_SAMPLES: Final = 2_000_000
"""Maximum number of samples of all recordings together. At 48 bytes each, this is more than five hours at 100 Hz."""


@dataclass(frozen=True)
class CachedRecording:
    """A recording in the cache."""

    name: str
    side: Side
    taught: edit.Motion
    needs: tuple[Need, ...]
    allowed: DoctorLimits
    learned: Mapping[edit.PlaybackSettings, tuple[UUID, Correction]]
    """Run that taught the correction, and the correction, by settings."""


@dataclass(frozen=True)
class CachedPatient:
    """A patient in the cache, with the records of the last refresh."""

    patient: SessionPatient
    identity: PatientIdentity
    banner: PatientBanner
    episode_id: UUID | None
    """Id of the open episode, or None."""
    side: Side | None
    contraindications: str
    programme: SessionProgramme | None
    """Plan of a new session: the newest programme of the open episode."""
    clinic_session: Session | None
    """The open session, including changes made since the refresh."""
    timer: planned.PlanTimer | None
    """Timer of that session's programme."""
    recordings: Mapping[UUID, CachedRecording]
    """Recordings of both programmes, and all other recordings that were played in the session."""
    unplayable: frozenset[UUID]
    """Recordings that could not be played with the database, either."""
    at: datetime
    at_s: float
    """Time of the refresh by the monotonic clock."""

    def new_clinic_session(self, session_id: UUID, therapist: str, station: str, at: datetime) -> Session:
        """Return a new session that follows the programme."""
        return Session(
            id=session_id,
            patient=self.patient,
            episode_id=self.episode_id,
            side=self.side,
            therapist=therapist,
            station=station,
            programme=self.programme,
            started_at=at,
            ended_at=None,
            end_reason=None,
            checks=[],
            pain_before=None,
            pain_during=None,
            pain_after=None,
            note="",
            signed_at=None,
            signed_by="",
            addenda=[],
            updated_at=at,
            runs=[],
        )

    def as_ready(self) -> ReadyPatient:
        """Return the response model."""
        return ReadyPatient(
            patient=self.patient,
            side=self.side,
            contraindications=self.contraindications,
            programme=self.programme,
            session=self.clinic_session,
        )


def fetch(
    session: DatabaseSession, station: str, ids: Sequence[UUID], today: date, before: Mapping[UUID, CachedPatient]
) -> dict[UUID, CachedPatient]:
    """Return those of the given patients whose session is open or could begin. If there are too many samples, return the first patients.

    Patients with a restricted or archived record are left out. ``today``: in the clinic's time zone. ``before``: result of the last call.
    """
    conditions = (PatientRow.id.in_(ids), ~PatientRow.restricted, PatientRow.archived_at.is_(None))
    of_patients = select(PatientRow).where(*conditions)
    of_patients = of_patients.options(selectinload(PatientRow.episodes).lazyload(EpisodeRow.stages))
    rows = {row.id: row for row in session.scalars(of_patients)}
    open_sessions = select(SessionRow).where(SessionRow.patient_id.in_(rows), SessionRow.ended_at.is_(None))
    clinic_sessions = {row.patient_id: row for row in session.scalars(open_sessions.order_by(SessionRow.started_at))}
    versions = programmes.of_patients(session, rows)
    cached: dict[UUID, CachedPatient] = {}
    remaining_samples = _MOST_SAMPLES
    for row in (rows[key] for key in ids if key in rows):
        episode = row.episode if row.episode and row.episode.closed_at is None else None
        of_episode = [
            version
            for version in versions
            if episode and version.programme.episode_id == episode.id and version.programme.archived_at is None
        ]
        programme = plans.programme_of(of_episode[0]) if of_episode else None
        clinic_session = service.as_session(clinic_sessions[row.id]) if row.id in clinic_sessions else None
        if clinic_session is None and programme is None:
            continue
        played = [run.recording_id for run in clinic_session.runs] if clinic_session else []
        items = [
            *(programme.items if programme else ()),
            *(clinic_session.programme.items if clinic_session and clinic_session.programme else ()),
        ]
        needed = dict.fromkeys([*(item.recording_id for item in items), *played])
        size = sum(recordings.get(session, recording_id).samples for recording_id in needed)
        if cached and size > remaining_samples:
            continue
        remaining_samples -= size
        at, at_s, had = utc_now(), time.monotonic(), before.get(row.id)
        playable = _playables(session, row, station, needed, items, had)
        cached[row.id] = CachedPatient(
            patient=SessionPatient.model_validate(row),
            identity=PatientIdentity.model_validate(row),
            banner=banner.of_patient(session, row, today),
            episode_id=episode.id if episode else None,
            side=side_of(episode.side) if episode else None,
            contraindications=episode.contraindications if episode else "",
            programme=programme,
            clinic_session=clinic_session,
            timer=planned.of_session(session, clinic_session.id).timer
            if clinic_session and _has_timer(clinic_session)
            else None,
            recordings=playable,
            unplayable=frozenset(needed) - frozenset(playable),
            at=at,
            at_s=at_s,
        )
    return cached


def seen_here(session: DatabaseSession, station: str, since: datetime) -> dict[UUID, datetime]:
    """Return the patients who had a session at this station since then, with the start of the session."""
    query = select(SessionRow.patient_id, SessionRow.started_at)
    query = query.where(SessionRow.station == station, SessionRow.started_at >= since)
    return {row.patient_id: row.started_at for row in session.execute(query.order_by(SessionRow.started_at))}


def _has_timer(clinic_session: Session) -> bool:
    return clinic_session.programme is not None and clinic_session.programme.timer_minutes is not None


def _playables(
    session: DatabaseSession,
    patient: PatientRow,
    station: str,
    needed: Iterable[UUID],
    items: Iterable[SessionItem],
    before: CachedPatient | None,
) -> dict[UUID, CachedRecording]:
    allowed: dict[str, DoctorLimits] = {
        episode.side: doctors_limits.of_episode(episode) for episode in patient.episodes if episode.closed_at is None
    }
    learned: dict[UUID, set[edit.PlaybackSettings]] = {}
    for item in items:
        if item.method == "learned":
            learned.setdefault(item.recording_id, set()).add(runs.settings_of(item))
    playables: dict[UUID, CachedRecording] = {}
    for recording_id in needed:
        had = before.recordings.get(recording_id) if before else None
        try:
            playable = _playable(session, recording_id, allowed, learned.get(recording_id, ()), station, had)
        except ProblemError as error:
            if before is None or recording_id not in before.unplayable:
                log.info("recording %s is not cached: %s", recording_id, error)
            continue
        if playable:
            playables[recording_id] = playable
    return playables


def _playable(
    session: DatabaseSession,
    recording_id: UUID,
    allowed: Mapping[str, DoctorLimits],
    learning_asked: Iterable[edit.PlaybackSettings],
    station: str,
    before: CachedRecording | None,
) -> CachedRecording | None:
    """Return a recording, or None if it is archived or its shoulder has no open episode.

    Samples and corrections never change, so they are loaded only once.

    ``learning_asked``: settings for which a correction is needed.

    :raises ProblemError: when the recording's samples are damaged.
    """
    recording = recordings.get(session, recording_id)
    if recording.archived_at or recording.side not in allowed:
        return None
    taught = before.taught if before else runs.taught(session, recording_id)
    learned: dict[edit.PlaybackSettings, tuple[UUID, Correction]] = {}
    for settings in learning_asked:
        newest = stored_corrections.newest(session, recording_id, settings, station, utc_now())
        had = before.learned.get(settings) if before else None
        if had and had[0] == newest:
            learned[settings] = had
        elif newest and (correction := stored_corrections.correction(session, newest)):
            learned[settings] = (newest, correction)
    return CachedRecording(
        name=recording.name,
        side=side_of(recording.side),
        taught=taught,
        needs=checks.needs_of(recording, taught.angles_deg),
        allowed=allowed[recording.side],
        learned=learned,
    )
