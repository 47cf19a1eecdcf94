"""``kata audit verify``: whether the trail is what was written, and where it is not.

Four looks: each row against its hash, each number against the one before, the chain against the anchor, and the anchor against
what the rows say of its length. What none of them can see is an older copy of database and anchor together; a head that
somebody has kept elsewhere shows it.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Final

from sqlalchemy import Select, select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from kata.audit import anchor
from kata.audit.anchor import Line
from kata.audit.chain import COLUMNS, NOTHING, Head, link
from kata.audit.restored import restored
from kata.audit.tables import AuditRow

_AT_ONCE: Final = 5000
_HASH_BYTES: Final = 32
_UNREADABLE: Final = (ValueError, TypeError, AttributeError, SQLAlchemyError)
"""What a column's type makes of something that is not of that type."""
_SHOWN: Final = 1000
"""Findings; there are not more to be read than that."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that is not as it was written."""

    first: int
    """Number of the first row that is concerned."""
    last: int
    """And of the last."""
    message: str


@dataclass(slots=True)
class Verdict:
    """What a verification has come to."""

    rows: int = 0
    head: Head = NOTHING
    lines: int = 0
    findings: list[Finding] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    """What somebody should know, and is no damage."""

    @property
    def whole(self) -> bool:
        """Whether nothing was found."""
        return not self.findings

    def found(self, first: int, last: int, message: str) -> None:
        """Note a finding."""
        if len(self.findings) < _SHOWN:
            self.findings.append(Finding(first, last, message))


@dataclass(slots=True)
class _Seen:
    """Of the rows: what the anchors are compared with afterwards."""

    wanted: set[int]
    hashes: dict[int, bytes] = field(default_factory=dict)
    anchored: dict[str, tuple[int, int]] = field(default_factory=dict)
    """By anchor: how many lines it is said to hold at most, and in which row."""

    def note(self, number: int, values: Sequence[Any]) -> None:
        """What a row says of its anchor."""
        name, held = values[-2:]
        if name and held > self.anchored.get(name, (-1, 0))[0]:
            self.anchored[name] = (held, number)


def verify(
    session: Session,
    anchors: Sequence[Path],
    kept: Head | None = None,
    export: IO[str] | None = None,
    *,
    of_backup: int | None = None,
) -> Verdict:
    """Look at the whole trail, with each anchor there is; also while services go on writing both.

    ``kept``: a head that somebody has noted. ``export``: each row goes there, as a line of JSON. ``of_backup``: the rows are a
    backup's, which was begun when the anchor held so many lines: those behind may speak of later rows, and anchors of other
    services are not in it.
    """
    # Before the rows, as there may be more of them later, and again behind them, as they may then speak of more lines.
    before = [_lines(file) for file in anchors]
    verdict = Verdict()
    seen = _Seen({line.head.number for lines in before for line in lines} | ({kept.number} if kept else set()))
    _rows(session, verdict, seen, export)
    given_up = list(restored(session))
    for gap in given_up:
        verdict.remarks.append(f"Row {gap.number}: a backup was restored; what had been written since it was given up.")
    for lines in before:
        of_then = [
            line
            for line in lines
            if of_backup is None or line.line <= of_backup or line.head.number <= verdict.head.number
        ]
        _anchor([line for line in of_then if not any(gap.holds(line) for gap in given_up)], verdict, seen)
    after = [_lines(file) for file in anchors]
    for lines in after:
        _whole_anchor(lines, verdict, seen)
        verdict.lines += len(lines)
    for name in seen.anchored.keys() - {line.anchor for lines in after for line in lines}:
        held, number = seen.anchored[name]
        if held and of_backup is None:
            message = f"Row {number} speaks of an anchor of {held} lines, {name}, which is not here to be looked at."
            verdict.found(number, number, message)
    if kept:
        _anchor([Line(1, "", kept)], verdict, seen)
    return verdict


def _lines(file: Path) -> list[Line]:
    return anchor.read(file) if file.exists() else []


def _rows(session: Session, verdict: Verdict, seen: _Seen, export: IO[str] | None) -> None:
    before = NOTHING
    for number, values, stored in _read(session):
        missing = number - before.number - 1
        if missing > 0:
            verdict.found(before.number + 1, number - 1, f"{_named(before.number + 1, number - 1)} not there.")
        if missing < 0:
            verdict.found(number, number, f"Row {number} stands before the first.")
        try:
            if values is None or len(stored) != _HASH_BYTES:
                raise TypeError
            right = link(before.hash, values) == stored
        except TypeError:
            verdict.found(number, number, f"Row {number} cannot be read: nothing like it was ever written.")
        else:
            # Behind a gap, which has been told, the anchor alone can judge.
            if not right and missing == 0:
                verdict.found(
                    number,
                    number,
                    f"Row {number} is not what was written, or row {max(1, number - 1)} before it is not.",
                )
            seen.note(number, values)
            if export:
                export.write(_exported(values, stored))
        before = Head(number, stored)
        verdict.rows += 1
        if number in seen.wanted:
            seen.hashes[number] = stored
    verdict.head = before


def _read(session: Session) -> Iterator[tuple[int, tuple[Any, ...] | None, bytes]]:
    """Number, values and hash of each row, in order; no values where the database has none that fit their columns."""
    table = AuditRow.__table__
    columns = [table.c[name] for name in COLUMNS]
    query = select(*columns, table.c.hash).order_by(table.c.number).limit(_AT_ONCE)
    after: int | None = None
    while True:
        page = query if after is None else query.where(table.c.number > after)
        try:
            rows = [tuple(row) for row in session.execute(page)]
        except _UNREADABLE:
            rows = []
            for number in session.scalars(page.with_only_columns(table.c.number)).all():
                rows.append(_one(session, query.where(table.c.number == number), number))
        for row in rows:
            yield row[0], row[:-1] if len(row) > 1 else None, row[-1] if isinstance(row[-1], bytes) else b""
        if len(rows) < _AT_ONCE:
            return
        after = rows[-1][0]


def _one(session: Session, query: Select[Any], number: int) -> tuple[Any, ...]:
    try:
        return tuple(session.execute(query).one())
    except _UNREADABLE:
        return (number,)


def _anchor(lines: Sequence[Line], verdict: Verdict, seen: _Seen) -> None:
    """Whether the chain is the one that these lines saw."""
    last = max((line.head.number for line in lines), default=0)
    end = verdict.head.number
    if last > end:
        verdict.found(
            end + 1, last, f"{_named(end + 1, last)} not there: the trail was anchored with them, and cut off."
        )
    good = 0
    for line in sorted(lines, key=lambda line: line.head.number):
        if line.head.number > end:
            break
        if seen.hashes.get(line.head.number) != line.head.hash:
            first, found = good + 1, line.head.number
            verdict.found(first, found, f"{_named(first, found)} not what was anchored: the chain was made anew there.")
            break
        good = line.head.number


def _whole_anchor(lines: Sequence[Line], verdict: Verdict, seen: _Seen) -> None:
    """Whether the anchor itself is whole."""
    name = lines[0].anchor if lines else ""
    before, head = 0, 0
    for line in lines:
        if line.line != before + 1 or line.anchor != name:
            verdict.found(
                head, line.head.number, f"Behind line {before} of the anchor, something is missing or was changed."
            )
        before, head = line.line, line.head.number
    held, number = seen.anchored.get(name, (0, 0))
    if held > before:
        verdict.found(
            number, number, f"The anchor ends at line {before}; when row {number} was written, it had {held}."
        )


def _named(first: int, last: int) -> str:
    return f"Row {first} is" if first == last else f"Rows {first} to {last} are"


def _exported(values: Sequence[Any], stored: bytes) -> str:
    row = dict(zip(COLUMNS, values, strict=True)) | {"hash": stored.hex()}
    return json.dumps(row, default=str, ensure_ascii=False) + "\n"
