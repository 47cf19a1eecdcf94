"""Trying a backup, and bringing the clinic back from one.

Trying restores it where it harms nobody and compares what is then there with what was counted when it was made. A restore does
the same first, and only then puts it in place; what was there is put aside, never written over. Nobody stays signed in over it:
what has ended since the backup would be open again.
"""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Final

import msgspec
from alembic.script import ScriptDirectory
from pyrage.x25519 import Identity
from sqlalchemy import update

from kata.audit.audit_log import AuditHook
from kata.audit.restored import note_restored
from kata.audit.tables import AuditRow
from kata.audit.verify import verify
from kata.auth.factor_key import adopt
from kata.auth.tables import AccountRow, SignInRow
from kata.backups.book import Note, leave_note
from kata.backups.folder import (
    aside_folder,
    one_at_a_time,
    others_files,
    restoring_marker,
    without_service,
    work_folder,
)
from kata.backups.key import BackupError, adopt_key, identities
from kata.backups.sealed import ANCHOR, DATA, DATABASE, FACTOR_KEY, Contents, sync_folder, unseal
from kata.database.base import utc_now
from kata.database.database_copy import DatabaseKind, found_damaged, kind_of, replaced, schema_aside, scratch
from kata.database.engine import Database
from kata.database.table_checksums import differences, tallies
from kata.database.upgrade import migrations, upgrade
from kata.settings import Settings

_NAMES: Final[Mapping[DatabaseKind, str]] = MappingProxyType({"sqlite": "SQLite", "postgresql": "PostgreSQL"})
_COPIES: Final = 2
"""Times what is in it: that itself, and what an upgrade keeps of it."""


@dataclass(frozen=True)
class Tried:
    """A backup that could be opened."""

    contents: Contents
    problems: list[str]
    """Where what came back is not equal to what was backed up; empty where it is."""
    audit_rows: int | None = None
    """Of the audit trail, verified in what came back; None where there is none yet, or what came back is not equal."""
    audit_problem: str = ""
    """Where that trail is not whole; empty where it is. The backup is what was backed up all the same."""

    def noted(self, note: Note) -> Note:
        """With what came of it."""
        return msgspec.structs.replace(
            note,
            tested_at=utc_now(),
            test_problem="; ".join(self.problems),
            audit_rows=self.audit_rows,
            audit_problem=self.audit_problem,
        )


@dataclass(frozen=True)
class Restored:
    """The clinic is as it was at a backup."""

    contents: Contents
    aside: str
    """Where that is which was there before; ``nothing`` where nothing was."""


def try_backup(settings: Settings, database: Database, file: Path, keys: list[Identity]) -> Tried:
    """Restore it into a scratch database and compare.

    :raises BackupError: when it cannot be opened.
    :raises DatabaseError: when there is no scratch database to be had, or the copy cannot be put back.
    """
    with work_folder(settings) as folder:
        contents = unseal(file, keys, folder, _check(settings, database))
        with scratch(database, folder / DATABASE) as made:
            if problems := _problems(made, contents):
                return Tried(contents, problems)
            return _audited(made, contents, folder / DATA / ANCHOR)


def try_and_note(settings: Settings, file: Path, key: Path) -> Tried:
    """As above, for somebody who asks; where the clinic is, its administrator is shown the outcome.

    :raises BackupError: as above, or when another backup is being made.
    :raises DatabaseError: as above.
    """
    keys = identities(key)
    database = Database(settings.effective_database_url)
    try:
        with one_at_a_time(settings):
            tried = try_backup(settings, database, file, keys)
    finally:
        database.close()
    if database.file is None or database.file.exists():
        told = tried.contents
        leave_note(
            settings,
            tried.noted(
                Note(
                    id=told.id,
                    at=told.made_at,
                    kind=told.kind,
                    file=str(file.absolute()),
                    bytes=file.stat().st_size,
                )
            ),
        )
    return tried


def restore(settings: Settings, file: Path, key: Path) -> Restored:
    """Put the clinic back as it was at the backup.

    :raises BackupError: when it cannot be opened, is not equal to what was backed up, is of a newer version or another
        kind of database, or when the service runs. Then everything is as it was.
    :raises DatabaseError: when the database refuses. Likewise.
    :raises OSError: when the disk does; what is in the way of a next try is told by that.
    """
    keys = identities(key)
    now = utc_now()
    # With a part of the second: whoever tries again at once has a place of its own.
    aside = aside_folder(settings, f"{now:%Y%m%d-%H%M%S-%f}")
    with without_service(settings), one_at_a_time(settings), work_folder(settings) as folder:
        database = Database(settings.effective_database_url)
        try:
            contents = unseal(file, keys, folder, _check(settings, database))
            there = others_files(settings, database.file)
            marker = restoring_marker(settings)
            marker.touch()
            try:
                with replaced(database, folder / DATABASE, aside) as made:
                    if problems := _problems(made, contents):
                        raise BackupError(f"{file} does not come back as it was backed up: {'; '.join(problems)}")
                    upgrade(made)
                    _settle(settings, made, file, folder, now)
            except BaseException:
                # All of it is as it was.
                marker.unlink()
                raise
            _exchange(settings, there, folder / DATA, aside)
            adopt_key(settings, key)
            marker.unlink()
            kept = [str(aside)] if aside.exists() else []
            if schema := schema_aside(database, aside):
                kept.append(f"the schema {schema} of the database")
        finally:
            database.close()
    return Restored(contents, " and ".join(kept) or "nothing")


def _check(settings: Settings, database: Database) -> Callable[[Contents], None]:
    """Whether what a file says of itself can be had here."""

    def check(contents: Contents) -> None:
        here = kind_of(database)
        if contents.database != here:
            step = (
                "leave KATA_DATABASE_URL empty"
                if contents.database == "sqlite"
                else "name an empty one in KATA_DATABASE_URL"
            )
            raise BackupError(
                f"this is a backup of a database of {_NAMES[contents.database]}, not {_NAMES[here]}: {step}"
            )
        known = {revision.revision for revision in ScriptDirectory(str(migrations())).walk_revisions()}
        if contents.schema and contents.schema not in known:
            raise BackupError(
                f"this backup was made by a newer version of Kata ({contents.program}, tables of {contents.schema}); this is "
                f"{version('kata')}. Install that version, then restore"
            )
        free, wanted = shutil.disk_usage(settings.data).free, _COPIES * contents.bytes
        if free < wanted:
            raise BackupError(
                f"there is no room to unpack it: {wanted / 1e6:.0f} MB on the disk of {settings.data}, and {free / 1e6:.0f} MB are free"
            )

    return check


def _problems(made: Database, contents: Contents) -> list[str]:
    with made.writer.connect() as connection:
        return found_damaged(connection) or differences(contents.tables, tallies(connection))


def _audited(made: Database, contents: Contents, anchor: Path) -> Tried:
    """The audit trail in it, verified as ``kata audit verify`` does it: damage is found while there are backups from before it."""
    if AuditRow.__tablename__ not in contents.tables:
        return Tried(contents, [])
    with made.read() as session:
        verdict = verify(session, [anchor], of_backup=contents.anchored)
    return Tried(contents, [], verdict.rows, "" if verdict.whole else verdict.findings[0].message)


def _settle(settings: Settings, made: Database, file: Path, folder: Path, now: datetime) -> None:
    """What somebody could come in with that has been ended or used up since the backup lets nobody in; the trail says what it was."""
    here = settings.effective_audit_anchor
    AuditHook(made)
    with made.write() as session:
        note_restored(session, here if here.exists() else folder / DATA / ANCHOR, file.name)
        session.execute(
            update(SignInRow).where(SignInRow.ended_at.is_(None)).values(ended_at=now, end_reason="restored")
        )
        session.execute(
            update(AccountRow).where(AccountRow.code_hash.is_not(None)).values(code_hash=None, code_until=None)
        )


def _exchange(settings: Settings, there: list[Path], restored: Path, aside: Path) -> None:
    """What else belongs to the clinic: what is there aside, what was backed up in its place. An anchor that is there goes on,
    and so does a key of second factors.
    """
    data, anchor, key = settings.data, restored / ANCHOR, restored / FACTOR_KEY
    if anchor.exists():
        if not settings.effective_audit_anchor.exists():
            settings.effective_audit_anchor.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(anchor, settings.effective_audit_anchor)
        anchor.unlink()
    if key.exists():
        adopt(settings.effective_second_factor_key, key)
        key.unlink()
    for path in there:
        (aside / path).parent.mkdir(parents=True, exist_ok=True)
        (data / path).replace(aside / path)
    for path in sorted(one for one in restored.rglob("*") if one.is_file()):
        target = data / path.relative_to(restored)
        target.parent.mkdir(parents=True, exist_ok=True)
        path.replace(target)
    sync_folder(data)
