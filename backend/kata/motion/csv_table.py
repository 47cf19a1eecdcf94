"""Reads tables of numbers from CSV files. Correct rows are parsed quickly, others cell by cell for the error messages."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from operator import itemgetter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from kata.messages import Text
from kata.motion import texts
from kata.motion.linkage import Floats

SEPARATORS: Final = (",", ";", "\t")
MOST_PROBLEMS: Final = 20
"""Maximum number of problems about one file. More problems would not help to correct it."""
_CHUNK: Final = 8192


@dataclass(frozen=True)
class TableProblem:
    """A problem at one place of the file."""

    line: int
    column: str
    """Name of the column, or a Text that describes the place."""
    what: str

    @property
    def place(self) -> Text:
        """Return line and column."""
        return texts.LINE_AND_COLUMN(line=self.line, column=self.column)

    @property
    def text(self) -> Text:
        """Return the problem with its place."""
        return texts.COLUMN_AT_LINE(line=self.line, column=self.column, problem=self.what)

    def __str__(self) -> str:
        return str(self.text)


class TableError(ValueError):
    """The file cannot be used. The message names the first problem. ``problems`` lists the problems that have a place."""

    def __init__(self, message: str, problems: Sequence[TableProblem] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(problems)


@dataclass(frozen=True)
class CsvTable:
    """The requested columns: ``values`` is ``(n, k)`` in the order of ``columns``; ``lines`` is ``(n,)``, from 1."""

    columns: tuple[str, ...]
    others: tuple[str, ...]
    """Names of ignored columns."""
    separator: str
    values: Floats
    lines: NDArray[np.int64]

    def refuse(self, wrong: Iterable[tuple[int, int, str]]) -> None:
        """Refuse the table if ``wrong`` is not empty. It contains row, column of ``values`` and text of each problem.

        :raises TableError: when there is a problem.
        """
        problems = [
            TableProblem(int(self.lines[row]), self.columns[column], what)
            for (row, column, what), _ in zip(wrong, range(MOST_PROBLEMS), strict=False)
        ]
        if problems:
            raise TableError(problems[0].text, problems)


def read_table(text: str, *layouts: tuple[str, ...]) -> CsvTable:
    """Read the columns of the first layout whose names are all in the header. Order and additional columns do not matter.

    :raises TableError: naming line and column of the problem: a missing column, an extra cell, or a cell without a finite number.
    """
    text = text.removeprefix("\ufeff")
    separator = max(SEPARATORS, key=text.partition("\n")[0].count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        header = [cell.strip() for cell in next(reader, [])]
        columns = _layout(header, layouts)
        table = _Rows(header, columns)
        body_at = text.find("\n")
        # Python reads 1_000 as a number, but other programs do not. Check such files cell by cell.
        careful = body_at >= 0 and "_" in text[body_at:]
        values, lines = table.read(_numbered(reader), careful=careful)
    except csv.Error as error:
        raise TableError(texts.CSV_UNREADABLE(line=reader.line_num, error=error)) from error
    other_columns = tuple(name for name in header if name and name not in columns)
    return CsvTable(columns, other_columns, separator, values, lines)


def _numbered(reader: Iterator[list[str]]) -> Iterator[tuple[int, list[str]]]:
    for cells in reader:
        if any(cells):
            yield reader.line_num, cells  # type: ignore[attr-defined]


def _layout(header: list[str], layouts: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    for layout in layouts:
        if all(column in header for column in layout):
            _twice(header, layout)
            return layout
    # Assume that the layout with the most present columns was intended.
    layout = max(layouts, key=lambda names: sum(name in header for name in names))
    missing = [column for column in layout if column not in header]
    units = [
        TableProblem(1, name, texts.COLUMN_UNIT_WRONG(column=column))
        for column in missing
        for name in header
        if _in_another_unit(name, column)
    ]
    message = texts.COLUMNS_MISSING(columns=", ".join(layout), missing=", ".join(missing))
    if units:
        message = texts.COLUMN_MISSING_WITH_OTHERS(
            line=units[0].line, column=units[0].column, problem=units[0].what, missing=", ".join(missing)
        )
    raise TableError(message, units or [TableProblem(1, column, texts.COLUMN_MISSING()) for column in missing])


def _twice(header: list[str], layout: tuple[str, ...]) -> None:
    twice = [TableProblem(1, column, texts.COLUMN_TWICE()) for column in layout if header.count(column) > 1]
    if twice:
        raise TableError(twice[0].text, twice)


def _in_another_unit(name: str, column: str) -> bool:
    """Return True for ``time_ms`` instead of ``time_s``, ``shoulder_flexion_rad`` or ``Shoulder_flexion (rad)`` instead
    of ``shoulder_flexion``.
    """
    stem = column.removesuffix("_s").removesuffix("_deg")
    suffix = name.lower().removeprefix(stem)
    return len(suffix) < len(name) and suffix.strip("_ ()[]") in {
        "rad",
        "rads",
        "radian",
        "radians",
        "ms",
        "us",
        "ns",
        "min",
    }


class _Rows:
    def __init__(self, header: list[str], columns: tuple[str, ...]) -> None:
        self._width = len(header)
        self._wanted = columns
        self._places = [header.index(column) for column in columns]
        self._problems: list[TableProblem] = []

    def read(self, numbered: Iterator[tuple[int, list[str]]], *, careful: bool) -> tuple[Floats, NDArray[np.int64]]:
        """Read all rows in chunks, so that the text of a long file is never completely in memory."""
        values: list[Floats] = []
        lines: list[NDArray[np.int64]] = []
        while chunk := [row for row, _ in zip(numbered, range(_CHUNK), strict=False)]:
            good = None if careful else self._quickly([cells for _, cells in chunk])
            if good is None:
                chunk = [(line, cells) for line, cells in chunk if any(cell.strip() for cell in cells)]
                good = self._slowly(chunk)
            values.append(good)
            lines.append(np.array([line for line, _ in chunk], dtype=np.int64))
        if self._problems:
            raise TableError(self._problems[0].text, self._problems)
        if not values:
            return np.empty((0, len(self._wanted))), np.empty(0, dtype=np.int64)
        return np.concatenate(values), np.concatenate(lines)

    def _quickly(self, rows: list[list[str]]) -> Floats | None:
        """Return the values of the rows, or None if any row is not correct."""
        if max(map(len, rows)) > self._width:
            return None
        try:
            flat = np.fromiter(map(float, chain.from_iterable(map(itemgetter(*self._places), rows))), dtype=np.float64)
        except (ValueError, IndexError):
            return None
        return flat.reshape(len(rows), -1) if np.all(np.isfinite(flat)) else None

    def _slowly(self, rows: list[tuple[int, list[str]]]) -> Floats:
        table = np.zeros((len(rows), len(self._places)))
        for row, (line, cells) in enumerate(rows):
            extra = next((cell for cell in cells[self._width :] if cell.strip()), None)
            if extra is not None:
                self._complain(
                    line, texts.COLUMN_AFTER(column=self._wanted[-1]), texts.CELL_WITHOUT_COLUMN(cell=repr(extra))
                )
            for at, place in enumerate(self._places):
                cell = cells[place].strip() if place < len(cells) else ""
                try:
                    value = math.nan if "_" in cell else float(cell)
                except ValueError:
                    value = math.nan
                table[row, at] = value
                if not math.isfinite(value):
                    self._complain(line, self._wanted[at], texts.CELL_NOT_NUMBER(cell=repr(cell[:40])))
        return table

    def _complain(self, line: int, column: str, problem: str) -> None:
        if len(self._problems) < MOST_PROBLEMS:
            self._problems.append(TableProblem(line, column, problem))
