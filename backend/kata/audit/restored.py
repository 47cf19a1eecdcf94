"""Restoring a backup gives rows of the trail up, and says so in it: then the anchor, which goes on, is right to know more."""

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.audit import anchor, chain
from kata.audit.anchor import Line
from kata.audit.entries import note
from kata.audit.tables import AuditRow

_ACTION: Final = "backup_restored"


@dataclass(frozen=True, slots=True)
class Restored:
    """A row that says: what this anchor told up to that line, of rows from this one on, was given up."""

    number: int
    anchor: str
    line: int

    def holds(self, line: Line) -> bool:
        """Whether what a line tells was given up then."""
        return line.anchor == self.anchor and line.line <= self.line and line.head.number >= self.number


def note_restored(session: Session, anchor_file: Path, file: str) -> None:
    """Write into a database that was just restored from the backup ``file`` what the anchor has seen of the one before."""
    try:
        last = max(anchor.read(anchor_file), key=lambda line: line.line, default=None)
    except OSError:
        last = None
    detail = {"file": file, "from": chain.head(session).number + 1}
    if last:
        detail |= {"anchor": last.anchor, "line": last.line, "to": last.head.number}
    note(session, _ACTION, detail=detail)


def restored(session: Session) -> Iterator[Restored]:
    """Every such row."""
    query = select(AuditRow.number, AuditRow.detail).where(AuditRow.action == _ACTION).order_by(AuditRow.number)
    for row in session.execute(query):
        with suppress(ValueError, KeyError, TypeError):
            told = json.loads(row.detail)
            yield Restored(row.number, str(told["anchor"]), int(told["line"]))
