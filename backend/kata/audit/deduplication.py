"""The same again within a minute is no row of its own: pages ask for the same record over and over, and who tries doors tries many."""

import json
from collections.abc import Hashable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Final

from kata.audit.chain import Entry
from kata.audit.entries import written

WINDOW_S: Final = 60.0
_MOST: Final = 10_000
"""Kinds of acts that are remembered at once."""


@dataclass(slots=True)
class _Window:
    first: Entry
    until_s: float
    last_at: datetime
    again: int = 0


class Repeats:
    """Remembers what was noted in the last minute: by whom, what, to what, with which outcome. Of one thread at a time."""

    def __init__(self) -> None:
        """Nothing is remembered yet."""
        self._windows: dict[Hashable, _Window] = {}
        """In the order in which they end."""

    def take(self, entry: Entry, now_s: float) -> list[Entry]:
        """What to write down now: the entry, if it is the first in its minute, behind what :meth:`over` has to tell."""
        told = self.over(now_s)
        # Of somebody who is not signed in the address is all that counts, or each made-up id would be remembered.
        what = (entry.patient_id, entry.subject) if entry.account_id else None
        who = (entry.account_id, entry.sign_in_id, entry.address, entry.role)
        key = (*who, entry.action, what, entry.outcome, entry.detail)
        window = self._windows.get(key)
        if window is None:
            self._windows[key] = _Window(entry, now_s + WINDOW_S, entry.at)
            return [*told, entry]
        window.again += 1
        window.last_at = entry.at
        return told

    def over(self, now_s: float) -> list[Entry]:
        """Of windows that have ended: a row that counts what was refused again. Looks are not counted."""
        told = []
        while (ends_s := self.next_s) is not None and (ends_s <= now_s or len(self._windows) > _MOST):
            window = self._windows.pop(next(iter(self._windows)))
            if window.again and window.first.outcome != "done":
                detail = json.loads(window.first.detail or "{}") | {"again": window.again}
                told.append(replace(window.first, at=window.last_at, detail=written(detail)))
        return told

    @property
    def next_s(self) -> float | None:
        """When the next window ends; None while there is none."""
        first = next(iter(self._windows.values()), None)
        return first.until_s if first else None
