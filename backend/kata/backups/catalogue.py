"""The catalogue of backups: record files in the data folder, which the service imports as rows of the database."""

import logging
from collections.abc import Sequence
from datetime import datetime
from typing import Final, Literal
from uuid import UUID

import msgspec
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.audit import entries
from kata.backups.folder import records_folder
from kata.backups.tables import BackupRow
from kata.database.engine import Database
from kata.pagination import Keyset
from kata.settings import Settings

log = logging.getLogger(__name__)

Kind = Literal["nightly", "asked"]
DEFAULT_PAGE: Final = 100
"""Backups on a page, which covers some months."""
_NEWEST_FIRST: Final = Keyset(tuple[datetime, UUID], BackupRow.at, BackupRow.id, descending=True)


class BackupRecord(msgspec.Struct, frozen=True, kw_only=True):
    """The result of one backup."""

    id: UUID
    at: datetime
    kind: Kind
    file: str
    bytes: int = 0
    problem: str = ""
    """Reason for which the backup failed; empty if it was created."""
    tested_at: datetime | None = None
    test_problem: str = ""
    """Reason for which the backup may not be restorable; empty if the restored copy was complete and equal."""
    audit_rows: int | None = None
    """Number of verified rows of the audit trail in the restored copy."""
    audit_problem: str = ""
    """Damage of that audit trail; empty if it is intact."""


def write_record(settings: Settings, record: BackupRecord) -> None:
    """Write a record. The service imports it at the latest after its next start."""
    folder = records_folder(settings)
    folder.mkdir(parents=True, exist_ok=True)
    part = folder / f"{record.id}.part"
    part.write_bytes(msgspec.json.encode(record))
    part.replace(folder / f"{record.id}.json")


def import_records(settings: Settings, database: Database) -> None:
    """Import the waiting records into the database, each exactly once. A newer record of a backup replaces an older one."""
    for file in sorted(records_folder(settings).glob("*.json")):
        try:
            record = msgspec.json.decode(file.read_bytes(), type=BackupRecord)
        except msgspec.MsgspecError as error:
            log.error("%s is not a valid backup record (%s); it is removed", file, error)
        else:
            with database.write() as session:
                row = session.merge(BackupRow(**msgspec.structs.asdict(record)))
                entries.add_entry(
                    session,
                    entries.entry(
                        f"backup_{record.kind}", "failed" if row.failure else "done", subject=f"backup {record.id}"
                    ),
                )
        file.unlink()


def newest(session: Session, limit: int, after: str | None = None) -> tuple[Sequence[BackupRow], str | None]:
    """Return a page of backups (newest first) and the next cursor.

    :raises ProblemError: 422 when ``after`` is not a valid cursor.
    """
    rows = session.scalars(_NEWEST_FIRST.page(select(BackupRow), after, limit)).all()
    return _NEWEST_FIRST.cut(rows, limit, lambda row: (row.at, row.id))


def last_made(session: Session) -> BackupRow | None:
    """Return the newest backup without a known problem, even if it is not verified."""
    sound = (BackupRow.problem == "", (BackupRow.test_problem == "") | BackupRow.tested_at.is_(None))
    return session.scalars(select(BackupRow).where(*sound).order_by(BackupRow.at.desc()).limit(1)).first()


def last_good(session: Session) -> BackupRow | None:
    """Return the newest backup whose trial restore succeeded."""
    good = (BackupRow.problem == "", BackupRow.test_problem == "", BackupRow.tested_at.is_not(None))
    return session.scalars(select(BackupRow).where(*good).order_by(BackupRow.at.desc()).limit(1)).first()
