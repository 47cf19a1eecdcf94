"""Read a motion from a CSV file and check it as the device does. Errors are reported with line and column.

Run it in the worker process that builds figures, because an hour of motion would block the service's heartbeats.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from kata.clinic.recordings.tables import RECORDING_COLUMNS
from kata.database.series import Series, pack, unpack
from kata.device.config import StationConfig
from kata.interop import texts
from kata.interop.sample_file import SIMULATED
from kata.messages import text_of
from kata.motion import texts as motion_texts
from kata.motion.axes import AXES, Side
from kata.motion.csv_table import CsvTable, TableError, TableProblem, read_table
from kata.motion.edit import LONGEST_S
from kata.motion.linkage import Floats, OutOfReachError, motor_angles_deg
from kata.motion.method import reference
from kata.motion.taught import POSE_LAYOUT, check_poses, check_time
from kata.motion.trajectory import TrajectoryError
from kata.plotting import downsampling

Layout = Literal["poses", "motors"]
MOTOR_LAYOUT: Final = ("time_s", *(f"motor_{motor}_deg" for motor in AXES))
"""The columns of exported samples (:mod:`kata.interop.sample_table`)."""
DONE: Final = texts.IMPORTED_FROM_CSV()
_LIKE_RADIANS: Final = 3.5
"""Degrees that a useful motion exceeds in at least one motor. A motion in radians never does."""
_WHOLE_TURN_DEG: Final = 360.0
_LONGEST_GAP_S: Final = 1.0
_SEPARATORS: Final[dict[str, Literal["comma", "semicolon", "tab"]]] = {",": "comma", ";": "semicolon", "\t": "tab"}


@dataclass(frozen=True)
class ParsedMotion:
    """The content of a file. ``series``: its motor angles as stored samples, for an apparatus that is set to ``side``."""

    side: Side
    layout: Layout
    separator: Literal["comma", "semicolon", "tab"]
    left_alone: tuple[str, ...]
    simulated: bool
    """True if the file has the column that marks an export from a simulated apparatus."""
    series: Series
    downsampled: bytes | None
    samples: int
    duration_s: float
    rate_hz: int


def parse_motion(data: bytes, side: Side, config: StationConfig) -> ParsedMotion:
    """Parse and check a file.

    :raises TableError: with line and column of the error.
    """
    table = read_table(_text(data), MOTOR_LAYOUT, POSE_LAYOUT)
    layout: Layout = "motors" if table.columns == MOTOR_LAYOUT else "poses"
    _check_clock(table)
    _check_degrees(table)
    times_s = table.values[:, 0] - table.values[0, 0]
    angles_deg = _of_poses(table, side) if layout == "poses" else table.values[:, 1:]
    series = pack({"time_s": times_s, "angle_deg": angles_deg}, RECORDING_COLUMNS)
    # Check the stored samples, because these will be played.
    stored = unpack(series)
    try:
        config.check_reference("smooth", reference("smooth", stored["time_s"], stored["angle_deg"]), side)
    except TrajectoryError as error:
        raise _at_its_line(error, table, times_s, layout) from error
    return ParsedMotion(
        side,
        layout,
        _SEPARATORS[table.separator],
        tuple(name for name in table.others if name != SIMULATED),
        SIMULATED in table.others,
        series,
        downsampling.of_recording(stored["time_s"], stored["angle_deg"]),
        samples=len(times_s),
        duration_s=float(stored["time_s"][-1]),
        rate_hz=max(1, round(1 / float(np.median(np.diff(times_s))))),
    )


def _text(data: bytes) -> str:
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise TableError(texts.FILE_UTF16())
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        if _is_shift_jis(data):
            raise TableError(texts.LINE_SHIFT_JIS(line=line)) from error
        raise TableError(texts.LINE_NOT_UTF8(line=line)) from error


def _is_shift_jis(data: bytes) -> bool:
    try:
        return "\0" not in data.decode("cp932")
    except UnicodeDecodeError:
        return False


def _check_clock(table: CsvTable) -> None:
    times_s = table.values[:, 0]
    steps = np.diff(times_s)
    if len(steps) > 1 and np.median(steps) > _LONGEST_GAP_S:
        problem = texts.ROWS_FAR_APART(step_s=np.median(steps))
        table.refuse([(1, 0, problem)])
    check_time(table)
    if times_s[-1] - times_s[0] > LONGEST_S:
        row = int(np.argmax(times_s - times_s[0] > LONGEST_S))
        table.refuse([(row, 0, texts.MOTION_LONGER_THAN_AN_HOUR())])

    def gaps() -> Iterator[tuple[int, int, str]]:
        for row in np.flatnonzero(steps > _LONGEST_GAP_S).tolist():
            yield row + 1, 0, texts.GAP_BEFORE(gap_s=steps[row], longest_s=_LONGEST_GAP_S)

    table.refuse(gaps())


def _check_degrees(table: CsvTable) -> None:
    angles = table.values[:, 1:]
    table.refuse(
        (row, axis + 1, texts.MORE_THAN_A_TURN(angle_deg=angles[row, axis]))
        for row, axis in np.argwhere(np.abs(angles) > _WHOLE_TURN_DEG).tolist()
    )
    if np.abs(angles).max() <= _LIKE_RADIANS and np.ptp(angles, axis=0).max() > 0:
        row, axis = np.unravel_index(int(np.argmax(np.abs(angles))), angles.shape)
        problem = texts.LOOKS_LIKE_RADIANS(angle_deg=angles[row, axis])
        table.refuse([(int(row), int(axis) + 1, problem)])


def _of_poses(table: CsvTable, side: Side) -> Floats:
    check_poses(table)
    try:
        return motor_angles_deg(table.values[:, 1:], side)
    except OutOfReachError as error:
        message = error.text
        table.refuse([(error.index, 2 if error.motor == 2 else 1, message)])
        raise


def _at_its_line(error: TrajectoryError, table: CsvTable, times_s: Floats, layout: Layout) -> TableError:
    """Return the error with the line and column of the file where it occurs."""
    if error.at_s is None or error.motor is None:
        return TableError(text_of(error))
    row = min(int(np.searchsorted(times_s, error.at_s)), len(times_s) - 1)
    column = table.columns[error.motor]
    if layout == "poses" and error.motor <= 2:
        column = motion_texts.TWO_COLUMNS(first=table.columns[1], second=table.columns[2])
    problem = TableProblem(int(table.lines[row]), column, text_of(error))
    return TableError(problem.text, [problem])
