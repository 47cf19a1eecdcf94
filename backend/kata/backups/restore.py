"""Verify a backup by a trial restore, and restore the clinic from one.

A trial restore fills a scratch database and compares its tables with the checksums in the backup. A restore verifies the backup in the same
way before it replaces the data. It moves the previous data aside and never overwrites them. It ends all login sessions, because the backup
contains sessions that have ended since.
"""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Final

import msgspec
from pyrage.x25519 import Identity
from sqlalchemy import update

from kata import __version__
from kata.audit.audit_log import AuditHook
from kata.audit.restored import note_restored
from kata.audit.tables import AuditRow
from kata.audit.verify import verify
from kata.auth.factor_key import add_keys
from kata.auth.tables import AccessTokenRow, AccountRow, LoginSessionRow
from kata.backups.archive import ANCHOR, DATA, DATABASE, FACTOR_KEY, Contents, read_archive
from kata.backups.catalogue import BackupRecord, write_record
from kata.backups.folder import (
    aside_folder,
    claimed_by_restore,
    files_besides_database,
    one_at_a_time,
    restoring_marker,
    work_folder,
)
from kata.backups.key import BackupError, adopt_key, identities
from kata.database.base import utc_now
from kata.database.database_copy import DatabaseKind, found_damaged, kind_of, replaced, schema_aside, scratch
from kata.database.engine import Database
from kata.database.table_checksums import checksums, differences
from kata.database.upgrade import migrations, upgrade
from kata.settings import Settings
from kata.system.sync import sync_folder

_DATABASE_NAMES: Final[Mapping[DatabaseKind, str]] = MappingProxyType({"sqlite": "SQLite", "postgresql": "PostgreSQL"})
_DISK_SPACE_FACTOR: Final = 2
"""Required disk space as a multiple of the backup's contents: the contents, and the copy that a database upgrade keeps."""


@dataclass(frozen=True)
class VerifiedBackup:
    """The result of a trial restore."""

    contents: Contents
    problems: list[str]
    """Differences between the restored copy and the backed-up database; empty if they are equal."""
    audit_rows: int | None = None
    """Number of verified rows of the audit trail; None if the backup has no trail or the restored copy is different."""
    audit_problem: str = ""
    """Damage of that audit trail; empty if it is intact. A backup with a damaged trail can still be used."""

    def recorded(self, record: BackupRecord) -> BackupRecord:
        """Return the record with this result."""
        return msgspec.structs.replace(
            record,
            tested_at=utc_now(),
            test_problem="; ".join(self.problems),
            audit_rows=self.audit_rows,
            audit_problem=self.audit_problem,
        )


@dataclass(frozen=True)
class RestoreResult:
    """The result of a restore."""

    contents: Contents
    aside: str
    """Location of the previous data; ``nothing`` if there were none."""


def verify_backup(settings: Settings, database: Database, file: Path, keys: list[Identity]) -> VerifiedBackup:
    """Restore a backup into a scratch database, compare the tables, and verify the audit trail.

    :raises BackupError: when the backup cannot be opened.
    :raises DatabaseError: when no scratch database can be created, or the copy cannot be restored.
    """
    with work_folder(settings) as folder:
        contents = read_archive(file, keys, folder, _contents_check(settings, database))
        with scratch(database, folder / DATABASE) as copy:
            if problems := _find_problems(copy, contents):
                return VerifiedBackup(contents, problems)
            return _with_audit_result(copy, contents, folder / DATA / ANCHOR)


def verify_and_record(settings: Settings, file: Path, key: Path) -> VerifiedBackup:
    """Verify a backup like :func:`verify_backup`. On a computer with a clinic, also write a record for its administrator.

    :raises BackupError: as :func:`verify_backup`, or when another backup is being made.
    :raises DatabaseError: as for :func:`verify_backup`.
    """
    keys = identities(key)
    database = Database(settings.effective_database_url)
    try:
        with one_at_a_time(settings):
            verified = verify_backup(settings, database, file, keys)
    finally:
        database.close()
    if database.file is None or database.file.exists():
        contents = verified.contents
        write_record(
            settings,
            verified.recorded(
                BackupRecord(
                    id=contents.id,
                    at=contents.made_at,
                    kind=contents.kind,
                    file=str(file.absolute()),
                    bytes=file.stat().st_size,
                )
            ),
        )
    return verified


def restore_backup(settings: Settings, file: Path, key: Path) -> RestoreResult:
    """Restore the clinic to its state at the backup.

    :raises BackupError: when the backup cannot be opened, the restored copy differs, the backup is from a newer version or of another kind
        of database, or a service runs. Nothing is changed.
    :raises DatabaseError: when the database cannot be replaced. Nothing is changed.
    :raises OSError: when files cannot be written. The restore can be repeated.
    """
    keys = identities(key)
    now = utc_now()
    # The name contains microseconds, so that an immediate second attempt gets another folder.
    aside = aside_folder(settings, f"{now:%Y%m%d-%H%M%S-%f}")
    with claimed_by_restore(settings), one_at_a_time(settings), work_folder(settings) as folder:
        database = Database(settings.effective_database_url)
        try:
            contents = read_archive(file, keys, folder, _contents_check(settings, database))
            previous_files = files_besides_database(settings, database.file)
            marker = restoring_marker(settings)
            marker.touch()
            try:
                with replaced(database, folder / DATABASE, aside) as copy:
                    if problems := _find_problems(copy, contents):
                        raise BackupError(f"{file} differs from the backed-up database: {'; '.join(problems)}")
                    upgrade(copy)
                    revoke_access(settings, copy, file, folder, now)
            except BaseException:
                # Nothing has been changed yet.
                marker.unlink()
                raise
            _replace_files(settings, previous_files, folder / DATA, aside)
            adopt_key(settings, key)
            marker.unlink()
            locations = [str(aside)] if aside.exists() else []
            if schema := schema_aside(database, aside):
                locations.append(f"the schema {schema} of the database")
        finally:
            database.close()
    return RestoreResult(contents, " and ".join(locations) or "nothing")


def _contents_check(settings: Settings, database: Database) -> Callable[[Contents], None]:
    """Return a function that raises BackupError if a backup with these contents cannot be restored here."""

    def check(contents: Contents) -> None:
        own_database = kind_of(database)
        if contents.database != own_database:
            step = (
                "leave KATA_DATABASE_URL empty"
                if contents.database == "sqlite"
                else "set KATA_DATABASE_URL to an empty PostgreSQL database"
            )
            raise BackupError(
                f"this is a backup of a {_DATABASE_NAMES[contents.database]} database, but this computer uses {_DATABASE_NAMES[own_database]}: {step}"
            )
        # Imported here, because the service imports this module and would start later.
        from alembic.script import ScriptDirectory

        known_revisions = {revision.revision for revision in ScriptDirectory(str(migrations())).walk_revisions()}
        if contents.schema and contents.schema not in known_revisions:
            raise BackupError(
                f"this backup was made by a newer version of Kata ({contents.program}, schema {contents.schema}); the version "
                f"here is {__version__}. Install the newer version, then restore"
            )
        free, needed = shutil.disk_usage(settings.data).free, _DISK_SPACE_FACTOR * contents.bytes
        if free < needed:
            raise BackupError(
                f"unpacking needs {needed / 1e6:.0f} MB on the disk of {settings.data}, and {free / 1e6:.0f} MB are free"
            )

    return check


def _find_problems(copy: Database, contents: Contents) -> list[str]:
    with copy.writer.connect() as connection:
        return found_damaged(connection) or differences(contents.tables, checksums(connection))


def _with_audit_result(copy: Database, contents: Contents, anchor: Path) -> VerifiedBackup:
    """Verify the audit trail like ``kata audit verify``. This finds damage while older backups without damage still exist."""
    if AuditRow.__tablename__ not in contents.tables:
        return VerifiedBackup(contents, [])
    with copy.read() as session:
        verdict = verify(session, [anchor], of_backup=contents.anchored)
    return VerifiedBackup(contents, [], verdict.rows, "" if verdict.intact else verdict.findings[0].message)


def revoke_access(settings: Settings, copy: Database, file: Path, folder: Path, now: datetime) -> None:
    """End all login sessions and invalidate all access tokens and one-time codes, because they may have been revoked since the backup.
    Record the restore in the audit trail.
    """
    AuditHook(copy)
    with copy.write() as session:
        note_restored(session, _newest_anchor(settings, folder / DATA / ANCHOR), file.name)
        session.execute(
            update(LoginSessionRow)
            .where(LoginSessionRow.ended_at.is_(None))
            .values(ended_at=now, end_reason="restored")
        )
        session.execute(update(AccessTokenRow).where(AccessTokenRow.revoked_at.is_(None)).values(revoked_at=now))
        session.execute(
            update(AccountRow).where(AccountRow.code_hash.is_not(None)).values(code_hash=None, code_until=None)
        )


def _newest_anchor(settings: Settings, restored: Path) -> Path:
    """Return this computer's anchor. On another computer, return the anchor's copy elsewhere or, if there is none, the backup's anchor."""
    for file in (settings.effective_audit_anchor, settings.audit_anchor_copy):
        if file and file.exists():
            return file
    return restored


def _replace_files(settings: Settings, previous: list[Path], restored: Path, aside: Path) -> None:
    """Move the previous files aside and the restored ones into the data folder. An existing audit anchor stays, and an existing key of the
    second factors gets the backup's keys in addition.
    """
    data, anchor, key = settings.data, restored / ANCHOR, restored / FACTOR_KEY
    if anchor.exists():
        if not settings.effective_audit_anchor.exists():
            settings.effective_audit_anchor.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(_newest_anchor(settings, anchor), settings.effective_audit_anchor)
        anchor.unlink()
    if key.exists():
        add_keys(settings.effective_second_factor_key, key)
        key.unlink()
    for path in previous:
        (aside / path).parent.mkdir(parents=True, exist_ok=True)
        (data / path).replace(aside / path)
    for path in sorted(file for file in restored.rglob("*") if file.is_file()):
        target = data / path.relative_to(restored)
        target.parent.mkdir(parents=True, exist_ok=True)
        path.replace(target)
    sync_folder(data)
