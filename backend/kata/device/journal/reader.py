"""Reads a journal from the disk."""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from kata.device.journal.format import (
    CRC,
    FRAME,
    PHASE_PLAYING,
    ROW,
    TYPE_END,
    TYPE_SAMPLE,
    JournalEnd,
    JournalError,
    JournalHeader,
)
from kata.motion.measured import Repetition


@dataclass(frozen=True)
class Journal:
    """One journal as read from disk, with ``n`` samples. A teaching has samples from the times when the pedal was down; a
    run has samples from the times when torque was on.
    """

    kind: Literal["teaching", "run"]
    id: str
    recording_id: str | None
    station: str
    rate_hz: int
    started_at: datetime
    started_ns: int
    t_ns: NDArray[np.int64]
    """(n,) time at which the drives answered, on the device's monotonic clock."""
    take: NDArray[np.uint32]
    """(n,) number of the take, from 1. A take lasts from a press of the pedal to its release."""
    phase: NDArray[np.uint8]
    """(n,) PHASE_*; 0 in teaching."""
    path_s: NDArray[np.float64]
    """(n,) place on the recording's clock; NaN if the sample has no such place."""
    setpoint_deg: NDArray[np.float32]
    measured_deg: NDArray[np.float32]
    torque_nm: NDArray[np.float32]
    """Setpoint, measured angle and torque: each (n, 5) in axis order."""
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


def read(path: Path) -> Journal:
    """Read a journal up to the first cut or damaged record.

    :raises JournalError: when the file does not begin with a journal header.
    :raises OSError: when the file cannot be read.
    """
    return parse(path.read_bytes(), path.name)


def parse(data: bytes, name: str) -> Journal:
    """Parse a journal's bytes; see :func:`read`.

    :raises JournalError: when the bytes do not begin with a journal header.
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
        if kind == TYPE_SAMPLE:
            samples += payload
        elif kind == TYPE_END:
            end = msgspec.json.decode(payload, type=JournalEnd)
        good = position
    rows = np.frombuffer(bytes(samples), dtype=ROW)
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
    header: JournalHeader,
    times_s: NDArray[np.float64],
    measured_deg: NDArray[np.floating],
    setpoint_deg: NDArray[np.floating],
    torque_nm: NDArray[np.floating],
    end: JournalEnd,
) -> Journal:
    """Return a journal of a known motion, made without a device. It is one take or one run that only plays.

    ``times_s``: (n,) from 0; it is used as the place on the recording's clock too. The other arrays are (n, 5) in axis order.
    """
    count = len(times_s)
    return Journal(
        kind=header.kind,
        id=header.id,
        recording_id=header.recording_id,
        station=header.station,
        rate_hz=header.rate_hz,
        started_at=header.started_at,
        started_ns=header.started_ns,
        t_ns=np.round(times_s * 1e9).astype(np.int64),
        take=np.ones(count, dtype=np.uint32),
        phase=np.full(count, PHASE_PLAYING if header.kind == "run" else 0, dtype=np.uint8),
        path_s=times_s,
        setpoint_deg=setpoint_deg.astype(np.float32),
        measured_deg=measured_deg.astype(np.float32),
        torque_nm=torque_nm.astype(np.float32),
        end=end,
        truncated=False,
    )


def _records(body: bytes, seed: int) -> Iterator[tuple[int, bytes, int]]:
    """Yield the good records from the start: type, payload and end of the record."""
    position = 0
    while position + FRAME.size <= len(body):
        kind, length = FRAME.unpack_from(body, position)
        payload_end = position + FRAME.size + length
        if payload_end + CRC.size > len(body):
            return
        if CRC.unpack_from(body, payload_end)[0] != zlib.crc32(body[position:payload_end], seed):
            return
        yield kind, body[position + FRAME.size : payload_end], payload_end + CRC.size
        position = payload_end + CRC.size
