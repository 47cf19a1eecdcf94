"""Locks a folder of journals."""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

_LOCK_RETRY_S: Final = 0.02


class FolderInUseError(Exception):
    """Another process has locked the folder of journals; the message names the folder."""


@contextmanager
def claimed(folder: Path, within_s: float) -> Iterator[None]:
    """Lock the folder, so that only one device process runs and a journal is imported only when no process writes it.

    The lock ends with the process. A device process that has lost its service holds the lock until its last journal is
    complete.

    :raises FolderInUseError: when another process still holds the lock after ``within_s``.
    """
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        until = time.monotonic() + within_s
        while True:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError as error:
                if time.monotonic() >= until:
                    raise FolderInUseError(f"{folder} is in use by another Kata.") from error
                time.sleep(_LOCK_RETRY_S)
        yield
    finally:
        os.close(handle)
