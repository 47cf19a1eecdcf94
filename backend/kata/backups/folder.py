"""The data folder, as backups see it: what of it belongs to the clinic, and who may touch it now."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from kata.backups.key import BackupError, public_half
from kata.device import journal
from kata.settings import Settings

_WORK: Final = ".backup-"
_ASIDE: Final = "before-restore-"
_RESTORING: Final = "restoring"
_NOTES: Final = "backup-notes"
_LAST_SERVICE_S: Final = 2.0
_ENDINGS: Final = ("", "-wal", "-shm", "-journal")


class UnfinishedRestoreError(Exception):
    """A restore was cut off while it put things in their places; the message says what to do."""


@contextmanager
def served(settings: Settings) -> Iterator[None]:
    """The data folder is one service's alone while the block lasts: no other one starts on it, and nothing is restored into it.

    :raises FolderInUseError: when another service, or a restore, has it.
    :raises UnfinishedRestoreError: when a restore into it was cut off.
    """
    settings.data.mkdir(parents=True, exist_ok=True)
    with journal.claimed(settings.data, _LAST_SERVICE_S):
        if (marker := restoring_marker(settings)).exists():
            raise UnfinishedRestoreError(
                f"A restore into {settings.data} was cut off before its end. Run it again: kata restore FILE. What was there "
                f"before it is in a folder {_ASIDE}... beside it. To start with what is there now, delete {marker}."
            )
        yield


@contextmanager
def without_service(settings: Settings) -> Iterator[None]:
    """Nobody else uses the data folder while the block lasts.

    :raises BackupError: when a service does.
    """
    settings.data.mkdir(parents=True, exist_ok=True)
    try:
        with journal.claimed(settings.data, 0.0):
            yield
    except journal.FolderInUseError as error:
        raise BackupError(
            f"Kata is running on {settings.data}, and nothing is replaced under somebody at work. Stop it (sudo systemctl stop "
            "kata, or Ctrl-C where it runs), then restore again. To look into a backup meanwhile: kata restore FILE --verify"
        ) from error


def restoring_marker(settings: Settings) -> Path:
    """There while a restore puts things in their places: a service does not start on half of them."""
    return settings.data / _RESTORING


@contextmanager
def one_at_a_time(settings: Settings) -> Iterator[None]:
    """Of backups, tries and restores.

    :raises BackupError: when there is another.
    """
    notes_folder(settings).mkdir(parents=True, exist_ok=True)
    try:
        with journal.claimed(notes_folder(settings), 0.0):
            for left in settings.data.glob(f"{_WORK}*"):
                # Of one that was killed: what is in it is not encrypted.
                shutil.rmtree(left)
            yield
    except journal.FolderInUseError as error:
        raise BackupError("another backup is being made or tried just now; try again when it is done") from error


@contextmanager
def work_folder(settings: Settings) -> Iterator[Path]:
    """A folder for what is not encrypted yet, or no longer: beside the database, and as little of others' business."""
    with TemporaryDirectory(prefix=_WORK, dir=settings.data) as made:
        yield Path(made)


def notes_folder(settings: Settings) -> Path:
    """Where notes wait for the service to take them in."""
    return settings.data / _NOTES


def aside_folder(settings: Settings, name: str) -> Path:
    """Where a restore puts what was there."""
    return settings.data / f"{_ASIDE}{name}"


def others_files(settings: Settings, database: Path | None) -> list[Path]:
    """Files of the data folder that belong to the clinic besides its database, relative to it: journals that no row holds yet, how the
    station stands, certificates. Not: what is kept elsewhere already, what opens backups; and the audit trail's
    anchor and the key of the second factors, which have places of their own in a backup, and go on over a restore.

    ``database``: SQLite's file.
    """
    left_out = {settings.backup_folder, settings.backup_key_file, public_half(settings), settings.journal / "imported"}
    left_out |= {settings.effective_audit_anchor, settings.effective_second_factor_key}
    copies = f"{database.name}.version-" if database else None
    if database:
        left_out |= {database.with_name(database.name + ending) for ending in _ENDINGS}
    ours = (_WORK, _ASIDE, _RESTORING, _NOTES)
    found: list[Path] = []

    def walk(folder: Path) -> None:
        for path in sorted(folder.iterdir()):
            if path in left_out or path.is_symlink() or path.suffix == ".part":
                continue
            if folder == settings.data and path.name.startswith(ours):
                continue
            if path.is_dir():
                walk(path)
            elif path.is_file() and not (copies and path.name.startswith(copies)):
                found.append(path.relative_to(settings.data))

    if settings.data.is_dir():
        walk(settings.data)
    return found
