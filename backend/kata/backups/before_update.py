"""The data before an update. They are saved while the service is stopped, and put back if the new version has changed the schema but does
not become ready.

This concerns only SQLite. Several stations may use one PostgreSQL database, and each version can use the schema of the next version, so
that database stays as it is.
"""

import os
import shutil
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from typing import Final
from uuid import uuid4

from kata.backups.folder import before_update_folder, claimed_by_restore
from kata.backups.key import BackupError
from kata.backups.restore import revoke_access
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.database.upgrade import copy_sqlite_file
from kata.settings import Settings
from kata.system.sync import sync_folder

_DATABASE: Final = "kata.db"
_SAVED_FOLDERS: Final = ("journal", "spool")
"""Parts of the data folder that a start imports into the database: journals, and records that wait for the database."""
_CHANGES_SINCE: Final = (
    "SELECT count(*) FROM audit WHERE number > ? AND account_id IS NOT NULL AND patient_id IS NOT NULL"
)


def save(settings: Settings) -> bool:
    """Copy database, journals and waiting records. Return False if the clinic does not use SQLite.

    :raises BackupError: when a service uses the data folder.
    :raises OSError: when the files cannot be copied.
    """
    database = _sqlite_file(settings)
    if database is None:
        return False
    with claimed_by_restore(settings):
        folder = before_update_folder(settings)
        shutil.rmtree(folder, ignore_errors=True)
        part = folder.with_name(folder.name + ".part")
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(mode=0o700)
        for name in _SAVED_FOLDERS:
            if (source := settings.data / name).is_dir():
                shutil.copytree(source, part / name, ignore=shutil.ignore_patterns("imported"))
        copy_sqlite_file(database, part / _DATABASE)
        os.sync()
        part.rename(folder)
        sync_folder(settings.data)
    return True


def put_back(settings: Settings) -> bool:
    """Put the saved data back if the schema has changed since. Return whether the data were put back.

    The database is replaced as a whole: after a power cut, it is the present one or the saved one. The present database stays in the folder
    of the saved data. All users have to sign in again.

    :raises BackupError: when users have worked with the new version, or a service uses the data folder. Nothing is changed.
    :raises OSError: when the files cannot be written.
    """
    database, folder = _sqlite_file(settings), before_update_folder(settings)
    saved = folder / _DATABASE
    if database is None or not saved.exists():
        return False
    with claimed_by_restore(settings):
        if _schema(database) == _schema(saved):
            return False
        if _used_since(database, saved):
            raise BackupError(
                f"Users have changed or seen records with the new version, so the database from before the update was not restored. It is stored in {saved}."
            )
        restored = folder / f"restored-{uuid4().hex[:8]}.db"
        copy_sqlite_file(saved, restored)
        copy = Database(f"sqlite:///{restored}")
        try:
            # The anchor of the audit trail contains the rows that are discarded here, so the trail must explain them.
            revoke_access(settings, copy, saved, folder, utc_now())
        finally:
            copy.close()
        for name in _SAVED_FOLDERS:
            _copy_missing(folder / name, settings.data / name)
        # Without these journal files, each of the two databases is complete in one file.
        for file in (restored, database):
            _without_journal_files(file)
        with suppress(FileExistsError):
            (folder / "replaced.db").hardlink_to(database)
        os.sync()
        restored.replace(database)
        sync_folder(database.parent)
    return True


def _sqlite_file(settings: Settings) -> Path | None:
    database = Database(settings.effective_database_url)
    database.close()
    return database.file


def _without_journal_files(file: Path) -> None:
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("PRAGMA journal_mode = DELETE")


def _schema(file: Path) -> str:
    with closing(sqlite3.connect(file)) as connection:
        return str(connection.execute("SELECT version_num FROM alembic_version").fetchone())


def _used_since(database: Path, saved: Path) -> bool:
    """Return whether, according to the audit trail, a patient's record was read or changed since the copy."""
    with closing(sqlite3.connect(saved)) as connection:
        (last,) = connection.execute("SELECT coalesce(max(number), 0) FROM audit").fetchone()
    with closing(sqlite3.connect(database)) as connection:
        (changes,) = connection.execute(_CHANGES_SINCE, (last,)).fetchone()
    return bool(changes)


def _copy_missing(source: Path, target: Path) -> None:
    """Copy the files that the target lacks. A file that is imported twice is stored once."""
    for path in sorted(file for file in source.rglob("*") if file.is_file()):
        copy = target / path.relative_to(source)
        if not copy.exists():
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, copy)
