"""Create a backup: copy the data, encrypt it, verify it by a trial restore, and delete expired backups.

The command only reads the database, because the running service is the only writer. The result is a record in the data folder, which the
service imports (:mod:`kata.backups.catalogue`).
"""

import shutil
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final
from uuid import uuid4

import msgspec

from kata import __version__
from kata.audit import anchor
from kata.backups.archive import ANCHOR, DATA, DATABASE, FACTOR_KEY, SUFFIX, Contents, write_archive
from kata.backups.catalogue import BackupRecord, Kind, write_record
from kata.backups.folder import files_besides_database, one_at_a_time, work_folder
from kata.backups.key import BackupError, identities, key_location, make_key, recipients
from kata.backups.restore import verify_backup
from kata.database.base import utc_now
from kata.database.database_copy import copy, kind_of, size_bytes
from kata.database.engine import Database, DatabaseError
from kata.settings import Settings

NOT_VERIFIED: Final = "The key is not on this computer, so the backup was not verified. On the computer with the key, run: kata restore FILE --verify --key KEY."
KEEP_ALL_BACKUPS_DAYS: Final = 14
"""Days for which all backups are kept."""
KEEP_MONTHLY_BACKUP_MONTHS: Final = 12
"""The first backup of each month is kept for this many months. A month counts 31 days."""
_LONGEST_MONTH_DAYS: Final = 31
_FILE_NAME_FORMAT: Final = "kata-%Y%m%dT%H%M%SZ"
_DISK_SPACE_FACTOR: Final = 2
"""Required disk space as a multiple of the database size: first a copy and the backup, then the backup and the restored copy."""


def create_backup(settings: Settings, kind: Kind) -> BackupRecord:
    """Create and verify a backup, and return its record. Some gigabytes take a minute, so call it in a separate process.

    :raises BackupError: when the backup cannot be made. The record also contains the reason.
    """
    at = utc_now()
    identity = uuid4()
    file = settings.backup_folder / f"{at.strftime(_FILE_NAME_FORMAT)}-{identity.hex[:8]}{SUFFIX}"
    record = BackupRecord(id=identity, at=at, kind=kind, file=str(file))
    try:
        with one_at_a_time(settings):
            record = _create_and_verify(settings, record)
    except (BackupError, DatabaseError, OSError) as error:
        reason = f"{error.strerror}: {error.filename}" if isinstance(error, OSError) else str(error)
        with suppress(OSError):
            write_record(settings, msgspec.structs.replace(record, problem=reason))
        raise BackupError(f"No backup was made: {reason}.") from error
    write_record(settings, record)
    if record.tested_at is None or not record.test_problem:
        for expired in expired_backups(settings.backup_folder, at):
            expired.unlink(missing_ok=True)
    return record


def expired_backups(folder: Path, now: datetime) -> list[Path]:
    """Return the backups to delete.

    All backups of the last :data:`KEEP_ALL_BACKUPS_DAYS` days are kept, and the first of each month for
    :data:`KEEP_MONTHLY_BACKUP_MONTHS` months.
    """
    months: set[tuple[int, int]] = set()
    expired: list[Path] = []
    for at, file in sorted(_list_backups(folder)):
        month = (at.year, at.month)
        first, months = month not in months, months | {month}
        days = timedelta(days=_LONGEST_MONTH_DAYS * KEEP_MONTHLY_BACKUP_MONTHS if first else KEEP_ALL_BACKUPS_DAYS)
        if at < now - days:
            expired.append(file)
    return expired


def _list_backups(folder: Path) -> list[tuple[datetime, Path]]:
    backups: list[tuple[datetime, Path]] = []
    for file in folder.glob(f"*{SUFFIX}"):
        with suppress(ValueError):
            at = datetime.strptime(file.name[: -len(SUFFIX)].rpartition("-")[0], _FILE_NAME_FORMAT).replace(tzinfo=UTC)
            backups.append((at, file))
    return backups


def _create_and_verify(settings: Settings, record: BackupRecord) -> BackupRecord:
    file = Path(record.file)
    make_key(settings)
    settings.backup_folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    database = Database(settings.effective_database_url)
    try:
        _check_disk_space(settings, database)
        record = msgspec.structs.replace(record, bytes=_write_file(settings, database, record))
        if key_location(settings) != "here":
            return msgspec.structs.replace(record, test_problem=NOT_VERIFIED)
        try:
            return verify_backup(settings, database, file, identities(settings.backup_key_file)).recorded(record)
        except (BackupError, DatabaseError, OSError) as error:
            return msgspec.structs.replace(record, tested_at=utc_now(), test_problem=str(error))
    finally:
        database.close()


def _write_file(settings: Settings, database: Database, record: BackupRecord) -> int:
    with work_folder(settings) as folder:
        (folder / DATA).mkdir()
        # Journals first. A journal that is imported during the backup is then in the database copy. A journal in both places is imported
        # only once.
        journals = settings.journal.relative_to(settings.data)
        _copy_files(
            settings,
            [path for path in files_besides_database(settings, database.file) if path.is_relative_to(journals)],
            folder / DATA,
        )
        anchored = _count_anchor_lines(settings.effective_audit_anchor)
        schema, tables = copy(database, folder / DATABASE)
        # After the database, because the anchor must cover every row of the copy.
        with suppress(FileNotFoundError):
            shutil.copy(settings.effective_audit_anchor, folder / DATA / ANCHOR)
        # After the database, because a row of the copy may be encrypted with a new key.
        with suppress(FileNotFoundError):
            shutil.copy(settings.effective_second_factor_key, folder / DATA / FACTOR_KEY)
        _copy_files(
            settings,
            [path for path in files_besides_database(settings, database.file) if not path.is_relative_to(journals)],
            folder / DATA,
        )
        contents = Contents(
            id=record.id,
            kind=record.kind,
            made_at=record.at,
            program=__version__,
            bytes=sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()),
            database=kind_of(database),
            schema=schema,
            tables=tables,
            anchored=anchored,
        )
        return write_archive(Path(record.file), recipients(settings), contents, folder)


def _count_anchor_lines(file: Path) -> int:
    try:
        return max((line.line for line in anchor.read(file)), default=0)
    except FileNotFoundError:
        return 0


def _copy_files(settings: Settings, paths: list[Path], folder: Path) -> None:
    for path in paths:
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        # The service may have imported or replaced the file in the meantime.
        with suppress(FileNotFoundError):
            shutil.copy(settings.data / path, target)


def _check_disk_space(settings: Settings, database: Database) -> None:
    if database.file and not database.file.exists():
        raise DatabaseError(f"there is no database {database.file} yet; the first start of the service creates it")
    size = size_bytes(database)
    for folder in {settings.data, settings.backup_folder}:
        free = shutil.disk_usage(folder).free
        if free < _DISK_SPACE_FACTOR * size:
            raise BackupError(
                f"a backup needs up to {_DISK_SPACE_FACTOR * size / 1e6:.0f} MB on the disk of {folder}, and {free / 1e6:.0f} MB are free; free up space there"
            )
