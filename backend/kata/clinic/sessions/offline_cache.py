"""Cache of the records that a session at this station needs, so that the session can run while the database is unavailable.

The cache contains today's patients: those who had a session at this station and those whose record was opened here, at most
``_MAX_PATIENTS`` of them. It is refreshed every ``_REFRESH_S``, so that a run is checked against a recent record. Conflicts with changes
made elsewhere are detected at replay (:mod:`kata.clinic.sessions.replay`). Restricted patients are never cached.
"""

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta, tzinfo
from typing import Final
from uuid import UUID

from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.banner import PatientBanner
from kata.clinic.events import service as events
from kata.clinic.events.observer import ESTOP_TESTED, AlarmsEnded, NewDeviceEvent
from kata.clinic.patients.sorting import sort_key
from kata.clinic.sessions import checks, prefetch
from kata.clinic.sessions.prefetch import CachedPatient
from kata.clinic.sessions.schemas import (
    ReadyPatient,
)
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.database.engine import Database

_REFRESH_S: Final = 10.0
_DAY_S: Final = 24 * 3600.0
_MAX_PATIENTS: Final = 20
_MAX_AGE: Final = timedelta(seconds=60)
"""Records that were older than this when the database became unavailable are not used."""


class OfflineCache:
    """The records of today's patients. Thread-safe."""

    def __init__(
        self,
        database: Database,
        station: str,
        has_undelivered: Callable[[], bool] = lambda: False,
        read_zone: Callable[[DatabaseSession], tzinfo] = lambda _: UTC,
    ) -> None:
        """``has_undelivered`` returns True if the spool contains events that are not in the database yet. ``read_zone`` reads the clinic's
        time zone. Call :meth:`refresh` to fill the cache.
        """
        self._database, self._station, self._has_undelivered = database, station, has_undelivered
        self.read_zone = read_zone
        """Reads the clinic's time zone from the database."""
        self.zone: tzinfo = UTC
        """The clinic's time zone; UTC until it is read."""
        self.lock = threading.RLock()
        """Held while an entry is read, changed and stored."""
        self._opened: dict[UUID, datetime] = {}
        """Last activity of each patient at this station."""
        self._attended: UUID | None = None
        self._cached: dict[UUID, CachedPatient] = {}
        self._unsent: dict[UUID, UUID] = {}
        """Patient by session, for sessions that changed while the database was unavailable."""
        self._changes = 0
        """Number of changes that a refresh, which reads at the same time, may not contain."""
        self.estop_tested_at: datetime | None = None
        self._estop_tested_s: float | None = None
        """Monotonic time of the last test that this service has observed."""
        self._due_s = 0.0

    def note_opened(self, patient_id: UUID) -> None:
        """Record that an authorized user opened this patient's record here."""
        with self.lock:
            self._touch(patient_id, utc_now())

    def attend(self, patient_id: UUID, session_id: UUID | None) -> None:
        """Give a patient priority because a user works in this session. None: the session has ended. Any other cached session of the
        patient is removed.
        """
        with self.lock:
            self._attended = patient_id
            self._touch(patient_id, utc_now())
            entry = self._cached.get(patient_id)
            if entry and (entry.clinic_session.id if entry.clinic_session else None) != session_id:
                del self._cached[patient_id]
            self._due_s = 0.0

    def refresh_soon(self) -> None:
        """Refresh at the next call of :meth:`refresh`, because a session was changed in the database."""
        self._due_s = 0.0

    def on_event(self, item: NewDeviceEvent | AlarmsEnded) -> None:
        """Note the time of a successful emergency-stop test."""
        if isinstance(item, NewDeviceEvent) and item.code == ESTOP_TESTED:
            self.estop_tested_at = item.at
            self._estop_tested_s = time.monotonic()

    def has_estop_test_since(self, verified_s: float | None) -> bool:
        """Return True if this service has observed a test within a day and since ``verified_s``, a time of the monotonic clock, which
        cannot be set. None: the drives are not verified.
        """
        tested_s = self._estop_tested_s
        if tested_s is None or verified_s is None:
            return False
        return tested_s >= max(verified_s, time.monotonic() - _DAY_S)

    def refresh(self) -> None:
        """Read the records again if they are due. This takes seconds for recordings of an hour, so call it from a worker thread."""
        with self.lock:
            now_s = time.monotonic()
            if now_s < self._due_s or (self._unsent and self._has_undelivered()):
                return
            self._due_s = now_s + _REFRESH_S
            before, changes = dict(self._cached), self._changes
        try:
            with self._database.read() as session:
                self.zone = self.read_zone(session)
                today = checks.today(self.zone)
                seen_at = prefetch.seen_here(session, self._station, today)
                patient_ids = self._patients_to_cache(seen_at, today)
                cached = prefetch.fetch(session, self._station, patient_ids, today.date(), before)
                tested_at = events.estop_tested_at(session, self._station, today)
        except DatabaseUnavailableError:
            return
        with self.lock:
            if changes != self._changes or self._due_s < now_s:
                # A change was made during the read, so the result is outdated.
                self._due_s = 0.0
                return
            self._cached, self._unsent = cached, {}
            self.estop_tested_at = max(filter(None, (tested_at, self.estop_tested_at)), default=None)

    @property
    def is_needed(self) -> bool:
        """True while the database is unavailable."""
        return self._database.unavailable_since is not None

    @property
    def may_load(self) -> bool:
        """True if a recording can be loaded in one of the open sessions."""
        return any(entry.clinic_session and not entry.clinic_session.ended_at for entry in self._usable())

    def ready(self) -> list[ReadyPatient]:
        """Return the patients whose session can begin or continue, by name. Empty while the database is available."""
        if not self.is_needed:
            return []
        names = sorted(self._ready(), key=lambda entry: sort_key(entry.identity.name, entry.identity.kana))
        return [entry.as_ready() for entry in names]

    @property
    def ready_patients(self) -> int:
        """Number of patients whose session could begin or continue without the database."""
        return len(self._ready())

    def holds(self, patient_id: UUID) -> bool:
        """Return True if the patient is in the cache."""
        return self.find_patient(patient_id) is not None

    def owner_of(self, records: Iterable[tuple[str, UUID]]) -> UUID | None:
        """Return the patient who owns every named record, or None if there is no such patient."""
        record_set = set(records)
        return next((entry.patient.id for entry in self._usable() if record_set <= _records_of(entry)), None)

    def is_pending(self, records: Iterable[tuple[str, UUID]]) -> bool:
        """Return True if a change to one of the named records may not be in the database yet."""
        with self.lock:
            return any(id_ in self._unsent or id_ in self._unsent.values() for _, id_ in records)

    def _patients_to_cache(self, seen_at: Mapping[UUID, datetime], today: datetime) -> list[UUID]:
        """Return today's patients, the most recent first. The attended patient always comes first, even after midnight."""
        with self.lock:
            for patient_id, at in seen_at.items():
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
        """Return the entries that are recent enough to use."""
        since = (self._database.unavailable_since or utc_now()) - _MAX_AGE
        with self.lock:
            return [entry for entry in self._cached.values() if entry.at >= since]

    def _ready(self) -> list[CachedPatient]:
        return [entry for entry in self._usable() if entry.clinic_session or self.may_begin(entry)]

    def may_begin(self, entry: CachedPatient) -> bool:
        """Return True if a session of this patient may begin: there is a programme, and the patient was seen here today."""
        day = self._opened.get(entry.patient.id)
        return entry.programme is not None and day is not None and day >= checks.today(self.zone)

    def find_patient(self, patient_id: UUID) -> CachedPatient | None:
        """Return the patient's entry, or None if there is no recent one."""
        return next((entry for entry in self._usable() if entry.patient.id == patient_id), None)

    def find_session(self, session_id: UUID) -> CachedPatient | None:
        """Return the entry of the patient with this session, or None if there is no recent one."""
        return next(
            (entry for entry in self._usable() if entry.clinic_session and entry.clinic_session.id == session_id), None
        )

    def with_loaded_run(self, run_id: UUID) -> list[CachedPatient]:
        """Return the entries, including old ones, whose session contains this run without an outcome."""
        return [
            entry
            for entry in self._cached.values()
            if entry.clinic_session
            and any(run.id == run_id and run.outcome == "loaded" for run in entry.clinic_session.runs)
        ]

    def replace_banner(self, banner: PatientBanner) -> None:
        """Store a patient's banner that was changed in the database, so that the next motion is checked against it."""
        with self.lock:
            if entry := self._cached.get(banner.patient_id):
                self._cached[banner.patient_id] = replace(entry, banner=banner)
                # A refresh that is reading now may have read the former banner.
                self._changes += 1
            self._due_s = 0.0

    def store(self, entry: CachedPatient) -> None:
        """Store an entry that a user changed without the database."""
        self._cached[entry.patient.id] = entry
        if entry.clinic_session:
            self._unsent[entry.clinic_session.id] = entry.patient.id
        self._changes += 1
        self._due_s = 0.0


def _records_of(entry: CachedPatient) -> set[tuple[str, UUID]]:
    """Return every record of one patient that a request can name."""
    records = {("patient_id", entry.patient.id), *(("recording_id", recording) for recording in entry.recordings)}
    if entry.programme:
        records.add(("programme_version_id", entry.programme.version_id))
    if entry.clinic_session:
        records |= {("session_id", entry.clinic_session.id), *(("run_id", run.id) for run in entry.clinic_session.runs)}
    return records
