"""Motions given as poses over time: what a therapist's hand follows when a motion is taught from a file.

The file is a CSV with a header row: ``time_s`` and the five columns of
:data:`~kata.motion.axes.POSE_COLUMNS` in degrees, in any order; other columns are left alone.
"""

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from kata.motion.axes import POSE_COLUMNS, POSE_RANGE_DEG
from kata.motion.linkage import Floats

RANGE_TOLERANCE_DEG: Final = 2.0
"""A recorded pose may lie this far outside the apparatus' ROM: cuffs and encoders are no better than that."""
MIN_DURATION_S: Final = 0.5


class TaughtError(ValueError):
    """The motion cannot be used; the message says in one sentence what is wrong and where."""


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
        raise TaughtError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise TaughtError(f"{path} is not a text file") from error
    return parse_csv(text, path.stem)


def parse_csv(text: str, name: str) -> Taught:
    """Read a motion from CSV text; its time is shifted to begin at 0.

    :raises TaughtError: naming line and column of the first thing that is wrong: a missing column, something that is
        no finite number, time that does not increase, an angle outside the apparatus' range, too short a motion.
    """
    reader = csv.reader(io.StringIO(text.removeprefix("\ufeff")))
    header = [cell.strip() for cell in next(reader, [])]
    wanted = ("time_s", *POSE_COLUMNS)
    missing = [column for column in wanted if column not in header]
    if missing:
        raise TaughtError(f"the first line must name the columns {', '.join(wanted)}; missing: {', '.join(missing)}")
    places = [header.index(column) for column in wanted]

    rows: list[list[float]] = []
    for cells in reader:
        if not any(cell.strip() for cell in cells):
            continue
        rows.append(
            [_number(cells, place, column, reader.line_num) for place, column in zip(places, wanted, strict=True)]
        )
        _check(rows, reader.line_num)
    if len(rows) < 2 or rows[-1][0] - rows[0][0] < MIN_DURATION_S:
        raise TaughtError(f"the motion is too short: {MIN_DURATION_S} s and two rows are the least")
    table = np.array(rows)
    return Taught(name, table[:, 0] - table[0, 0], table[:, 1:])


def _number(cells: list[str], place: int, column: str, line: int) -> float:
    cell = cells[place].strip() if place < len(cells) else ""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise TaughtError(f"line {line}, column {column}: {cell!r} is not a number")
    return value


def _check(rows: list[list[float]], line: int) -> None:
    row = rows[-1]
    if len(rows) > 1 and row[0] <= rows[-2][0]:
        raise TaughtError(f"line {line}, column time_s: time must increase, {row[0]:g} follows {rows[-2][0]:g}")
    for column, angle, (low, high) in zip(POSE_COLUMNS, row[1:], POSE_RANGE_DEG, strict=True):
        if not low - RANGE_TOLERANCE_DEG <= angle <= high + RANGE_TOLERANCE_DEG:
            raise TaughtError(
                f"line {line}, column {column}: {angle:g} deg is outside the apparatus' range of {low:g} to {high:g} deg"
            )
