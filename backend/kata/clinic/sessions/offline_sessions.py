"""Run a session while the database is unavailable, with the records in :mod:`kata.clinic.sessions.offline_cache`.

The rules are the same as with the database. A method that changes a session returns the events that the caller must spool.
"""

import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Final
from uuid import UUID, uuid4

from kata.clinic.contraindications import service as contraindications
from kata.clinic.episodes.limits import MotorLimits
from kata.clinic.programmes import planned
from kata.clinic.sessions import checks, ending, identity, plans, runs
from kata.clinic.sessions.checklist import Answer, CheckName, CheckState
from kata.clinic.sessions.identity import PatientIdentity
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.prefetch import CachedPatient, CachedRecording
from kata.clinic.sessions.replay import (
    CheckAnswered,
    PainRecorded,
    RunStarted,
    SessionClosed,
    SessionOpened,
    serialize_limits,
)
from kata.clinic.sessions.schemas import (
    CheckAnswer,
    CheckConfirmation,
    EndRangePrescription,
    EndReason,
    PainWhen,
    Run,
    RunOutcome,
    Session,
    SessionPatient,
    SessionUpdate,
)
from kata.database.base import utc_now
from kata.errors import check_version
from kata.motion import edit
from kata.motion.ilc import Correction

_PAIN: Final[tuple[PainWhen, ...]] = ("pain_before", "pain_during", "pain_after")


@dataclass(frozen=True)
class CheckedRun:
    """A run that has passed every check and can be loaded."""

    started: RunStarted
    new_answers: tuple[CheckAnswered, ...]
    """Checks that the apparatus has answered and that are not stored yet."""
    run: Run
    recording: CachedRecording
    motion: edit.Motion
    learned: Correction | None
    limits: MotorLimits
    patient: SessionPatient
    end_range: EndRangePrescription | None


class OfflineSessions:
    """The sessions that run at this station while the database is unavailable. Thread-safe."""

    def __init__(self, cache: OfflineCache, station: str) -> None:
        """``station``: the station's name."""
        self.cache, self._station = cache, station

    def session(self, session_id: UUID) -> Session | None:
        """Return the cached session, or None if it is unknown."""
        cached = self.cache.find_session(session_id)
        return cached.clinic_session if cached else None

    def open_session(
        self, session_id: UUID, patient_id: UUID, therapist: str, programme_version_id: UUID | None
    ) -> tuple[Session, SessionOpened | None] | None:
        """Return this patient's open session, or begin one with the given id. Return None if no session may begin.

        The caller spools the returned event.
        """
        with self.cache.lock:
            cached = self.cache.find_patient(patient_id)
            if cached is None or not self.cache.is_needed:
                return None
            if cached.clinic_session and not cached.clinic_session.ended_at:
                return cached.clinic_session, None
            programme, episode_id = cached.programme, cached.episode_id
            if programme is None or episode_id is None or not self.cache.may_begin(cached):
                return None
            if programme.version_id != programme_version_id:
                return None
            at = utc_now()
            opened = SessionOpened(
                session_id, patient_id, episode_id, programme.version_id, therapist, self._station, at
            )
            clinic_session = cached.new_clinic_session(session_id, therapist, self._station, at)
            minutes = programme.timer_minutes
            timer = planned.PlanTimer(minutes=minutes, played_s=0.0, left_s=60.0 * minutes) if minutes else None
            self.cache.store(replace(cached, clinic_session=clinic_session, timer=timer, at_s=time.monotonic()))
            self.cache.attend(patient_id, session_id)
            return clinic_session, opened

    def discard_session(self, session_id: UUID) -> None:
        """Remove a session that could not be spooled."""
        with self.cache.lock:
            if cached := self.cache.find_session(session_id):
                self.cache.store(replace(cached, clinic_session=None, timer=None))

    def update_session(self, session_id: UUID, update: SessionUpdate) -> tuple[Session, list[PainRecorded]] | None:
        """Store pain scores. Return None if the session is unknown or the update contains other fields.

        :raises ProblemError: 409 when the session was changed meanwhile.
        """
        with self.cache.lock:
            cached = self.cache.find_session(session_id)
            clinic_session = cached.clinic_session if cached else None
            scores = update.model_dump(exclude_unset=True, exclude={"updated_at"})
            if cached is None or clinic_session is None or not scores or not scores.keys() <= set(_PAIN):
                return None
            check_version(clinic_session.updated_at, update.updated_at)
            at = utc_now()
            events = [
                PainRecorded(clinic_session.id, when, scores[when], getattr(clinic_session, when), at, self._station)
                for when in _PAIN
                if when in scores
            ]
            changed = clinic_session.model_copy(update={**scores, "updated_at": at})
            self.cache.store(replace(cached, clinic_session=changed))
            return changed, events

    def end_session(
        self, session_id: UUID, reason: EndReason | None, on_apparatus: UUID | None
    ) -> tuple[Session, SessionClosed | None] | None:
        """End a session. Return None if it is unknown. ``on_apparatus``: the session that is now loaded on the apparatus.

        :raises ProblemError: 409 while a run in it has not ended.
        """
        with self.cache.lock:
            cached = self.cache.find_session(session_id)
            clinic_session = cached.clinic_session if cached else None
            if cached is None or clinic_session is None:
                return None
            if clinic_session.ended_at:
                return clinic_session, None
            if on_apparatus == session_id:
                raise ending.run_not_ended()
            ending.check_played(clinic_session.runs)
            at = utc_now()
            ended_session = clinic_session.model_copy(update={"ended_at": at, "end_reason": reason, "updated_at": at})
            self.cache.store(replace(cached, clinic_session=ended_session))
            return ended_session, SessionClosed(session_id, reason, at, self._station)

    def checklist(
        self, session_id: UUID, recording_id: UUID | None, apparatus: checks.ApparatusState
    ) -> tuple[tuple[CheckState, ...], PatientIdentity] | None:
        """Return the result of :func:`kata.clinic.sessions.checks.checklist`, and the identifiers in the record. Return None if session
        or recording is unknown.
        """
        playable = self._find_playable(session_id, recording_id)
        return (self._checked(*playable, apparatus), playable[0].identity) if playable else None

    def answer_check(self, session_id: UUID, check: CheckName, confirmation: CheckConfirmation) -> CheckAnswered | None:
        """Store a user's answer to a check. Return None if session or recording is unknown. The caller spools the returned event.

        :raises ProblemError: 409 for a check that only the apparatus answers, and after the session's end; 422 as in
            :func:`kata.clinic.sessions.identity.subject`.
        """
        with self.cache.lock:
            playable = self._find_playable(session_id, confirmation.recording_id)
            if playable is None:
                return None
            cached, clinic_session, recording = playable
            ending.check_not_ended(clinic_session.ended_at)
            subject = checks.confirmable(recording.needs, check).subject
            if check == "identity":
                subject = identity.subject(confirmation.identifiers, cached.identity.birth_date)
            ticked = CheckAnswered(session_id, check, subject, utc_now(), confirmation.checked_by)
            self.cache.store(replace(cached, clinic_session=_with_answers(clinic_session, [ticked])))
            return ticked

    def start_run(self, request: runs.RunRequest, apparatus: checks.ApparatusState) -> CheckedRun | None:
        """Check and start a run by the same rules as with the database. Return None if session or recording is unknown.

        :raises ProblemError: as in :func:`kata.clinic.contraindications.service.check`, :func:`kata.clinic.sessions.runs.prepare`,
            :func:`kata.clinic.programmes.planned.check_timer`,
            :meth:`DoctorLimits.check` and :func:`kata.clinic.sessions.checks.require`.
        """
        playable = self._find_playable(request.session_id, request.recording_id)
        if playable is None:
            return None
        cached, clinic_session, recording = playable
        ending.check_not_ended(clinic_session.ended_at)
        items = clinic_session.programme.items if clinic_session.programme else []
        if request.programme_position is not None:
            planned_items = [(item.position, item.recording_id) for item in items]
            plans.check_place(planned_items, request.programme_position, request.recording_id)
            # The time played since the refresh is unknown. It cannot be longer than the time that has passed.
            if cached.timer and cached.timer.left_s <= time.monotonic() - cached.at_s:
                raise planned.timer_over(cached.timer.minutes)
        contraindications.check(cached.banner.contraindications_of(recording.side))
        motion = runs.with_settings(recording.taught, request.settings)
        recording.allowed.check_self_paced(self_paced=request.self_paced)
        limits = recording.allowed.check(motion, request.resistance_level, request.method)
        checked = self._checked(cached, clinic_session, recording, apparatus)
        checks.require_all(checked)
        corrected_by, learned = (
            recording.learned.get(request.settings, (None, None)) if request.method == "learned" else (None, None)
        )
        started = RunStarted(
            id=uuid4(),
            session_id=request.session_id,
            recording_id=request.recording_id,
            programme_position=request.programme_position,
            started_at=utc_now(),
            resistance_level=request.resistance_level,
            settings=request.settings,
            method=request.method,
            corrected_by=corrected_by,
            allowed=serialize_limits(recording.allowed),
            station=self._station,
            self_paced=request.self_paced,
        )
        new_answers = tuple(
            CheckAnswered(request.session_id, answer.check, answer.subject, answer.at, answer.by)
            for answer in checks.newly_detected(checked, _answers(clinic_session))
        )
        run = runs.as_run(started.row, recording.name)
        with self.cache.lock:
            if now := self.cache.find_session(request.session_id):
                clinic_session = now.clinic_session or clinic_session
                clinic_session = _with_answers(clinic_session, new_answers).model_copy(
                    update={"runs": [*clinic_session.runs, run]}
                )
                self.cache.store(replace(now, clinic_session=clinic_session))
        prescribed = next((item.end_range for item in items if item.position == request.programme_position), None)
        return CheckedRun(started, new_answers, run, recording, motion, learned, limits, cached.patient, prescribed)

    def finish_run(self, run_id: UUID, outcome: RunOutcome | None, ended_at: datetime | None = None) -> None:
        """Store a run's outcome. If it is None, the device has refused the run, which is then removed."""
        changes = {"outcome": outcome, "ended_at": ended_at}
        with self.cache.lock:
            for cached in self.cache.with_loaded_run(run_id):
                if clinic_session := cached.clinic_session:
                    after = [
                        run.model_copy(update=changes) if run.id == run_id else run
                        for run in clinic_session.runs
                        if outcome or run.id != run_id
                    ]
                    self.cache.store(replace(cached, clinic_session=clinic_session.model_copy(update={"runs": after})))

    def _find_playable(
        self, session_id: UUID, recording_id: UUID | None
    ) -> tuple[CachedPatient, Session, CachedRecording] | None:
        cached = self.cache.find_session(session_id)
        if cached is None or cached.clinic_session is None or recording_id is None:
            return None
        recording = cached.recordings.get(recording_id)
        return (cached, cached.clinic_session, recording) if recording else None

    def _checked(
        self,
        cached: CachedPatient,
        clinic_session: Session,
        recording: CachedRecording,
        apparatus: checks.ApparatusState,
    ) -> tuple[CheckState, ...]:
        return checks.check_states(recording.needs, _answers(clinic_session), apparatus, self.cache.estop_tested_at)


def _answers(clinic_session: Session) -> list[Answer]:
    return [Answer(check.check, check.subject, check.at, check.by) for check in clinic_session.checks]


def _with_answers(clinic_session: Session, ticked: Iterable[CheckAnswered]) -> Session:
    added = [CheckAnswer(check=answer.check, subject=answer.subject, at=answer.at, by=answer.by) for answer in ticked]
    return clinic_session.model_copy(update={"checks": [*clinic_session.checks, *added]})
