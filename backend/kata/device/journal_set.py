"""Every journal that is open, on its way from the control thread's ring to the disk.

Writing and syncing are two threads' work. What is written outlives the process, so it must happen at once; a sync takes
as long as the disk likes, and meanwhile nothing written may wait for it. A disk may keep a write waiting, too: neither
thread does anything else, and a Stop from the service passes both.
"""

import logging
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from kata.device.journal import JournalDisk, JournalHeader, JournalWriter

log = logging.getLogger(__name__)

_SYNC_NS: Final = 50_000_000


def next_sync_ns(began_ns: int, now_ns: int) -> int:
    """When to sync again: a disk that takes up to 50 ms for it loses at most 100 ms to a power cut."""
    return max(began_ns + _SYNC_NS, now_ns)


class JournalSet:
    """The open journals of one folder."""

    def __init__(self, folder: Path, files: JournalDisk | None = None) -> None:
        """``files``: another disk than the computer's."""
        self._folder = folder
        self._files = files or JournalDisk()
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
        """Write what the control thread has left."""
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


class JournalThreads:
    """The thread that writes the journals of a keeper, and the one that syncs them."""

    def __init__(self, journal_set: JournalSet, on_closed: Callable[[Path], None], on_end: Callable[[], None]) -> None:
        """
        :param on_closed: is called with each journal that is finished and on the disk.
        :param on_end: is called when a thread ends, for whatever reason.
        """
        self._journal_set = journal_set
        self._on_closed = on_closed
        self._on_end = on_end
        self._ended = threading.Event()
        self._woken = os.eventfd(0, os.EFD_CLOEXEC)
        self._threads = [
            threading.Thread(target=self._serve, args=(part,), name=name, daemon=True)
            for name, part in (("journal", self._write_until_ended), ("sync", self._sync_until_ended))
        ]

    def start(self) -> None:
        """Start both threads."""
        for thread in self._threads:
            thread.start()

    def wake(self) -> None:
        """Have what was left for the journals written now; never waits."""
        os.eventfd_write(self._woken, 1)

    def finish(self) -> None:
        """End both threads, then write and sync the rest; waits for the disk."""
        self._ended.set()
        self.wake()
        for thread in self._threads:
            thread.join()
        os.close(self._woken)
        self._journal_set.write()
        self._sync()

    def _serve(self, part: Callable[[], None]) -> None:
        try:
            part()
        finally:
            self._on_end()

    def _write_until_ended(self) -> None:
        while not self._ended.is_set():
            os.eventfd_read(self._woken)
            self._journal_set.write()

    def _sync_until_ended(self) -> None:
        due_ns = time.monotonic_ns()
        while not self._ended.wait(max(0, due_ns - time.monotonic_ns()) / 1e9):
            began_ns = time.monotonic_ns()
            self._sync()
            due_ns = next_sync_ns(began_ns, time.monotonic_ns())

    def _sync(self) -> None:
        for path in self._journal_set.sync():
            self._on_closed(path)
