"""The journal of a teaching or a run: its samples, on disk before any other program has them.

Each journal is one file: a header line of JSON, then records of type, length, payload and CRC-32. The file is valid at
any length: every record before the first cut or damaged one is good. The CRC includes the header, so a disk block of an
older journal that reappears after a power cut is detected as damaged. The control thread appends to a ring in memory;
other threads write and sync (:mod:`kata.device.journal_set`). The service reads finished files into the database.
"""

import struct
from collections.abc import Sequence
from datetime import datetime
from typing import Final, Literal, NamedTuple

import msgspec
import numpy as np

from kata.messages import MessageKey
from kata.motion.axes import N_AXES

PHASE_APPROACHING: Final = 1
PHASE_PLAYING: Final = 2
PHASE_PAUSED: Final = 3
PHASE_RETURNING: Final = 4
PHASE_STOPPING: Final = 5
PHASE_REVERSING: Final = 6
PHASE_REDUCED_RANGE: Final = 7
"""Playing with a reduced range."""

SUFFIX: Final = ".journal"

SAMPLE: Final = struct.Struct("<qIBd15f")
FRAME: Final = struct.Struct("<BH")
CRC: Final = struct.Struct("<I")
TYPE_SAMPLE: Final = 1
TYPE_END: Final = 2
ROW: Final = np.dtype(
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


class Sample(NamedTuple):
    """One sample of a journal."""

    t_ns: int
    take: int
    phase: int
    path_s: float
    setpoint_deg: Sequence[float]
    measured_deg: Sequence[float]
    torque_nm: Sequence[float]


class JournalError(ValueError):
    """The file is not a journal, or this version cannot read it."""


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
