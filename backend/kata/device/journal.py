"""What a teaching or a run measured, on disk before anybody else has it.

One file each: a header line of JSON, then records of type, length, payload and CRC-32. It is valid at any byte: what
stands before the first record that is cut or damaged is good. The CRC begins with the header, so that a disk block that
once belonged to another journal, and comes back after a power cut, is damaged here. The control thread appends to a ring
in memory; others write and sync (:mod:`kata.device.journal_set`). The service reads finished files into the database.
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
"""Playing with less range than was asked for at load."""

SUFFIX: Final = ".journal"
_RING_RECORDS: Final = 6000
"""A minute at 100 Hz: longer than any disk may keep us waiting."""

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
    """The file is not a journal, or not one this version can read."""


class FolderInUseError(Exception):
    """Another process holds the folder of journals; the message says which folder."""


@contextmanager
def claimed(folder: Path, within_s: float) -> Iterator[None]:
    """Hold the folder alone: a journal is imported when nobody writes it any more, and one device process is enough.

    The claim goes with the process, however that ends. A device process that has lost its service holds it until its last
    journal is whole.

    :raises FolderInUseError: when somebody else still holds it after ``within_s``.
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
    """UTC, by the station's wall clock."""
    started_ns: int
    """The same moment by the monotonic clock, which samples carry."""


class JournalEnd(msgspec.Struct, frozen=True, kw_only=True):
    """Last record: why it ended. A journal without one ended with its process."""

    reason: Literal["finished", "completed", "returned", "stopped", "unloaded"]
    cause_code: str | None = None
    cause_message: str | None = None
    cause_key: MessageKey | None = None
    """Code and parameters of the message."""


@dataclass(frozen=True)
class Journal:
    """One journal, read. ``n`` samples: a teaching holds those taken with the pedal down, a run all with torque on."""

    kind: Literal["teaching", "run"]
    id: str
    recording_id: str | None
    station: str
    rate_hz: int
    started_at: datetime
    started_ns: int
    t_ns: NDArray[np.int64]
    """(n,) monotonic clock of the device, when the drives answered."""
    take: NDArray[np.uint32]
    """(n,) from 1: press of the pedal to its release."""
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
    """Something followed the last good record."""

    @property
    def repetition(self) -> Repetition:
        """A run as something to learn from."""
        return Repetition(
            self.path_s,
            self.measured_deg.astype(np.float64),
            self.torque_nm.astype(np.float64),
            self.phase == PHASE_PLAYING,
        )


class JournalDisk:
    """What a journal asks of the disk; tests put a disk of their own here, and cut its power after any call."""

    def create(self, path: Path) -> int:
        """A new file, open for appending."""
        return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o640)

    def write(self, file: int, data: bytearray) -> int:
        """Append some of it, as far as there is room: how many bytes."""
        return os.write(file, data)

    def sync(self, file: int) -> None:
        """Wait until what has been written survives a power cut."""
        os.fdatasync(file)

    def sync_folder(self, folder: Path) -> None:
        """Wait until the names in it survive a power cut."""
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

    def close(self, file: int) -> None:
        """Done with it."""
        os.close(file)


class JournalWriter:
    """Appends to one journal. Three threads, a method or two each, none waits for another.

    ``sample`` and ``finish`` touch no file; ``write`` fills the page cache, which outlives the process; ``sync`` waits
    for the disk, which outlives the power.
    """

    def __init__(self, folder: Path, header: JournalHeader, files: JournalDisk) -> None:
        """Name the file and queue its header; nothing touches the disk before the first :meth:`write`."""
        self.path = folder / f"{header.kind}-{header.id}{SUFFIX}"
        self.lost = 0
        """Samples that found the ring full: a fault, never silent."""
        self.failed = False
        """The disk has refused something, if only once: it tells of a failed sync once only."""
        line = msgspec.json.encode(header) + b"\n"
        self._seed = zlib.crc32(line)
        self._ring: deque[bytes] = deque([line])
        self._finished = False
        self._files = files
        self._file: int | None = None
        self._unwritten = bytearray()
        self._unsynced = False
        self._entered = False
        """Its name in the folder is on the disk."""
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
        """Write what is queued.

        :raises OSError: when the disk will not have it; the next call goes on at the very byte.
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
        """Wait until what is written is on the disk.

        :returns: whether the journal is finished, on disk as a whole, and closed.
        :raises OSError: when the disk will not have it.
        """
        if self._file is None:
            return False
        complete = self._complete
        if not self._entered:
            self._files.sync_folder(self.path.parent)
            self._entered = True
        if self._unsynced:
            # Before, not after: what is written meanwhile belongs to the next time.
            self._unsynced = False
            try:
                self._files.sync(self._file)
            except OSError:
                self._unsynced = True
                raise
        if complete:
            with suppress(OSError):  # the handle is gone all the same, and everything is on the disk
                self._files.close(self._file)
        return complete


def read(path: Path) -> Journal:
    """Read a journal, up to the first record that is cut or damaged.

    :raises JournalError: when its header is not one of ours.
    :raises OSError: when the file cannot be read.
    """
    return parse(path.read_bytes(), path.name)


def parse(data: bytes, name: str) -> Journal:
    """Read a journal's bytes; see :func:`read`.

    :raises JournalError: when its header is not one of ours.
    """
    line, newline, body = data.partition(b"\n")
    if not newline:
        # The header is written with or before everything else: nothing was kept.
        raise JournalError(f"{name} is not a journal: it ends before its header does")
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
    """A journal that no device has written, of a motion that is known already: one take, or one run that only plays.

    ``times_s``: (n,), from 0, and the place on the recording's clock; the others (n, 5), axis order.
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
    """Good records from the start: type, payload and where the record ends."""
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
