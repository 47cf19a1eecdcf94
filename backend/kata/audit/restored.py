"""Entries of restored backups. A restore discards newer rows of the trail; its entry explains why the anchor still contains them."""

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.audit import anchor, chain
from kata.audit.anchor import AnchorLine
from kata.audit.entries import add_entry, entry
from kata.audit.tables import AuditRow

_ACTION: Final = "backup_restored"


@dataclass(frozen=True, slots=True)
class RestoredGap:
    """The rows that a restore discarded: those from ``number`` on that the anchor contains in lines up to ``line``."""

    number: int
    anchor: str
    line: int

    def explains(self, line: AnchorLine) -> bool:
        """Return whether this restore discarded the row of an anchor line."""
        return line.anchor == self.anchor and line.line <= self.line and line.head.number >= self.number


def note_restored(session: Session, anchor_file: Path, file: str) -> None:
    """Add the entry of a restore from the backup ``file``, with the last line of the anchor."""
    try:
        last = max(anchor.read(anchor_file), key=lambda line: line.line, default=None)
    except OSError:
        last = None
    detail = {"file": file, "from": chain.head(session).number + 1}
    if last:
        detail |= {"anchor": last.anchor, "line": last.line, "to": last.head.number}
    add_entry(session, entry(_ACTION, detail=detail))


def restored_gaps(session: Session) -> Iterator[RestoredGap]:
    """Yield the gap of every restore in the trail."""
    query = select(AuditRow.number, AuditRow.detail).where(AuditRow.action == _ACTION).order_by(AuditRow.number)
    for row in session.execute(query):
        with suppress(ValueError, KeyError, TypeError):
            detail = json.loads(row.detail)
            yield RestoredGap(row.number, str(detail["anchor"]), int(detail["line"]))
