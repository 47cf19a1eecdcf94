"""What somebody may see of the station: all of it, but not a patient who is none of their business."""

import time
from typing import Any, Final
from uuid import UUID

from fastapi.concurrency import run_in_threadpool

from kata.actor import Actor
from kata.auth.permissions import OF_ROLE
from kata.clinic.restricted import service as restricted
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.database.availability import DatabaseAwayError
from kata.database.engine import Database

_OF_A_PATIENT: Final = ("patient", "recording_name", "session_id")
_ASKED_AGAIN_S: Final = 5.0
"""So long a watcher goes by what was found before: a record may be restricted, or the glass broken, while it is played."""


class View:
    """One watcher's."""

    def __init__(self, actor: Actor, database: Database, offline_cache: OfflineCache | None = None) -> None:
        """``offline_cache``: who is on this station's apparatus while the database cannot be asked."""
        self._actor = actor
        self._offline_cache = offline_cache
        self._database = database
        self._reads_records = "read_records" in OF_ROLE[actor.role]
        self._patient_id: UUID | None = None
        self._seen = False
        self._asked_at_s = 0.0

    async def of(self, state: dict[str, Any]) -> dict[str, Any]:
        """What :class:`~kata.station.schemas.Live` says, as JSON: without patient and recording that are not for this watcher."""
        shown = dict(state)
        for going_on in ("run", "teaching"):
            told = state[going_on]
            if told and told["patient"] and not await self.may_see(UUID(told["patient"]["id"])):
                shown[going_on] = told | {name: None for name in _OF_A_PATIENT if name in told}
        return shown

    async def may_hear_of(self, patient_id: UUID) -> bool:
        """Whether what was saved of a patient is for this watcher."""
        return self._reads_records and await run_in_threadpool(self._look, patient_id)

    async def may_see(self, patient_id: UUID) -> bool:
        """Whether a patient on the apparatus is for this watcher; asked again every few seconds."""
        if not self._reads_records:
            return False
        now = time.monotonic()
        if patient_id != self._patient_id or now - self._asked_at_s > _ASKED_AGAIN_S:
            self._seen = await run_in_threadpool(self._look, patient_id)
            self._patient_id, self._asked_at_s = patient_id, now
        return self._seen

    def _look(self, patient_id: UUID) -> bool:
        try:
            with self._database.read() as session:
                return restricted.may_see(session, self._actor, [patient_id])
        except DatabaseAwayError:
            # Whom they saw they go on seeing; else only the patients of this day, and nobody who is restricted is one.
            known = self._offline_cache is not None and self._offline_cache.holds(patient_id)
            return known or (self._seen and patient_id == self._patient_id)
