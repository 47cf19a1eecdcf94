"""The clinic's files in the data folder, and the locks on this folder that backups and restores need."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from kata.backups.key import BackupError, public_key_file
from kata.device import journal
from kata.settings import Settings

_WORK_PREFIX: Final = ".backup-"
_ASIDE_PREFIX: Final = "before-restore-"
_BEFORE_UPDATE: Final = "before-update"
_RESTORE_MARKER: Final = "restoring"
_RECORDS: Final = "backup-notes"
_PREVIOUS_SERVICE_LIMIT_S: Final = 2.0
_DATABASE_SUFFIXES: Final = ("", "-wal", "-shm", "-journal")


class UnfinishedRestoreError(Exception):
    """A restore was interrupted while it replaced the data. The message says what to do."""


@contextmanager
def claimed_by_service(settings: Settings) -> Iterator[None]:
    """Claim the data folder for a service. While the context lasts, no other service starts on the folder and no restore begins.

    :raises FolderInUseError: when another service or a restore uses the folder.
    :raises UnfinishedRestoreError: when a restore into the folder was interrupted.
    """
    settings.data.mkdir(parents=True, exist_ok=True)
    with journal.claimed(settings.data, _PREVIOUS_SERVICE_LIMIT_S):
        if (marker := restoring_marker(settings)).exists():
            raise UnfinishedRestoreError(
                f"A restore into {settings.data} was interrupted. Run it again: kata restore FILE. The previous data is in a "
                f"folder {_ASIDE_PREFIX}... beside it. To start with the present data, delete {marker}."
            )
        yield


@contextmanager
def claimed_by_restore(settings: Settings) -> Iterator[None]:
    """Claim the data folder for a restore.

    :raises BackupError: when a service uses the folder.
    """
    settings.data.mkdir(parents=True, exist_ok=True)
    try:
        with journal.claimed(settings.data, 0.0):
            yield
    except journal.FolderInUseError as error:
        raise BackupError(
            f"Kata is running on {settings.data}. Stop it (sudo systemctl stop kata, or Ctrl-C where it runs), then restore "
            "again. To verify a backup while Kata runs: kata restore FILE --verify"
        ) from error


def restoring_marker(settings: Settings) -> Path:
    """Return the file that exists while a restore replaces the data. A service does not start while it exists."""
    return settings.data / _RESTORE_MARKER


@contextmanager
def one_at_a_time(settings: Settings) -> Iterator[None]:
    """Allow only one backup, trial restore or restore at a time.

    :raises BackupError: when another one is running.
    """
    records_folder(settings).mkdir(parents=True, exist_ok=True)
    try:
        with journal.claimed(records_folder(settings), 0.0):
            for leftover in settings.data.glob(f"{_WORK_PREFIX}*"):
                # A backup that was killed left this folder. Its content is not encrypted.
                shutil.rmtree(leftover)
            yield
    except journal.FolderInUseError as error:
        raise BackupError("another backup is being made or verified; try again when it has finished") from error


@contextmanager
def work_folder(settings: Settings) -> Iterator[Path]:
    """Create a temporary folder for unencrypted data in the data folder. Only this user can read it."""
    with TemporaryDirectory(prefix=_WORK_PREFIX, dir=settings.data) as temporary:
        yield Path(temporary)


def records_folder(settings: Settings) -> Path:
    """Return the folder of records that the service has not imported yet."""
    return settings.data / _RECORDS


def aside_folder(settings: Settings, name: str) -> Path:
    """Return the folder into which a restore moves the previous data."""
    return settings.data / f"{_ASIDE_PREFIX}{name}"


def before_update_folder(settings: Settings) -> Path:
    """Return the folder with the data saved before the last update."""
    return settings.data / _BEFORE_UPDATE


def files_besides_database(settings: Settings, database: Path | None) -> list[Path]:
    """Return the clinic's files besides the database, relative to the data folder: journals that are not imported yet, the station's state,
    certificates. Backups, imported journals and the backup key are left out. The audit anchor and the key of the second factors are left
    out because a backup has separate entries for them.

    :param database: the SQLite file, if any.
    """
    left_out = {
        settings.backup_folder,
        settings.backup_key_file,
        public_key_file(settings),
        settings.journal / "imported",
    }
    left_out |= {settings.effective_audit_anchor, settings.effective_second_factor_key}
    copies = f"{database.name}.version-" if database else None
    if database:
        left_out |= {database.with_name(database.name + ending) for ending in _DATABASE_SUFFIXES}
    ours = (_WORK_PREFIX, _ASIDE_PREFIX, _RESTORE_MARKER, _RECORDS, _BEFORE_UPDATE)
    files: list[Path] = []

    def walk(folder: Path) -> None:
        for path in sorted(folder.iterdir()):
            if path in left_out or path.is_symlink() or path.suffix == ".part":
                continue
            if folder == settings.data and path.name.startswith(ours):
                continue
            if path.is_dir():
                walk(path)
            elif path.is_file() and not (copies and path.name.startswith(copies)):
                files.append(path.relative_to(settings.data))

    if settings.data.is_dir():
        walk(settings.data)
    return files
