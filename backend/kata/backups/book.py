"""What became of backups: notes that are left in the data folder, and the rows that the service makes of them."""

import logging
from collections.abc import Sequence
from datetime import datetime
from typing import Final, Literal
from uuid import UUID

import msgspec
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.audit import entries
from kata.backups.folder import notes_folder
from kata.backups.tables import BackupRow
from kata.database.engine import Database
from kata.pagination import Keyset
from kata.settings import Settings

log = logging.getLogger(__name__)

Kind = Literal["nightly", "asked"]
DEFAULT_PAGE: Final = 100
"""Backups on a page: some months of them."""
_NEWEST_FIRST: Final = Keyset(tuple[datetime, UUID], BackupRow.at, BackupRow.id, descending=True)


class Note(msgspec.Struct, frozen=True, kw_only=True):
    """One backup, and how it went."""

    id: UUID
    at: datetime
    kind: Kind
    file: str
    bytes: int = 0
    problem: str = ""
    """Why there is none; empty when there is."""
    tested_at: datetime | None = None
    test_problem: str = ""
    """Why it is not known to be restorable; empty where it was whole and equal."""
    audit_rows: int | None = None
    """Of the audit trail, verified in what came back."""
    audit_problem: str = ""
    """Where that trail is not whole; empty where it is."""


def leave_note(settings: Settings, note: Note) -> None:
    """For the service to take in, now or when it runs again."""
    folder = notes_folder(settings)
    folder.mkdir(parents=True, exist_ok=True)
    part = folder / f"{note.id}.part"
    part.write_bytes(msgspec.json.encode(note))
    part.replace(folder / f"{note.id}.json")


def take_notes_in(settings: Settings, database: Database) -> None:
    """Make rows of the notes that wait: once each, however often a start is cut off; a newer one of the same backup replaces it."""
    for file in sorted(notes_folder(settings).glob("*.json")):
        try:
            note = msgspec.json.decode(file.read_bytes(), type=Note)
        except msgspec.MsgspecError as error:
            log.error("%s tells nothing of a backup (%s); it is removed", file, error)
        else:
            with database.write() as session:
                row = session.merge(BackupRow(**msgspec.structs.asdict(note)))
                failed = row.problem or (row.tested_at and row.test_problem)
                entries.note(
                    session, f"backup_{note.kind}", "failed" if failed else "done", subject=f"backup {note.id}"
                )
        file.unlink()


def newest(session: Session, limit: int, after: str | None = None) -> tuple[Sequence[BackupRow], str | None]:
    """Return a page of backups (newest first) and the next cursor.

    :raises ProblemError: 422 when ``after`` is damaged.
    """
    rows = session.scalars(_NEWEST_FIRST.page(select(BackupRow), after, limit)).all()
    return _NEWEST_FIRST.cut(rows, limit, lambda row: (row.at, row.id))


def last_made(session: Session) -> BackupRow | None:
    """The newest that nothing is known to be wrong with, tried or not."""
    sound = (BackupRow.problem == "", (BackupRow.test_problem == "") | BackupRow.tested_at.is_(None))
    return session.scalars(select(BackupRow).where(*sound).order_by(BackupRow.at.desc()).limit(1)).first()


def last_good(session: Session) -> BackupRow | None:
    """The newest that is known to be restorable."""
    good = (BackupRow.problem == "", BackupRow.test_problem == "", BackupRow.tested_at.is_not(None))
    return session.scalars(select(BackupRow).where(*good).order_by(BackupRow.at.desc()).limit(1)).first()
