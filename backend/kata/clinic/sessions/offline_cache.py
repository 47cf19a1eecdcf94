"""Cache the records that a session at this station needs, so that it can run while the database is unavailable.

The cache holds today's patients: those who had a session at this station and those whose record was opened here, at most
``_MAX_PATIENTS`` of them. It is refreshed every ``_REFRESH_S``, so a run is checked against a recent record. Conflicts with changes made
elsewhere are detected at replay (:mod:`kata.clinic.sessions.replay`). Restricted patients are never cached.
"""

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID, uuid4

from kata.clinic.episodes.limits import MotorLimits
from kata.clinic.events import service as events
from kata.clinic.events.observer import ESTOP_TESTED, AlarmsEnded, NewDeviceEvent
from kata.clinic.programmes import planned
from kata.clinic.sessions import checks, ending, plans, prefetch, runs
from kata.clinic.sessions.checklist import Answer, CheckName, CheckState
from kata.clinic.sessions.prefetch import CachedPatient, CachedRecording
from kata.clinic.sessions.replay import CheckAnswered, PainRecorded, RunStarted, SessionClosed, SessionOpened, written
from kata.clinic.sessions.schemas import (
    CheckAnswer,
    EndReason,
    Outcome,
    PainWhen,
    ReadyPatient,
    Run,
    Session,
    SessionPatient,
    SessionUpdate,
)
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.errors import check_version
from kata.motion import edit
from kata.motion.ilc import Correction

_REFRESH_S: Final = 10.0
_MAX_PATIENTS: Final = 20
_MAX_AGE: Final = timedelta(seconds=60)
"""Records that were older than this when the database was lost are not used."""
_PAIN: Final[tuple[PainWhen, ...]] = ("pain_before", "pain_during", "pain_after")


@dataclass(frozen=True)
class CheckedRun:
    """A run that has passed every check and can be loaded."""

    begun: RunStarted
    new_answers: tuple[CheckAnswered, ...]
    """Checks that the apparatus answered and that are not stored yet."""
    run: Run
    recording: CachedRecording
    motion: edit.Motion
    learned: Correction | None
    limits: MotorLimits
    patient: SessionPatient


class OfflineCache:
    """The records of today's patients. Thread-safe."""

    def __init__(self, database: Database, station: str, has_undelivered: Callable[[], bool] = lambda: False) -> None:
        """``has_undelivered``: whether the spool holds events that are not in the database yet. Call :meth:`refresh` to fill the cache."""
        self._database, self._station, self._has_undelivered = database, station, has_undelivered
        self._lock = threading.RLock()
        self._opened: dict[UUID, datetime] = {}
        """Each patient's last activity at this station."""
        self._attended: UUID | None = None
        self._known: dict[UUID, CachedPatient] = {}
        self._unsent: dict[UUID, UUID] = {}
        """Session to patient, for sessions that changed while the database was unavailable."""
        self._changes = 0
        """Number of changes made while the database was unavailable."""
        self._estop_tested_at: datetime | None = None
        self._due_s = 0.0

    def note_opened(self, patient_id: UUID) -> None:
        """Record that an authorized user opened this patient's record here."""
        with self._lock:
            self._touch(patient_id, utc_now())

    def attend(self, patient_id: UUID, session_id: UUID | None) -> None:
        """Give a patient priority: a user works in this session of theirs. None: the session has ended. Drops any other cached session."""
        with self._lock:
            self._attended = patient_id
            self._touch(patient_id, utc_now())
            known = self._known.get(patient_id)
            if known and (known.visit.id if known.visit else None) != session_id:
                del self._known[patient_id]
            self._due_s = 0.0

    def refresh_soon(self) -> None:
        """Refresh at the next call: a session was changed in the database."""
        self._due_s = 0.0

    def on_event(self, item: NewDeviceEvent | AlarmsEnded) -> None:
        """Take note of a successful emergency-stop test."""
        if isinstance(item, NewDeviceEvent) and item.code == ESTOP_TESTED:
            self._estop_tested_at = item.at

    def refresh(self) -> None:
        """Read the records again if they are due. Blocks for seconds on recordings of an hour; call it from a worker thread."""
        with self._lock:
            now_s = time.monotonic()
            if now_s < self._due_s or (self._unsent and self._has_undelivered()):
                return
            self._due_s = now_s + _REFRESH_S
            before, changes = dict(self._known), self._changes
        today = checks.today()
        try:
            with self._database.read() as session:
                seen = prefetch.seen_here(session, self._station, today)
                wanted = self._wanted(seen, today)
                known = prefetch.fetch(session, self._station, wanted, before)
                tested_at = events.estop_tested_at(session, self._station, today)
        except DatabaseUnavailableError:
            return
        with self._lock:
            if changes != self._changes or self._due_s < now_s:
                # A change was made during the read: the result is outdated.
                self._due_s = 0.0
                return
            self._known, self._unsent = known, {}
            self._estop_tested_at = max(filter(None, (tested_at, self._estop_tested_at)), default=None)

    @property
    def may_load(self) -> bool:
        """True if a recording can be loaded in an open session."""
        return any(known.visit and not known.visit.ended_at for known in self._usable())

    def ready(self) -> list[ReadyPatient]:
        """Return the patients whose session can begin or continue, by name. Empty while the database is available."""
        if self._database.unavailable_since is None:
            return []
        ready = [known.as_ready() for known in self._ready()]
        return sorted(ready, key=lambda entry: (entry.patient.name, entry.patient.clinic_number))

    @property
    def ready_patients(self) -> int:
        """The number of patients whose session could begin or continue without the database."""
        return len(self._ready())

    def holds(self, patient_id: UUID) -> bool:
        """True if the patient is in the cache."""
        return any(known.patient.id == patient_id for known in self._usable())

    def owner_of(self, named: Iterable[tuple[str, UUID]]) -> UUID | None:
        """Return the patient who owns every named record, else None."""
        wanted = set(named)
        return next((known.patient.id for known in self._usable() if wanted <= _of(known)), None)

    def is_pending(self, named: Iterable[tuple[str, UUID]]) -> bool:
        """True if a change to one of the named records may not be in the database yet."""
        with self._lock:
            return any(id_ in self._unsent or id_ in self._unsent.values() for _, id_ in named)

    def session(self, session_id: UUID) -> Session | None:
        """Return the cached session, None if it is unknown."""
        known = self._find_session(session_id)
        return known.visit if known else None

    def open_session(
        self, session_id: UUID, patient_id: UUID, therapist: str, programme_version_id: UUID | None
    ) -> tuple[Session, SessionOpened | None] | None:
        """Return this patient's open session, or begin one with the given id. None if no session may begin.

        The caller spools the returned event.
        """
        with self._lock:
            known = next((entry for entry in self._usable() if entry.patient.id == patient_id), None)
            if known is None or self._database.unavailable_since is None:
                return None
            if known.visit and not known.visit.ended_at:
                return known.visit, None
            programme, episode_id = known.programme, known.episode_id
            if programme is None or episode_id is None or not self._may_begin(known):
                return None
            if programme.version_id != programme_version_id:
                return None
            at = utc_now()
            opened = SessionOpened(
                session_id, patient_id, episode_id, programme.version_id, therapist, self._station, at
            )
            visit = known.new_visit(session_id, therapist, self._station, at)
            minutes = programme.timer_minutes
            timer = planned.PlanTimer(minutes=minutes, played_s=0.0, left_s=60.0 * minutes) if minutes else None
            self._attended = patient_id
            self._store(replace(known, visit=visit, timer=timer, at_s=time.monotonic()))
            return visit, opened

    def discard_session(self, session_id: UUID) -> None:
        """Remove a session that could not be spooled."""
        with self._lock:
            if known := self._find_session(session_id):
                self._store(replace(known, visit=None, timer=None))

    def update_session(self, session_id: UUID, given: SessionUpdate) -> tuple[Session, list[PainRecorded]] | None:
        """Store pain scores. None if the session is unknown or the update has other fields.

        :raises ProblemError: 409 when the session was changed meanwhile.
        """
        with self._lock:
            known = self._find_session(session_id)
            visit = known.visit if known else None
            said = given.model_dump(exclude_unset=True, exclude={"updated_at"})
            if known is None or visit is None or not said or not said.keys() <= set(_PAIN):
                return None
            check_version(visit.updated_at, given.updated_at)
            at = utc_now()
            events = [
                PainRecorded(visit.id, when, said[when], getattr(visit, when), at, self._station)
                for when in _PAIN
                if when in said
            ]
            changed = visit.model_copy(update={**said, "updated_at": at})
            self._store(replace(known, visit=changed))
            return changed, events

    def end_session(
        self, session_id: UUID, reason: EndReason | None, on_apparatus: UUID | None
    ) -> tuple[Session, SessionClosed | None] | None:
        """End a session. None if it is unknown. ``on_apparatus``: the session that is loaded on the apparatus now.

        :raises ProblemError: 409 while a run in it has not ended.
        """
        with self._lock:
            known = self._find_session(session_id)
            visit = known.visit if known else None
            if known is None or visit is None:
                return None
            if visit.ended_at:
                return visit, None
            if on_apparatus == session_id:
                raise ending.run_not_ended()
            ending.check_played(visit.runs)
            at = utc_now()
            ended = visit.model_copy(update={"ended_at": at, "end_reason": reason, "updated_at": at})
            self._store(replace(known, visit=ended))
            return ended, SessionClosed(session_id, reason, at, self._station)

    def checklist(
        self, session_id: UUID, recording_id: UUID | None, apparatus: checks.ApparatusState
    ) -> tuple[CheckState, ...] | None:
        """As :func:`kata.clinic.sessions.checks.checklist`. None if session or recording is unknown."""
        found = self._find_playable(session_id, recording_id)
        return self._checked(*found, apparatus) if found else None

    def answer_check(
        self, session_id: UUID, recording_id: UUID | None, check: CheckName, by: str
    ) -> CheckAnswered | None:
        """Store a user's answer to a check. None if session or recording is unknown. The caller spools the returned event.

        :raises ProblemError: 409 for a check that only the apparatus answers, and after the session's end.
        """
        with self._lock:
            found = self._find_playable(session_id, recording_id)
            if found is None:
                return None
            known, visit, recording = found
            ending.check_goes_on(visit.ended_at)
            need = checks.confirmable(recording.needs, check)
            ticked = CheckAnswered(session_id, check, need.subject, utc_now(), by)
            self._store(replace(known, visit=_with_answers(visit, [ticked])))
            return ticked

    def start_run(self, request: runs.RunRequest, apparatus: checks.ApparatusState) -> CheckedRun | None:
        """Check and start a run by the same rules as with the database. None if session or recording is unknown.

        :raises ProblemError: as :func:`kata.clinic.sessions.runs.to_begin`, :func:`kata.clinic.programmes.planned.check_timer`,
            :meth:`DoctorLimits.check` and :func:`kata.clinic.sessions.checks.require`.
        """
        found = self._find_playable(request.session_id, request.recording_id)
        if found is None:
            return None
        known, visit, recording = found
        ending.check_goes_on(visit.ended_at)
        if request.programme_position is not None:
            items = visit.programme.items if visit.programme else ()
            places = [(item.position, item.recording_id) for item in items]
            plans.check_place(places, request.programme_position, request.recording_id)
            # The time played since the refresh is unknown; it is at most the time that has passed.
            if known.timer and known.timer.left_s <= time.monotonic() - known.at_s:
                raise planned.timer_over(known.timer.minutes)
        motion = runs.with_settings(recording.taught, request.settings)
        limits = recording.allowed.check(motion, request.load_level, request.method)
        checked = self._checked(known, visit, recording, apparatus)
        checks.require_all(checked)
        corrected_by, learned = (
            recording.learned.get(request.settings, (None, None)) if request.method == "learned" else (None, None)
        )
        begun = RunStarted(
            id=uuid4(),
            session_id=request.session_id,
            recording_id=request.recording_id,
            programme_position=request.programme_position,
            started_at=utc_now(),
            load_level=request.load_level,
            asked=request.settings,
            method=request.method,
            corrected_by=corrected_by,
            allowed=written(recording.allowed),
            station=self._station,
        )
        new_answers = tuple(
            CheckAnswered(request.session_id, answer.check, answer.subject, answer.at, answer.by)
            for answer in checks.newly_detected(checked, _answers(visit))
        )
        run = runs.as_run(begun.row, recording.name)
        with self._lock:
            if now := self._find_session(request.session_id):
                visit = now.visit or visit
                visit = _with_answers(visit, new_answers).model_copy(update={"runs": [*visit.runs, run]})
                self._store(replace(now, visit=visit))
        return CheckedRun(begun, new_answers, run, recording, motion, learned, limits, known.patient)

    def finish_run(self, run_id: UUID, outcome: Outcome | None, ended_at: datetime | None = None) -> None:
        """Store a run's outcome. None: the device refused the run; it is removed."""
        with self._lock:
            for known in list(self._known.values()):
                visit = known.visit
                if visit is None or not any(run.id == run_id and run.outcome == "loaded" for run in visit.runs):
                    continue
                ended = {"outcome": outcome, "ended_at": ended_at}
                after = [
                    run.model_copy(update=ended) if run.id == run_id else run
                    for run in visit.runs
                    if outcome or run.id != run_id
                ]
                self._store(replace(known, visit=visit.model_copy(update={"runs": after})))

    def _wanted(self, seen: Mapping[UUID, datetime], today: datetime) -> list[UUID]:
        """Return today's patients, the most recent first. The attended patient comes first, also after midnight."""
        with self._lock:
            for patient_id, at in seen.items():
                self._touch(patient_id, max(at, self._opened.get(patient_id, at)))
            for patient_id in [
                patient for patient, at in self._opened.items() if at < today and patient != self._attended
            ]:
                del self._opened[patient_id]
            return sorted(
                self._opened, key=lambda patient: (patient == self._attended, self._opened[patient]), reverse=True
            )

    def _touch(self, patient_id: UUID, at: datetime) -> None:
        self._opened[patient_id] = at
        while len(self._opened) > _MAX_PATIENTS:
            del self._opened[
                min((patient for patient in self._opened if patient != self._attended), key=self._opened.__getitem__)
            ]

    def _usable(self) -> list[CachedPatient]:
        """Return the entries that are recent enough to be used."""
        since = (self._database.unavailable_since or utc_now()) - _MAX_AGE
        with self._lock:
            return [known for known in self._known.values() if known.at >= since]

    def _ready(self) -> list[CachedPatient]:
        return [known for known in self._usable() if known.visit or self._may_begin(known)]

    def _may_begin(self, known: CachedPatient) -> bool:
        day = self._opened.get(known.patient.id)
        return known.programme is not None and day is not None and day >= checks.today()

    def _find_session(self, session_id: UUID) -> CachedPatient | None:
        return next((known for known in self._usable() if known.visit and known.visit.id == session_id), None)

    def _find_playable(
        self, session_id: UUID, recording_id: UUID | None
    ) -> tuple[CachedPatient, Session, CachedRecording] | None:
        known = self._find_session(session_id)
        if known is None or known.visit is None or recording_id is None:
            return None
        recording = known.recordings.get(recording_id)
        return (known, known.visit, recording) if recording else None

    def _store(self, known: CachedPatient) -> None:
        """Store an entry that was changed without the database."""
        self._known[known.patient.id] = known
        if known.visit:
            self._unsent[known.visit.id] = known.patient.id
        self._changes += 1
        self._due_s = 0.0

    def _checked(
        self, known: CachedPatient, visit: Session, recording: CachedRecording, apparatus: checks.ApparatusState
    ) -> tuple[CheckState, ...]:
        return checks.check_states(recording.needs, _answers(visit), apparatus, self._estop_tested_at)


def _of(known: CachedPatient) -> set[tuple[str, UUID]]:
    """Return every record of one patient that a request can name."""
    named = {("patient_id", known.patient.id), *(("recording_id", recording) for recording in known.recordings)}
    if known.programme:
        named.add(("programme_version_id", known.programme.version_id))
    if known.visit:
        named |= {("session_id", known.visit.id), *(("run_id", run.id) for run in known.visit.runs)}
    return named


def _answers(visit: Session) -> list[Answer]:
    return [Answer(check.check, check.subject, check.at, check.by) for check in visit.checks]


def _with_answers(visit: Session, ticked: Iterable[CheckAnswered]) -> Session:
    more = [CheckAnswer(check=answer.check, subject=answer.subject, at=answer.at, by=answer.by) for answer in ticked]
    return visit.model_copy(update={"checks": [*visit.checks, *more]})
