"""Writes files atomically, so that a reader never finds an incomplete file."""

import contextlib
import logging
import os
from pathlib import Path

from kata.system.sync import sync_folder

log = logging.getLogger(__name__)


def replace_file(path: Path, data: bytes) -> None:
    """Replace a file atomically, with a new file that is written beside it. It survives a power cut, and has the mode of the former file.

    :raises OSError: when the file cannot be written. The former file is then unchanged. If only the sync of the folder fails, nothing is
        raised: the file is replaced, but a power cut may bring the former one back.
    """
    temporary = path.with_suffix(".writing")
    try:
        with temporary.open("wb") as file:
            if path.exists():
                _take_over_access(path, file.fileno())
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise
    try:
        sync_folder(path.parent)
    except OSError:
        log.exception("the folder of %s cannot be synced", path)


def write_private_file(path: Path, data: bytes) -> None:
    """Write a file atomically, readable only by its owner."""
    part = path.with_suffix(".part")
    part.unlink(missing_ok=True)
    with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)


def _take_over_access(path: Path, file: int) -> None:
    former = path.stat()
    os.fchmod(file, former.st_mode & 0o777)
    # Only an administrator may give a file to another user.
    with contextlib.suppress(PermissionError):
        os.fchown(file, former.st_uid, former.st_gid)
