"""Deduplicate audit entries.

Equal entries are recorded once a minute, because attackers repeat requests. A page that refreshes what it shows makes no new view, so
refreshes are not recorded during the whole login session.
"""

import json
from collections.abc import Hashable
from dataclasses import dataclass, replace
from datetime import datetime
from hashlib import blake2b
from typing import Final

from kata.audit.chain import Entry
from kata.audit.entries import as_json

WINDOW_S: Final = 60.0
_MAX_WINDOWS: Final = 10_000
_MAX_VIEWS: Final = 20_000
"""Maximum number of remembered views of all users. A refresh of a forgotten view is recorded as a view."""


@dataclass(slots=True)
class _Window:
    first: Entry
    until_s: float
    last_at: datetime
    repetitions: int = 0


class Deduplicator:
    """Remembers the entries of the last minute by user, action, subject and outcome. Only one thread at a time may use it."""

    def __init__(self) -> None:
        self._windows: dict[Hashable, _Window] = {}
        """Ordered by the end of the window."""

    def add(self, entry: Entry, now_s: float) -> list[Entry]:
        """Return the entries to record: those of :meth:`expire`, and ``entry`` unless an equal entry was recorded within the last
        minute.
        """
        due_entries = self.expire(now_s)
        # Without a login only the address counts, because otherwise every invented id would be remembered.
        subject = (entry.patient_id, entry.subject) if entry.account_id else None
        requester = (entry.account_id, entry.sign_in_id, entry.address, entry.role)
        key = (*requester, entry.action, subject, entry.outcome, entry.detail)
        window = self._windows.get(key)
        if window is None:
            self._windows[key] = _Window(entry, now_s + WINDOW_S, entry.at)
            return [*due_entries, entry]
        window.repetitions += 1
        window.last_at = entry.at
        return due_entries

    def expire(self, now_s: float) -> list[Entry]:
        """Remove ended windows. Return, for each repeated refusal, an entry with the number of repetitions. Repeated views are not
        counted.
        """
        counted = []
        while (ends_s := self.next_s) is not None and (ends_s <= now_s or len(self._windows) > _MAX_WINDOWS):
            window = self._windows.pop(next(iter(self._windows)))
            if window.repetitions and window.first.outcome != "done":
                detail = json.loads(window.first.detail or "{}") | {"again": window.repetitions}
                counted.append(replace(window.first, at=window.last_at, detail=as_json(detail)))
        return counted

    @property
    def next_s(self) -> float | None:
        """Return the time at which the next window ends, or None if there is no window."""
        first = next(iter(self._windows.values()), None)
        return first.until_s if first else None


class RecordedViews:
    """Remembers which addresses each login session has viewed. Only one thread at a time may use it.

    A page marks the requests that refresh what it shows. The mark is accepted only for a view that has been recorded.
    """

    def __init__(self) -> None:
        self._views: dict[Hashable, None] = {}
        """Ordered by the time of the last view."""

    def add(self, entry: Entry, address: bytes) -> None:
        """Remember a recorded view. ``address``: path and query of the request."""
        key = self._key(entry, address)
        self._views.pop(key, None)
        self._views[key] = None
        if len(self._views) > _MAX_VIEWS:
            del self._views[next(iter(self._views))]

    def __contains__(self, view: tuple[Entry, bytes]) -> bool:
        """Return whether this user has viewed this address before, in the same login session and role."""
        return self._key(*view) in self._views

    @staticmethod
    def _key(entry: Entry, address: bytes) -> Hashable:
        # The address is stored as a hash, because it may be long.
        return entry.sign_in_id, entry.role, entry.action, blake2b(address, digest_size=16).digest()
