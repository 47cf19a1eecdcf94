"""Remove from the live state the patients whom the user may not see."""

import time
from typing import Any, Final
from uuid import UUID

from fastapi.concurrency import run_in_threadpool

from kata.actor import Actor
from kata.auth.permissions import ROLE_PERMISSIONS
from kata.clinic.restricted import service as restricted
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.database.availability import DatabaseUnavailableError
from kata.database.engine import Database

_REDACTED_FIELDS: Final = ("patient", "recording_name", "session_id")
_PERMISSION_VALID_S: Final = 5.0
"""Seconds for which a permission from the database is used. A record may become restricted, or be opened by break-glass access, during
playback.
"""


class Redaction:
    """Redacts the live state for one user."""

    def __init__(self, actor: Actor, database: Database, offline_cache: OfflineCache | None = None) -> None:
        """``offline_cache``: answers for this station's patients while the database does not."""
        self._actor = actor
        self._offline_cache = offline_cache
        self._database = database
        self._reads_records = "read_records" in ROLE_PERMISSIONS[actor.role]
        self._patient_id: UUID | None = None
        self._was_allowed = False
        self._checked_at_s = 0.0

    async def apply(self, state: dict[str, Any]) -> dict[str, Any]:
        """Return :class:`~kata.station.schemas.Live` as JSON, without patients and recordings that this user may not see."""
        redacted = dict(state)
        for name in ("run", "teaching"):
            activity = state[name]
            if activity and activity["patient"] and not await self.may_see(UUID(activity["patient"]["id"])):
                redacted[name] = activity | {field: None for field in _REDACTED_FIELDS if field in activity}
        return redacted

    async def may_be_notified_of(self, patient_id: UUID) -> bool:
        """Return whether this user may learn that data of a patient have been saved."""
        return self._reads_records and await run_in_threadpool(self._query, patient_id)

    async def may_see(self, patient_id: UUID) -> bool:
        """Return whether this user may see a patient on the apparatus. The answer is cached for a few seconds."""
        if not self._reads_records:
            return False
        now = time.monotonic()
        if patient_id != self._patient_id or now - self._checked_at_s > _PERMISSION_VALID_S:
            self._was_allowed = await run_in_threadpool(self._query, patient_id)
            self._patient_id, self._checked_at_s = patient_id, now
        return self._was_allowed

    def _query(self, patient_id: UUID) -> bool:
        try:
            with self._database.read() as session:
                return restricted.may_see(session, self._actor, [patient_id])
        except DatabaseUnavailableError:
            # A patient whom the user saw before stays visible. Otherwise only patients of the offline cache are, none of whom has a
            # restricted record.
            is_cached = self._offline_cache is not None and self._offline_cache.holds(patient_id)
            return is_cached or (self._was_allowed and patient_id == self._patient_id)
