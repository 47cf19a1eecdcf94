"""Defines the file format of a journal: the samples of a teaching or a run, on disk before any other program has them.

Each journal is one file: a header line of JSON, then records of type, length, payload and CRC-32. A file that was cut or
damaged is valid up to its first bad record. The CRC includes the header, so that a disk block of an older journal that
reappears after a power cut is detected as damaged. The control thread appends to a ring in memory. Other threads write and
sync (:mod:`kata.device.journal_set`). The service reads finished files into the database.
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
    """The teaching_id or the run_id."""
    recording_id: str | None
    station: str
    rate_hz: int
    started_at: datetime
    """Start time in UTC, from the station's wall clock."""
    started_ns: int
    """The same moment on the monotonic clock that the samples use."""


class JournalEnd(msgspec.Struct, frozen=True, kw_only=True):
    """Last record: the reason why the journal ended. If it is missing, the process ended before the journal."""

    reason: Literal["finished", "completed", "returned", "stopped", "unloaded"]
    cause_code: str | None = None
    cause_message: str | None = None
    cause_key: MessageKey | None = None
    """Code and parameters of ``cause_message``."""
    held_s: float | None = None
    """Time for which a stretch held at least 60 % of its torque; None: the run was no stretch."""
    target_nm: float | None = None
    """Torque of the stretch after all requests to reduce it."""
    work_j: float | None = None
    """Work of the patient along the path of a self-paced run; None: the run was not self-paced."""
    mean_effort_nm: float | None = None
    """Mean effort while the patient moved the arm; None: the patient did not move it, or the run was not self-paced."""
    mean_pace_percent: float | None = None
    """Mean pace of a self-paced run, percent of the recording's speed; None: nothing was played, or the run was not self-paced."""
