"""Verify the audit trail (``kata audit verify``): find rows that were changed, added or removed.

Four comparisons: each row with its hash, each number with the previous one, the chain with the anchor, and the anchor's length with the
rows. They cannot detect that database and anchor were cut or replaced together. The anchor's copy, or a head that is stored elsewhere,
reveals this.
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
from kata.audit.anchor import AnchorLine
from kata.audit.chain import COLUMNS, NOTHING, Head, link
from kata.audit.restored import restored_gaps
from kata.audit.tables import AuditRow

_BATCH_ROWS: Final = 5000
_HASH_BYTES: Final = 32
_UNREADABLE: Final = (ValueError, TypeError, AttributeError, SQLAlchemyError)
"""Errors that occur when a value does not have its column's type."""
_MAX_FINDINGS: Final = 1000


@dataclass(frozen=True, slots=True)
class ChainFinding:
    """A gap or a change in the trail, from row ``first`` to row ``last``."""

    first: int
    last: int
    message: str


@dataclass(slots=True)
class Verdict:
    """The result of a verification."""

    rows: int = 0
    head: Head = NOTHING
    lines: int = 0
    findings: list[ChainFinding] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    """Notable facts that are not damage."""

    @property
    def intact(self) -> bool:
        """Return whether there are no findings."""
        return not self.findings

    def add(self, first: int, last: int, message: str) -> None:
        """Add a finding."""
        if len(self.findings) < _MAX_FINDINGS:
            self.findings.append(ChainFinding(first, last, message))


@dataclass(slots=True)
class _ComparedRows:
    """Data from the rows that are compared with the anchors."""

    numbers: set[int]
    """Numbers of the rows whose hashes are compared."""
    hashes: dict[int, bytes] = field(default_factory=dict)
    anchored: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Per anchor: the highest number of lines that a row names, and the number of that row."""

    def add(self, number: int, values: Sequence[Any]) -> None:
        """Add the anchor that a row names, and the anchor's length."""
        name, lines = values[-2:]
        if name and lines > self.anchored.get(name, (-1, 0))[0]:
            self.anchored[name] = (lines, number)


def verify(
    session: Session,
    anchors: Sequence[Path],
    known_head: Head | None = None,
    export: IO[str] | None = None,
    *,
    copies: Sequence[Path] = (),
    of_backup: int | None = None,
) -> Verdict:
    """Verify the whole trail against all anchors. Services may write to both meanwhile.

    :param known_head: a head that was stored elsewhere.
    :param copies: copies of these anchors, stored elsewhere.
    :param export: file to which each row is written as a line of JSON.
    :param of_backup: set if the rows are those of a backup: number of lines that the anchor had when the backup began. Further lines may
        contain later rows, and anchors of other services are not checked.
    """
    # The anchors are read before the rows, because later lines contain later rows, and again after the rows, because later rows name more
    # lines.
    before = [_read_anchor(file) for file in anchors]
    elsewhere = [_read_anchor(file) for file in copies]
    verdict = Verdict()
    numbers = {line.head.number for lines in (*before, *elsewhere) for line in lines}
    compared = _ComparedRows(numbers | ({known_head.number} if known_head else set()))
    _verify_rows(session, verdict, compared, export)
    gaps = list(restored_gaps(session))
    for gap in gaps:
        verdict.remarks.append(f"Row {gap.number}: a backup was restored, which discarded the rows since that backup.")
    for lines in before:
        of_rows = [
            line
            for line in lines
            if of_backup is None or line.line <= of_backup or line.head.number <= verdict.head.number
        ]
        _compare_chain([line for line in of_rows if not any(gap.explains(line) for gap in gaps)], verdict, compared)
    for file, copied in zip(copies, elsewhere, strict=True):
        _compare_copy(copied, before, verdict, file)
        of_rows = [line for line in copied if not any(gap.explains(line) for gap in gaps)]
        _compare_chain(of_rows, verdict, compared, "the anchor's copy")
    after = [_read_anchor(file) for file in anchors]
    for lines in after:
        _check_anchor(lines, verdict, compared)
        verdict.lines += len(lines)
    for name in compared.anchored.keys() - {line.anchor for lines in after for line in lines}:
        expected, number = compared.anchored[name]
        if expected and of_backup is None:
            verdict.add(
                number, number, f"Row {number} names the anchor {name} with {expected} lines, which was not given."
            )
    if known_head:
        _compare_chain([AnchorLine(1, "", known_head)], verdict, compared)
    return verdict


def _read_anchor(file: Path) -> list[AnchorLine]:
    return anchor.read(file) if file.exists() else []


def _verify_rows(session: Session, verdict: Verdict, compared: _ComparedRows, export: IO[str] | None) -> None:
    before = NOTHING
    for number, values, stored in _read_rows(session):
        missing = number - before.number - 1
        if missing > 0:
            verdict.add(before.number + 1, number - 1, f"{_describe_rows(before.number + 1, number - 1)} missing.")
        if missing < 0:
            verdict.add(number, number, f"Row {number} is before the first row.")
        try:
            if values is None or len(stored) != _HASH_BYTES:
                raise TypeError
            is_correct = link(before.hash, values) == stored
        except TypeError:
            verdict.add(number, number, f"Row {number} cannot be read: Kata never writes such values.")
        else:
            # After a gap, only the anchor can verify the row.
            if not is_correct and missing == 0:
                verdict.add(number, number, f"Row {number} or the row before it, {max(1, number - 1)}, was changed.")
            compared.add(number, values)
            if export:
                export.write(_export_line(values, stored))
        before = Head(number, stored)
        verdict.rows += 1
        if number in compared.numbers:
            compared.hashes[number] = stored
    verdict.head = before


def _read_rows(session: Session) -> Iterator[tuple[int, tuple[Any, ...] | None, bytes]]:
    """Yield number, values and hash of each row, in order. The values are None if they do not have the types of their columns."""
    table = AuditRow.__table__
    columns = [table.c[name] for name in COLUMNS]
    query = select(*columns, table.c.hash).order_by(table.c.number).limit(_BATCH_ROWS)
    after: int | None = None
    while True:
        page = query if after is None else query.where(table.c.number > after)
        try:
            rows = [tuple(row) for row in session.execute(page)]
        except _UNREADABLE:
            rows = []
            for number in session.scalars(page.with_only_columns(table.c.number)).all():
                rows.append(_read_row(session, query.where(table.c.number == number), number))
        for row in rows:
            yield row[0], row[:-1] if len(row) > 1 else None, row[-1] if isinstance(row[-1], bytes) else b""
        if len(rows) < _BATCH_ROWS:
            return
        after = rows[-1][0]


def _read_row(session: Session, query: Select[Any], number: int) -> tuple[Any, ...]:
    try:
        return tuple(session.execute(query).one())
    except _UNREADABLE:
        return (number,)


def _compare_copy(
    copied: Sequence[AnchorLine], anchors: Sequence[Sequence[AnchorLine]], verdict: Verdict, file: Path
) -> None:
    """Find lines of an anchor's copy that the anchor lacks. The anchor may have later lines that the copy has not received yet."""
    present = {line for lines in anchors for line in lines}
    missing = [line for line in copied if line not in present]
    if missing:
        first, last = missing[0], missing[-1]
        verdict.add(
            first.head.number,
            last.head.number,
            f"The anchor lacks line {first.line} of its copy, and {len(missing)} lines in all, up to row {last.head.number}: it was cut "
            "or changed.",
        )
    for name in {line.anchor for line in copied}:
        ends = max(line.line for line in copied if line.anchor == name)
        extra_lines = [line for line in present if line.anchor == name and line.line > ends]
        if extra_lines:
            verdict.remarks.append(
                f"The copy {file} ends {len(extra_lines)} lines before the anchor. The later lines are stored only on this computer."
            )


def _compare_chain(
    lines: Sequence[AnchorLine], verdict: Verdict, compared: _ComparedRows, name: str = "the anchor"
) -> None:
    """Compare the chain with these lines. ``name``: what the lines are called in a finding."""
    last = max((line.head.number for line in lines), default=0)
    end = verdict.head.number
    if last > end:
        contained = "it" if last == end + 1 else "them"
        message = f"{_describe_rows(end + 1, last)} missing from the end: {name} contains {contained}."
        verdict.add(end + 1, last, message)
    good = 0
    for line in sorted(lines, key=lambda line: line.head.number):
        if line.head.number > end:
            break
        if compared.hashes.get(line.head.number) != line.head.hash:
            first, number = good + 1, line.head.number
            verdict.add(
                first, number, f"{_describe_rows(first, number)} not what was anchored: the chain was recomputed there."
            )
            break
        good = line.head.number


def _check_anchor(lines: Sequence[AnchorLine], verdict: Verdict, compared: _ComparedRows) -> None:
    """Check that no line of the anchor is missing or changed."""
    name = lines[0].anchor if lines else ""
    before, head = 0, 0
    for line in lines:
        if line.line != before + 1 or line.anchor != name:
            verdict.add(
                head, line.head.number, f"After line {before} of the anchor, lines are missing or were changed."
            )
        before, head = line.line, line.head.number
    expected, number = compared.anchored.get(name, (0, 0))
    if expected > before:
        verdict.add(
            number, number, f"The anchor ends at line {before}; when row {number} was written, it had {expected}."
        )


def _describe_rows(first: int, last: int) -> str:
    return f"Row {first} is" if first == last else f"Rows {first} to {last} are"


def _export_line(values: Sequence[Any], stored: bytes) -> str:
    row = dict(zip(COLUMNS, values, strict=True)) | {"hash": stored.hex()}
    return json.dumps(row, default=str, ensure_ascii=False) + "\n"
