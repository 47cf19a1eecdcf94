"""Every change that an attacker with the database, and perhaps the anchor, can make to the audit trail."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from random import Random
from typing import Any, Final, cast
from uuid import UUID, uuid4

from sqlalchemy import Table, bindparam, delete, insert, select, text, update
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.audit import chain
from kata.audit.anchor import Anchor, read
from kata.audit.chain import COLUMNS, Head, link
from kata.audit.entries import entry
from kata.audit.tables import AuditRow
from kata.audit.verify import Verdict, verify
from kata.database.engine import Database

TABLE: Final = cast(Table, AuditRow.__table__)
ALTERED: Final = (*COLUMNS[1:], "hash")
EVERY: Final = 20
"""Default number of rows between two lines of the anchor."""
_STAFF: Final = [Actor(UUID(int=n), UUID(int=100 + n), f"Person {n}", "therapist", frozenset()) for n in range(5)]


def filled(database: Database, file: Path, rows: int, every: int = EVERY) -> None:
    """Create a trail of this many rows, as services write it, with an anchor after the last."""
    anchor = Anchor(file)
    made = [
        entry(f"act_{n % 40}", "done", UUID(int=1000 + n % 300), f"recording {n}", {"n": n}, _STAFF[n % 5])
        for n in range(rows)
    ]
    for first in range(0, rows, every):
        with database.write() as session:
            head = chain.append(session, made[first : first + every], anchor.id, anchor.lines)
        anchor.add(head)
    anchor.close()


@dataclass(frozen=True, slots=True)
class Trick:
    """A change, and the rows that it affects."""

    name: str
    first: int
    last: int


@contextmanager
def guards_down(database: Database) -> Iterator[Session]:
    """Yield a session without protection, which is rolled back at the end."""
    on_file = database.file is not None
    with Session(database.writer) as session:
        for name in ("audit_grows", "audit_kept", "audit_kept_as_it_is" if on_file else "audit_kept_whole"):
            session.execute(text(f"DROP TRIGGER {name}" + ("" if on_file else " ON audit")))
        yield session
        session.rollback()


def tricks(rows: int, chance: Random, every: int = EVERY) -> Iterator[tuple[str, Callable[[Session, Path], Trick]]]:
    """Return one change of each kind, at random places."""

    def place() -> int:
        return chance.randint(1, rows)

    for column in ALTERED:
        yield f"altered {column}", lambda session, _, column=column: alter(session, place(), column)  # type: ignore[misc]
    yield "altered a text into bytes", lambda session, _: spoil(session, place())
    yield "altered and hashed again", lambda session, _: alter_and_hash(session, place())
    yield "altered, and the chain recalculated", lambda session, _: rewrite(session, place())
    yield "dropped a row", lambda session, _: drop(session, place(), 1)
    yield "dropped the first", lambda session, _: drop(session, 1, 1)
    yield "dropped some rows", lambda session, _: drop(session, min(place(), rows - 5), 5)
    yield "dropped, and the rest numbered and chained again", lambda session, _: drop_and_close(session, place())
    yield "swapped neighbours", lambda session, _: swap(session, *_pair(rows - 1, chance, 1))
    yield "swapped two", lambda session, _: swap(session, *_pair(rows - 7, chance, 7))
    yield "inserted a row, and the rest chained again", lambda session, _: slip_in(session, place())
    yield "cut the last off", lambda session, _: cut(session, rows, 1)
    yield "cut the tail off", lambda session, _: cut(session, rows, chance.randint(2, rows - 1))
    yield "cut everything off", lambda session, _: cut(session, rows, rows)
    yield "cut the anchor", lambda _, file: cut_anchor(file, chance.randint(2, rows // every - 1))
    yield "emptied the anchor", lambda _, file: cut_anchor(file, rows // every)
    yield "removed the anchor", lambda _, file: remove_anchor(file)
    yield "dropped a line of the anchor", lambda _, file: drop_line(file, chance.randint(1, rows // every - 1))
    for field in ("line", "anchor", "number", "hash"):
        yield (
            f"altered {field} in the anchor",
            lambda _, file, field=field: alter_line(  # type: ignore[misc]
                file, chance.randint(1, rows // every - 1), field
            ),
        )


def alter(session: Session, number: int, column: str) -> Trick:
    """Return another value that the column accepts."""
    value = session.execute(select(TABLE.c[column]).where(TABLE.c.number == number)).scalar_one()
    _set(session, number, **{column: _other(value)})
    return Trick(f"alter {column}", number, number)


def spoil(session: Session, number: int) -> Trick:
    """Return a value that our programs never write, where the database accepts it."""
    if session.get_bind().dialect.name == "sqlite":
        session.execute(text("UPDATE audit SET who = X'FF00', patient_id = 'nobody' WHERE number = :n"), {"n": number})
    else:
        _set(session, number, detail="{")
    return Trick("spoil", number, number)


def alter_and_hash(session: Session, number: int) -> Trick:
    """Change a row and its hash; then the next row's hash or the anchor does not fit."""
    alter(session, number, "who")
    _chain(session, number, number)
    return Trick("alter and hash", number, number + 1)


def rewrite(session: Session, number: int) -> Trick:
    """Change a row and recalculate all later hashes, so that the chain itself is correct."""
    alter(session, number, "who")
    _chain(session, number)
    return Trick("rewrite", number, number)


def drop(session: Session, number: int, count: int) -> Trick:
    """Delete rows."""
    session.execute(delete(TABLE).where(TABLE.c.number.between(number, number + count - 1)))
    return Trick("drop", number, number + count - 1)


def drop_and_close(session: Session, number: int) -> Trick:
    """Delete rows so that only the anchor shows it."""
    rows = _all(session, number + 1)
    session.execute(delete(TABLE).where(TABLE.c.number >= number))
    if rows:
        session.execute(insert(TABLE), [row | {"number": row["number"] - 1} for row in rows])
    _chain(session, number)
    return Trick("drop and close", number, number)


def swap(session: Session, one: int, other: int) -> Trick:
    """Exchange the contents of two rows, except their numbers."""
    of_one, of_other = (_all(session, number, number)[0] for number in (one, other))
    _set(session, one, **{name: value for name, value in of_other.items() if name != "number"})
    _set(session, other, **{name: value for name, value in of_one.items() if name != "number"})
    return Trick("swap", one, other)


def slip_in(session: Session, number: int) -> Trick:
    """Insert an invented row before the others."""
    rows = _all(session, number)
    session.execute(delete(TABLE).where(TABLE.c.number >= number))
    moved = [row | {"number": row["number"] + 1} for row in rows]
    session.execute(insert(TABLE), [rows[0] | {"who": "Somebody Else"}, *moved])
    _chain(session, number)
    return Trick("slip in", number, number)


def cut(session: Session, rows: int, count: int) -> Trick:
    """Cut off the end with the latest entries."""
    session.execute(delete(TABLE).where(TABLE.c.number > rows - count))
    return Trick("cut", rows - count + 1, rows)


def cut_anchor(file: Path, count: int) -> Trick:
    """Replace the anchor by an older copy."""
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join(lines[:-count]))
    return Trick("cut anchor", 0, 0)


def remove_anchor(file: Path) -> Trick:
    """Delete the anchor's file."""
    file.unlink()
    return Trick("remove anchor", 0, 0)


def drop_line(file: Path, line: int) -> Trick:
    """Delete one line without renumbering."""
    lines = file.read_bytes().splitlines(keepends=True)
    del lines[line - 1]
    file.write_bytes(b"".join(lines))
    return Trick("drop line", 0, 0)


def alter_line(file: Path, line: int, field: str) -> Trick:
    """Change one field of one line."""
    lines = file.read_bytes().splitlines()
    entry = json.loads(lines[line - 1])
    other: dict[str, Any] = {"hash": "0" * 64, "anchor": "0" * 32}
    entry[field] = other.get(field, entry[field] if isinstance(entry[field], str) else entry[field] + 1)
    lines[line - 1] = json.dumps(entry).encode()
    file.write_bytes(b"\n".join(lines) + b"\n")
    return Trick(f"alter line's {field}", 0, 0)


def judged(database: Database, file: Path, trick: Callable[[Session, Path], Trick]) -> tuple[Trick, Verdict]:
    """Apply a change, verify the trail, and roll the change back."""
    before = file.read_bytes()
    try:
        with guards_down(database) as session:
            played = trick(session, file)
            session.expire_all()
            return played, verify(session, [file])
    finally:
        file.write_bytes(before)


def last_line(file: Path) -> Head:
    """Return the last number in the anchor."""
    return read(file)[-1].head


def _pair(most: int, chance: Random, apart: int) -> tuple[int, int]:
    one = chance.randint(1, most)
    return one, one + apart


def _other(value: Any) -> Any:
    if isinstance(value, datetime):
        return value + timedelta(microseconds=1)
    if isinstance(value, UUID) or value is None:
        return uuid4()
    if isinstance(value, bytes):
        return bytes([value[0] ^ 1]) + value[1:]
    if isinstance(value, int):
        return value + 1
    return ("y" if value.startswith("x") else "x") + value[1:]


def _set(session: Session, number: int, **values: Any) -> None:
    session.execute(update(TABLE).where(TABLE.c.number == number).values(**values))


def _all(session: Session, first: int, last: int | None = None) -> list[dict[str, Any]]:
    query = select(TABLE).where(TABLE.c.number >= first).order_by(TABLE.c.number)
    if last is not None:
        query = query.where(TABLE.c.number <= last)
    return [dict(row) for row in session.execute(query).mappings()]


def _chain(session: Session, first: int, last: int | None = None) -> None:
    """Recalculate the hashes from ``first`` on."""
    found = session.scalar(select(TABLE.c.hash).where(TABLE.c.number == first - 1))
    before = found or chain.NOTHING.hash
    anew = []
    for row in _all(session, first, last):
        before = link(before, [row[name] for name in COLUMNS])
        anew.append({"at_number": row["number"], "made": before})
    if anew:
        session.execute(
            update(TABLE).where(TABLE.c.number == bindparam("at_number")).values(hash=bindparam("made")), anew
        )
