"""Writes the open journals: two threads move their records from the control thread's ring to the disk.

One thread writes, the other syncs. Written data survives the end of the process, so writing must happen at once. A sync takes
as long as the disk needs, and no write may wait for it. A disk may also delay a write. The two threads therefore do nothing
else, and a Stop from the service uses neither.
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
    """Return the time of the next sync. If each sync takes up to 50 ms, a power cut loses at most 100 ms of samples."""
    return max(began_ns + _SYNC_NS, now_ns)


class JournalSet:
    """The open journals of one folder."""

    def __init__(self, folder: Path, files: JournalDisk | None = None) -> None:
        """Create the set without journals. ``files``: replaces the computer's disk in tests."""
        self._folder = folder
        self._files = files or JournalDisk()
        self._open: list[JournalWriter] = []

    def open(self, header: JournalHeader) -> JournalWriter:
        """Open a journal until it is finished. The control thread calls this method, which touches no file."""
        writer = JournalWriter(self._folder, header, self._files)
        self._open.append(writer)
        return writer

    @property
    def ok(self) -> bool:
        """True if the disk has accepted all data of every open journal."""
        return not any(writer.failed for writer in self._open)

    def write(self) -> None:
        """Write the records that the control thread has queued."""
        for writer in list(self._open):
            try:
                writer.write()
            except OSError as error:
                self._failed(writer, error)

    def sync(self) -> list[Path]:
        """Sync the written files. Return the journals that are finished, complete on the disk, and closed."""
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
    """The thread that writes a set of journals and the thread that syncs them."""

    def __init__(self, journal_set: JournalSet, on_closed: Callable[[Path], None], on_end: Callable[[], None]) -> None:
        """Prepare both threads.

        :param on_closed: called with each journal that is finished and on the disk.
        :param on_end: called when either thread ends, for any reason.
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
        """Wake the writing thread; never waits."""
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
