"""Reads motions as poses over time from a file. The simulated therapist's hand follows them when a motion is taught.

The file is a CSV with a header row: ``time_s`` and the five columns of :data:`~kata.motion.axes.POSE_COLUMNS` in
degrees, in any order; other columns are ignored.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from kata.messages import text_of
from kata.motion import texts
from kata.motion.axes import POSE_COLUMNS, POSE_RANGE_DEG
from kata.motion.csv_table import CsvTable, TableError, read_table
from kata.motion.linkage import Floats

RANGE_TOLERANCE_DEG: Final = 2.0
"""A recorded pose may be this far outside the apparatus' range, because cuffs and encoders are not more precise."""
MIN_DURATION_S: Final = 0.5
POSE_LAYOUT: Final = ("time_s", *POSE_COLUMNS)
"""Column names of a file of poses."""


class TaughtError(TableError):
    """The motion cannot be used. The message names the error and its place in one sentence."""


@dataclass(frozen=True)
class Taught:
    """A motion as poses over time: ``times_s`` is ``(n,)`` from 0, ``poses_deg`` is ``(n, 5)`` in axis order."""

    name: str
    times_s: Floats
    poses_deg: Floats

    @property
    def duration_s(self) -> float:
        """Time of the last row."""
        return float(self.times_s[-1])


def read_csv(path: Path) -> Taught:
    """Read a motion from a CSV file, named after the file.

    :raises TaughtError: when the file cannot be read or :func:`parse_csv` refuses it.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise TaughtError(texts.FILE_UNREADABLE(file=path, error=error.strerror)) from error
    except UnicodeDecodeError as error:
        raise TaughtError(texts.FILE_NOT_TEXT(file=path)) from error
    return parse_csv(text, path.stem)


def parse_csv(text: str, name: str) -> Taught:
    """Parse a motion from CSV text. Its time is shifted to begin at 0.

    :raises TaughtError: naming line and column of the first problem: a missing column, a value that is not a finite
        number, time that does not increase, an angle outside the apparatus' range, too short a motion.
    """
    try:
        table = read_table(text, POSE_LAYOUT)
        check_time(table)
        check_poses(table)
    except TableError as error:
        raise TaughtError(text_of(error), error.problems) from error
    times_s = table.values[:, 0]
    return Taught(name, times_s - times_s[0], table.values[:, 1:])


def check_time(table: CsvTable) -> None:
    """Check the first column, the time. It must increase, and the motion must be long enough.

    :raises TableError: naming line and column.
    """
    times_s = table.values[:, 0]
    table.refuse(
        (row, 0, texts.TIME_MUST_INCREASE(time_s=times_s[row], before_s=times_s[row - 1]))
        for row in (np.flatnonzero(np.diff(times_s) <= 0) + 1).tolist()
    )
    if len(times_s) < 2 or times_s[-1] - times_s[0] < MIN_DURATION_S:
        raise TableError(texts.MOTION_TOO_SHORT(least_s=MIN_DURATION_S))


def check_poses(table: CsvTable) -> None:
    """Check the other five columns, the pose. It must be within the apparatus' range.

    :raises TableError: naming line and column.
    """
    low, high = np.array(POSE_RANGE_DEG).T
    poses = table.values[:, 1:]
    outside = (poses < low - RANGE_TOLERANCE_DEG) | (poses > high + RANGE_TOLERANCE_DEG)

    def wrong() -> Iterator[tuple[int, int, str]]:
        for row, axis in np.argwhere(outside).tolist():
            angle = {"angle_deg": poses[row, axis], "lowest_deg": low[axis], "highest_deg": high[axis]}
            yield row, axis + 1, texts.ANGLE_OUT_OF_APPARATUS(**angle)

    table.refuse(wrong())
