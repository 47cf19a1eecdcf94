"""Writes a journal to the disk."""

import os
import zlib
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from kata.device.journal.format import (
    CRC,
    FRAME,
    SAMPLE,
    SUFFIX,
    TYPE_END,
    TYPE_SAMPLE,
    JournalEnd,
    JournalHeader,
    Sample,
)
from kata.system.sync import sync_folder

_RING_RECORDS: Final = 6000
"""Capacity of the ring in records: a minute at 100 Hz, which is longer than a disk should delay a write."""


class JournalDisk:
    """File operations of a journal. Tests replace them with a disk whose power they can cut after any call."""

    def create(self, path: Path) -> int:
        """Create a file and open it for appending. Return its descriptor."""
        return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o600)

    def write(self, file: int, data: bytearray) -> int:
        """Append the data, or a part of it. Return the number of bytes written."""
        return os.write(file, data)

    def sync(self, file: int) -> None:
        """Wait until the written data survives a power cut."""
        os.fdatasync(file)

    def sync_folder(self, folder: Path) -> None:
        """Wait until the file names in the folder survive a power cut."""
        sync_folder(folder)

    def close(self, file: int) -> None:
        """Close the file."""
        os.close(file)


class JournalWriter:
    """Appends to one journal. Three threads use it; each calls one or two methods, and none waits for another.

    ``append_sample`` and ``finish`` touch no file. ``write`` writes to the page cache, which survives the end of the process.
    ``sync`` waits until the data is on the disk, where it survives a power cut.
    """

    def __init__(self, folder: Path, header: JournalHeader, files: JournalDisk) -> None:
        """Name the file and queue its header. The first :meth:`write` creates the file."""
        self.path = folder / f"{header.kind}-{header.id}{SUFFIX}"
        self.lost = 0
        """Samples lost because the ring was full. A lost sample is a fault."""
        self.failed = False
        """True if the disk has ever refused an operation. It stays True, because the kernel reports a failed sync only once."""
        line = msgspec.json.encode(header) + b"\n"
        self._seed = zlib.crc32(line)
        self._ring: deque[bytes] = deque([line])
        self._finished = False
        self._files = files
        self._file: int | None = None
        self._unwritten = bytearray()
        self._unsynced = False
        self._entered = False
        """True if the file's name in the folder is on the disk."""
        self._complete = False

    def append_sample(self, sample: Sample) -> None:
        """Append one sample."""
        if len(self._ring) >= _RING_RECORDS:
            self.lost += 1
            return
        t_ns, take, phase, path_s, setpoint_deg, measured_deg, torque_nm = sample
        payload = SAMPLE.pack(t_ns, take, phase, path_s, *setpoint_deg, *measured_deg, *torque_nm)
        self._ring.append(_record(TYPE_SAMPLE, payload, self._seed))

    def finish(self, end: JournalEnd) -> None:
        """Append the last record."""
        self._ring.append(_record(TYPE_END, msgspec.json.encode(end), self._seed))
        self._finished = True

    def write(self) -> None:
        """Write the queued records.

        :raises OSError: when the disk refuses them; the next call continues at the same byte.
        """
        finished = self._finished
        for _ in range(len(self._ring)):
            self._unwritten += self._ring.popleft()
        if self._file is None:
            self._file = self._files.create(self.path)
        while self._unwritten:
            del self._unwritten[: self._files.write(self._file, self._unwritten)]
            self._unsynced = True
        self._complete = finished

    def sync(self) -> bool:
        """Wait until the written records are on the disk.

        :returns: True if the journal is finished, complete on disk, and closed.
        :raises OSError: when the disk refuses.
        """
        if self._file is None:
            return False
        complete = self._complete
        if not self._entered:
            self._files.sync_folder(self.path.parent)
            self._entered = True
        if self._unsynced:
            # Reset before the sync: records written during it belong to the next sync.
            self._unsynced = False
            try:
                self._files.sync(self._file)
            except OSError:
                self._unsynced = True
                raise
        if complete:
            with suppress(OSError):  # the handle is invalid anyway, and all data is on the disk
                self._files.close(self._file)
        return complete


def _record(kind: int, payload: bytes, seed: int) -> bytes:
    framed = FRAME.pack(kind, len(payload)) + payload
    return framed + CRC.pack(zlib.crc32(framed, seed))
