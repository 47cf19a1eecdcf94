"""Making a backup: copy, encrypt, try, and let old ones go.

It reads the database and writes none: where the service runs, that alone writes. What became of it is left as a note in
the data folder, which the service takes into the database (:mod:`kata.access.backups.book`).
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime, timedelta
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final
from uuid import UUID, uuid4

from kata.access.backups import sealed
from kata.access.backups.book import Kind, Note, leave_note, notes_folder
from kata.access.backups.key import BackupError, identities, make_key, recipients, whereabouts
from kata.access.backups.restoring import restored_aside
from kata.access.backups.sealed import DATA, DATABASE, SUFFIX, Contents, seal
from kata.database.base import utc_now
from kata.database.copies import copy, kind_of, size_bytes
from kata.database.engine import Database, DatabaseError
from kata.device import journal
from kata.settings import Settings

_DAYS: Final = 14
_MONTHS: Final = 12
_NOT_TRIED: Final = "The key is not on this computer; kata restore FILE --try --key KEY tries it where the key is."
_NAMED: Final = "%Y%m%dT%H%M%SZ"


def make(settings: Settings, kind: Kind) -> Note:
    """Make a backup now, and try it: what became of it. A minute for some gigabytes; call it from a process of its own.

    :raises BackupError: when it cannot be made. That is noted, too.
    """
    identity, at = uuid4(), utc_now()
    file = settings.backups / f"kata-{at.strftime(_NAMED)}-{identity.hex[:8]}{SUFFIX}"
    note = Note(id=identity, at=at, kind=kind, file=str(file))
    try:
        with _alone(settings):
            note = _make(settings, note)
    except (BackupError, DatabaseError, OSError) as error:
        told = f"{error.strerror}: {error.filename}" if isinstance(error, OSError) else str(error)
        leave_note(settings, Note(id=identity, at=at, kind=kind, file=str(file), problem=told))
        raise BackupError(f"no backup was made: {told}") from error
    leave_note(settings, note)
    if note.tested_at and not note.test_problem:
        for old in let_go(settings.backups, at):
            old.unlink(missing_ok=True)
    return note


def let_go(folder: Path, now: datetime) -> list[Path]:
    """Which files no longer need to be kept: those of a fortnight stay, and of a year the first of each month."""
    months: set[tuple[int, int]] = set()
    old: list[Path] = []
    for at, file in sorted(_named(folder)):
        month = (at.year, at.month)
        if at < now - timedelta(days=_DAYS) and (month in months or at < now - timedelta(days=31 * _MONTHS)):
            old.append(file)
        months.add(month)
    return old


def others_files(settings: Settings, database: Database) -> list[Path]:
    """Files of the data folder that belong to the clinic besides its database, relative to it: journals that no row holds yet, the
    audit trail's anchor, how the station stands, certificates. Not: what is copied elsewhere, and what opens backups.
    """
    left_out = {settings.backups, notes_folder(settings), settings.backup_key, settings.journal / "imported"}
    if database.file:
        left_out |= {database.file.with_name(database.file.name + ending) for ending in ("", "-wal", "-shm", "-journal")}
    prefix = f"{database.file.name}.version-" if database.file else None
    found: list[Path] = []

    def walk(folder: Path) -> None:
        for path in sorted(folder.iterdir()):
            if path in left_out or path.name.startswith(_OURS) or path.suffix == ".part" or path.is_symlink():
                continue
            if path.is_dir():
                walk(path)
            elif path.is_file() and not (prefix and path.name.startswith(prefix)):
                found.append(path.relative_to(settings.data))

    walk(settings.data)
    return found
