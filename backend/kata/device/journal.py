"""The journal of a teaching or a run: its samples, on disk before any other program has them.

Each journal is one file: a header line of JSON, then records of type, length, payload and CRC-32. The file is valid at
any length: every record before the first cut or damaged one is good. The CRC includes the header, so a disk block of an
older journal that reappears after a power cut is detected as damaged. The control thread appends to a ring in memory;
other threads write and sync (:mod:`kata.device.journal_set`). The service reads finished files into the database.
"""

import fcntl
import os
import struct
import time
import zlib
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final, Literal
from uuid import UUID

import msgspec
import numpy as np
from numpy.typing import NDArray

from kata.messages import MessageKey
from kata.motion.axes import N_AXES
from kata.motion.measured import Repetition

PHASE_APPROACHING: Final = 1
PHASE_PLAYING: Final = 2
PHASE_PAUSED: Final = 3
PHASE_RETURNING: Final = 4
PHASE_STOPPING: Final = 5
PHASE_REVERSING: Final = 6
PHASE_REDUCED_RANGE: Final = 7
"""Playing with a reduced range."""

SUFFIX: Final = ".journal"
_RING_RECORDS: Final = 6000
"""A minute at 100 Hz: longer than any disk may delay a write."""

_CLAIM_AGAIN_S: Final = 0.02

_SAMPLE: Final = struct.Struct("<qIBd15f")
_FRAME: Final = struct.Struct("<BH")
_CRC: Final = struct.Struct("<I")
_TYPE_SAMPLE: Final = 1
_TYPE_END: Final = 2
_ROW: Final = np.dtype(
    [
        ("t_ns", "<i8"),
        ("take", "<u4"),
        ("phase", "u1"),
        ("path_s", "<f8"),
        ("setpoint_deg", "<f4", (N_AXES,)),
        ("measured_deg", "<f4", (N_AXES,)),
        ("torque_nm", "<f4", (N_AXES,)),
    ]
)


class JournalError(ValueError):
    """The file is not a journal, or this version cannot read it."""


class FolderInUseError(Exception):
    """Another process has locked the folder of journals; the message names the folder."""


@contextmanager
def claimed(folder: Path, within_s: float) -> Iterator[None]:
    """Lock the folder: a journal is imported only when no process writes it, and only one device process may run.

    The lock ends with the process. A device process that has lost its service holds it until its last journal is
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
                time.sleep(_CLAIM_AGAIN_S)
        yield
    finally:
        os.close(handle)


class JournalHeader(msgspec.Struct, frozen=True, kw_only=True, tag_field="format", tag="kata-journal/2"):
    """First line of the file."""

    kind: Literal["teaching", "run"]
    id: str
    """teaching_id or run_id."""
    recording_id: str | None
    station: str
    rate_hz: int
    started_at: datetime
    """UTC, from the station's wall clock."""
    started_ns: int
    """The same moment on the monotonic clock that the samples use."""


class JournalEnd(msgspec.Struct, frozen=True, kw_only=True):
    """Last record: why the journal ended. A journal without it ended with its process."""

    reason: Literal["finished", "completed", "returned", "stopped", "unloaded"]
    cause_code: str | None = None
    cause_message: str | None = None
    cause_key: MessageKey | None = None
    """Code and parameters of the message."""


@dataclass(frozen=True)
class Journal:
    """One journal as read from disk, with ``n`` samples. A teaching has samples while the pedal was down, a run while
    torque was on.
    """

    kind: Literal["teaching", "run"]
    id: str
    recording_id: str | None
    station: str
    rate_hz: int
    started_at: datetime
    started_ns: int
    t_ns: NDArray[np.int64]
    """(n,) when the drives answered, on the device's monotonic clock."""
    take: NDArray[np.uint32]
    """(n,) number of the take, from 1: from a press of the pedal to its release."""
    phase: NDArray[np.uint8]
    """(n,) PHASE_*; 0 in teaching."""
    path_s: NDArray[np.float64]
    """(n,) place on the recording's clock; NaN where there is none."""
    setpoint_deg: NDArray[np.float32]
    measured_deg: NDArray[np.float32]
    torque_nm: NDArray[np.float32]
    """(n, 5) each, axis order."""
    end: JournalEnd | None
    truncated: bool
    """True if cut or damaged data followed the last good record."""

    @property
    def repetition(self) -> Repetition:
        """The samples of a run as input for learning."""
        return Repetition(
            self.path_s,
            self.measured_deg.astype(np.float64),
            self.torque_nm.astype(np.float64),
            self.phase == PHASE_PLAYING,
        )


class JournalDisk:
    """File operations of a journal. Tests replace them with a disk whose power they can cut after any call."""

    def create(self, path: Path) -> int:
        """Create a file and open it for appending."""
        return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o640)

    def write(self, file: int, data: bytearray) -> int:
        """Append as much of the data as fits. Return the number of bytes written."""
        return os.write(file, data)

    def sync(self, file: int) -> None:
        """Wait until the written data survives a power cut."""
        os.fdatasync(file)

    def sync_folder(self, folder: Path) -> None:
        """Wait until the names in the folder survive a power cut."""
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

    def close(self, file: int) -> None:
        """Close the file."""
        os.close(file)


class JournalWriter:
    """Appends to one journal. Three threads use it, each calls one or two methods, and none waits for another.

    ``append_sample`` and ``finish`` touch no file. ``write`` fills the page cache, which outlives the process. ``sync``
    waits for the disk, which outlives a power cut.
    """

    def __init__(self, folder: Path, header: JournalHeader, files: JournalDisk) -> None:
        """Name the file and queue its header. The first :meth:`write` creates the file."""
        self.path = folder / f"{header.kind}-{header.id}{SUFFIX}"
        self.lost = 0
        """Samples lost because the ring was full. A lost sample is a fault."""
        self.failed = False
        """True if the disk has ever refused an operation. The kernel reports a failed sync only once."""
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

    def append_sample(
        self,
        t_ns: int,
        *,
        take: int,
        phase: int,
        path_s: float,
        setpoint_deg: Sequence[float],
        measured_deg: Sequence[float],
        torque_nm: Sequence[float],
    ) -> None:
        """Append one sample."""
        if len(self._ring) >= _RING_RECORDS:
            self.lost += 1
            return
        payload = _SAMPLE.pack(t_ns, take, phase, path_s, *setpoint_deg, *measured_deg, *torque_nm)
        self._ring.append(_record(_TYPE_SAMPLE, payload, self._seed))

    def finish(self, end: JournalEnd) -> None:
        """Append the last record."""
        self._ring.append(_record(_TYPE_END, msgspec.json.encode(end), self._seed))
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


def read(path: Path) -> Journal:
    """Read a journal up to the first cut or damaged record.

    :raises JournalError: when its header is not a journal header.
    :raises OSError: when the file cannot be read.
    """
    return parse(path.read_bytes(), path.name)


def parse(data: bytes, name: str) -> Journal:
    """Parse a journal's bytes; see :func:`read`.

    :raises JournalError: when its header is not a journal header.
    """
    line, newline, body = data.partition(b"\n")
    if not newline:
        # The header is written before or together with all other records, so no sample was written.
        raise JournalError(f"{name} is not a journal: its header is incomplete")
    try:
        header = msgspec.json.decode(line, type=JournalHeader)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise JournalError(f"{name} is not a journal: {error}") from error
    samples = bytearray()
    end: JournalEnd | None = None
    good = 0
    for kind, payload, position in _records(body, zlib.crc32(line + newline)):
        if kind == _TYPE_SAMPLE:
            samples += payload
        elif kind == _TYPE_END:
            end = msgspec.json.decode(payload, type=JournalEnd)
        good = position
    rows = np.frombuffer(bytes(samples), dtype=_ROW)
    return Journal(
        kind=header.kind,
        id=header.id,
        recording_id=header.recording_id,
        station=header.station,
        rate_hz=header.rate_hz,
        started_at=header.started_at,
        started_ns=header.started_ns,
        t_ns=rows["t_ns"],
        take=rows["take"],
        phase=rows["phase"],
        path_s=rows["path_s"],
        setpoint_deg=rows["setpoint_deg"],
        measured_deg=rows["measured_deg"],
        torque_nm=rows["torque_nm"],
        end=end,
        truncated=good < len(body),
    )


def synthetic_journal(
    kind: Literal["teaching", "run"],
    id_: UUID,
    station: str,
    rate_hz: int,
    started_at: datetime,
    times_s: NDArray[np.float64],
    measured_deg: NDArray[np.floating],
    setpoint_deg: NDArray[np.floating],
    torque_nm: NDArray[np.floating],
    end: JournalEnd,
) -> Journal:
    """Return a journal of a known motion without a device: one take, or one run that only plays.

    ``times_s``: (n,), from 0, and also the place on the recording's clock; the other arrays are (n, 5), axis order.
    """
    count = len(times_s)
    return Journal(
        kind=kind,
        id=str(id_),
        recording_id=None,
        station=station,
        rate_hz=rate_hz,
        started_at=started_at,
        started_ns=0,
        t_ns=np.round(times_s * 1e9).astype(np.int64),
        take=np.ones(count, dtype=np.uint32),
        phase=np.full(count, PHASE_PLAYING if kind == "run" else 0, dtype=np.uint8),
        path_s=times_s,
        setpoint_deg=setpoint_deg.astype(np.float32),
        measured_deg=measured_deg.astype(np.float32),
        torque_nm=torque_nm.astype(np.float32),
        end=end,
        truncated=False,
    )


def _record(kind: int, payload: bytes, seed: int) -> bytes:
    framed = _FRAME.pack(kind, len(payload)) + payload
    return framed + _CRC.pack(zlib.crc32(framed, seed))


def _records(body: bytes, seed: int) -> Iterator[tuple[int, bytes, int]]:
    """Yield the good records from the start: type, payload and end of the record."""
    position = 0
    while position + _FRAME.size <= len(body):
        kind, length = _FRAME.unpack_from(body, position)
        payload_end = position + _FRAME.size + length
        if payload_end + _CRC.size > len(body):
            return
        if _CRC.unpack_from(body, payload_end)[0] != zlib.crc32(body[position:payload_end], seed):
            return
        yield kind, body[position + _FRAME.size : payload_end], payload_end + _CRC.size
        position = payload_end + _CRC.size
