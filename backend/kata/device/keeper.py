"""Every journal that is open, on its way from the control thread's ring to the disk.

Writing and syncing are two threads' work. What is written outlives the process, so it must happen at once; a sync takes
as long as the disk likes, and meanwhile nothing written, and no Stop from the service, may wait for it.
"""

import logging
import os
from pathlib import Path
from typing import Final

from kata.device.journal import Files, JournalHeader, JournalWriter

log = logging.getLogger(__name__)

_SYNC_NS: Final = 50_000_000


def next_sync_ns(began_ns: int, now_ns: int) -> int:
    """When to sync again: a disk that takes up to 50 ms for it loses at most 100 ms to a power cut."""
    return max(began_ns + _SYNC_NS, now_ns)


class JournalKeeper:
    """The open journals of one folder."""

    def __init__(self, folder: Path, files: Files | None = None) -> None:
        """``files``: another disk than the computer's."""
        self._folder = folder
        self._files = files or Files()
        self._open: list[JournalWriter] = []

    def open(self, header: JournalHeader) -> JournalWriter:
        """A new journal, kept until it is finished. For the control thread: touches no file."""
        writer = JournalWriter(self._folder, header, self._files)
        self._open.append(writer)
        return writer

    @property
    def ok(self) -> bool:
        """The disk has taken everything of every journal that is open."""
        return not any(writer.failed for writer in self._open)

    def write(self) -> None:
        """Write what the control thread has left: the I/O thread's, each time it wakes."""
        for writer in list(self._open):
            try:
                writer.write()
            except OSError as error:
                self._failed(writer, error)

    def sync(self) -> list[Path]:
        """Sync what is written; which journals are finished and whole on the disk, and closed."""
        closed = []
        for writer in list(self._open):
            try:
                if writer.sync():
                    self._open.remove(writer)
                    closed.append(writer.path)
            except OSError as error:
                self._failed(writer, error)
        return closed

    @staticmethod
    def _failed(writer: JournalWriter, error: OSError) -> None:
        if not writer.failed:
            log.error("%s cannot be written: %s", writer.path.name, os.strerror(error.errno or 0))
        writer.failed = True
