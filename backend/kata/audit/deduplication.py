"""Deduplicate audit entries for one minute: pages request the same record repeatedly, and attackers repeat requests."""

import json
from collections.abc import Hashable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Final

from kata.audit.chain import Entry
from kata.audit.entries import as_json

WINDOW_S: Final = 60.0
_MAX_WINDOWS: Final = 10_000


@dataclass(slots=True)
class _Window:
    first: Entry
    until_s: float
    last_at: datetime
    again: int = 0


class Deduplicator:
    """Remembers the entries of the last minute by user, action, subject and outcome. One thread at a time may use it."""

    def __init__(self) -> None:
        self._windows: dict[Hashable, _Window] = {}
        """Ordered by their end."""

    def add(self, entry: Entry, now_s: float) -> list[Entry]:
        """Return the entries to be recorded: those of :meth:`expire`, then this one unless an equal entry was recorded in its minute."""
        due = self.expire(now_s)
        # Without a login only the address counts: otherwise each invented id would be remembered.
        what = (entry.patient_id, entry.subject) if entry.account_id else None
        who = (entry.account_id, entry.sign_in_id, entry.address, entry.role)
        key = (*who, entry.action, what, entry.outcome, entry.detail)
        window = self._windows.get(key)
        if window is None:
            self._windows[key] = _Window(entry, now_s + WINDOW_S, entry.at)
            return [*due, entry]
        window.again += 1
        window.last_at = entry.at
        return due

    def expire(self, now_s: float) -> list[Entry]:
        """Remove ended windows. Return an entry with the number of repetitions for each refusal; repeated views are not counted."""
        counted = []
        while (ends_s := self.next_s) is not None and (ends_s <= now_s or len(self._windows) > _MAX_WINDOWS):
            window = self._windows.pop(next(iter(self._windows)))
            if window.again and window.first.outcome != "done":
                detail = json.loads(window.first.detail or "{}") | {"again": window.again}
                counted.append(replace(window.first, at=window.last_at, detail=as_json(detail)))
        return counted

    @property
    def next_s(self) -> float | None:
        """Return the end of the next window; None if there is none."""
        first = next(iter(self._windows.values()), None)
        return first.until_s if first else None
