"""Making a backup: copy, encrypt, try, and let old ones go.

It reads the database and writes none: where the service runs, that alone writes. What became of it is left as a note in
the data folder, which the service takes into the database (:mod:`kata.backups.book`).
"""

import shutil
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from importlib.metadata import version
from pathlib import Path
from typing import Final
from uuid import uuid4

import msgspec

from kata.audit import anchor
from kata.backups.book import Kind, Note, leave_note
from kata.backups.folder import one_at_a_time, others_files, work_folder
from kata.backups.key import BackupError, identities, make_key, recipients, whereabouts
from kata.backups.restoring import try_backup
from kata.backups.sealed import ANCHOR, DATA, DATABASE, FACTOR_KEY, SUFFIX, Contents, seal
from kata.database.base import utc_now
from kata.database.database_copy import copy, kind_of, size_bytes
from kata.database.engine import Database, DatabaseError
from kata.settings import Settings

NOT_TRIED: Final = (
    "The key is not on this computer, so it could not be tried. Where the key is: kata restore FILE --verify --key KEY."
)
_DAYS: Final = 14
_MONTHS: Final = 12
_DAYS_OF_MONTH: Final = 31
_NAMED: Final = "kata-%Y%m%dT%H%M%SZ"
_COPIES: Final = 2
"""Times the database: a copy of it and the backup; then the backup and what comes out of it."""


def make(settings: Settings, kind: Kind) -> Note:
    """Make a backup now, and try it: what became of it. A minute for some gigabytes; call it from a process of its own.

    :raises BackupError: when it cannot be made. That is noted, too.
    """
    at = utc_now()
    identity = uuid4()
    file = settings.backup_folder / f"{at.strftime(_NAMED)}-{identity.hex[:8]}{SUFFIX}"
    note = Note(id=identity, at=at, kind=kind, file=str(file))
    try:
        with one_at_a_time(settings):
            note = _made(settings, note)
    except (BackupError, DatabaseError, OSError) as error:
        told = f"{error.strerror}: {error.filename}" if isinstance(error, OSError) else str(error)
        with suppress(OSError):
            leave_note(settings, msgspec.structs.replace(note, problem=told))
        raise BackupError(f"No backup was made: {told}.") from error
    leave_note(settings, note)
    if note.tested_at is None or not note.test_problem:
        for old in let_go(settings.backup_folder, at):
            old.unlink(missing_ok=True)
    return note


def let_go(folder: Path, now: datetime) -> list[Path]:
    """Which files need not be kept any longer: those of a fortnight stay, and of a year the first of each month."""
    months: set[tuple[int, int]] = set()
    old: list[Path] = []
    for at, file in sorted(_there(folder)):
        month = (at.year, at.month)
        first, months = month not in months, months | {month}
        days = timedelta(days=_DAYS_OF_MONTH * _MONTHS if first else _DAYS)
        if at < now - days:
            old.append(file)
    return old


def _there(folder: Path) -> list[tuple[datetime, Path]]:
    found: list[tuple[datetime, Path]] = []
    for file in folder.glob(f"*{SUFFIX}"):
        with suppress(ValueError):
            at = datetime.strptime(file.name[: -len(SUFFIX)].rpartition("-")[0], _NAMED).replace(tzinfo=UTC)
            found.append((at, file))
    return found


def _made(settings: Settings, note: Note) -> Note:
    file = Path(note.file)
    make_key(settings)
    settings.backup_folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    database = Database(settings.effective_database_url)
    try:
        _look_for_room(settings, database)
        size = _written(settings, database, note)
        note = msgspec.structs.replace(note, bytes=size)
        if whereabouts(settings) != "here":
            return msgspec.structs.replace(note, test_problem=NOT_TRIED)
        try:
            return try_backup(settings, database, file, identities(settings.backup_key_file)).noted(note)
        except (BackupError, DatabaseError, OSError) as error:
            return msgspec.structs.replace(note, tested_at=utc_now(), test_problem=str(error))
    finally:
        database.close()


def _written(settings: Settings, database: Database, note: Note) -> int:
    with work_folder(settings) as folder:
        (folder / DATA).mkdir()
        # A journal goes first: one that is imported meanwhile is in the database then, and one that is found in both is imported once.
        journals = settings.journal.relative_to(settings.data)
        _take(
            settings,
            [path for path in others_files(settings, database.file) if path.is_relative_to(journals)],
            folder / DATA,
        )
        anchored = _anchored(settings.effective_audit_anchor)
        schema, tables = copy(database, folder / DATABASE)
        # The anchor goes after it: it has to know every row that the database has.
        with suppress(FileNotFoundError):
            shutil.copy(settings.effective_audit_anchor, folder / DATA / ANCHOR)
        # Likewise: a secret may have been sealed with it just now.
        with suppress(FileNotFoundError):
            shutil.copy(settings.effective_second_factor_key, folder / DATA / FACTOR_KEY)
        _take(
            settings,
            [path for path in others_files(settings, database.file) if not path.is_relative_to(journals)],
            folder / DATA,
        )
        contents = Contents(
            id=note.id,
            kind=note.kind,
            made_at=note.at,
            program=version("kata"),
            bytes=sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()),
            database=kind_of(database),
            schema=schema,
            tables=tables,
            anchored=anchored,
        )
        return seal(Path(note.file), recipients(settings), contents, folder)


def _anchored(file: Path) -> int:
    try:
        return max((line.line for line in anchor.read(file)), default=0)
    except FileNotFoundError:
        return 0


def _take(settings: Settings, paths: list[Path], folder: Path) -> None:
    for path in paths:
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        # Imported meanwhile, or made anew.
        with suppress(FileNotFoundError):
            shutil.copy(settings.data / path, target)


def _look_for_room(settings: Settings, database: Database) -> None:
    if database.file and not database.file.exists():
        raise DatabaseError(f"there is no database {database.file} yet; the first start of the service makes it")
    size = size_bytes(database)
    for folder in {settings.data, settings.backup_folder}:
        free = shutil.disk_usage(folder).free
        if free < _COPIES * size:
            raise BackupError(
                f"a backup takes up to {_COPIES * size / 1e6:.0f} MB on the disk of {folder}, and {free / 1e6:.0f} MB are free; make room there"
            )
