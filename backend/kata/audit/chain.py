"""The chain: each row of the audit trail carries a hash over itself and the row before, so that none can be changed alone."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from hashlib import sha256
from typing import Any, Final, Literal
from uuid import UUID

from sqlalchemy import insert, select, text
from sqlalchemy.orm import Session

from kata.audit.tables import AuditRow

Outcome = Literal["done", "refused", "failed"]

COLUMNS: Final = (
    "number", "at", "account_id", "who", "role", "sign_in_id", "address", "action", "outcome", "patient_id", "subject",
    "station", "detail", "anchor", "anchored",
)  # fmt: skip
"""What a hash is over, in this order."""
_WRITTEN: Final = json.JSONEncoder(separators=(",", ":"))
_LOCK: Final = 0x6B617461
"""Of PostgreSQL's advisory locks; others in the same database are nobody's but Kata's."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A row of the trail that has no place in the chain yet."""

    at: datetime
    account_id: UUID | None
    who: str
    role: str
    sign_in_id: UUID | None
    address: str
    action: str
    outcome: Outcome
    patient_id: UUID | None
    subject: str
    station: str
    detail: str


@dataclass(frozen=True, slots=True)
class Head:
    """Where the chain ends: number and hash of its last row."""

    number: int
    hash: bytes


NOTHING: Final = Head(0, bytes(32))
"""What the first row follows."""


def link(before: bytes, values: Sequence[Any]) -> bytes:
    """The hash of a row with these values, as :data:`COLUMNS` has them, behind the row of hash ``before``.

    :raises TypeError: for a value that no row of ours has.
    """
    return sha256(before + _WRITTEN.encode([_plain(value) for value in values]).encode()).digest()


def head(session: Session) -> Head:
    """Where the chain ends now."""
    query = select(AuditRow.number, AuditRow.hash).order_by(AuditRow.number.desc()).limit(1)
    found = session.execute(query).one_or_none()
    return Head(found.number, found.hash) if found else NOTHING


def wait_for_others(session: Session) -> None:
    """Every writer that was about to commit has done so, or is gone, and what they wrote this session sees. On SQLite there is none."""
    if session.get_bind().dialect.name == "postgresql":
        # Given back at once: whoever kept it, and then waited for a row, could wait for somebody who waits here.
        with session.begin_nested() as turn:
            _lock(session)
            turn.rollback()


def append(session: Session, entries: Sequence[Entry], anchor: str, anchored: int) -> Head:
    """Write ``entries`` behind the last row, and say where the chain ends with them; it is final with the commit.

    The last thing before a commit: on PostgreSQL every other writer waits here until then, on SQLite there is none.
    ``anchor``, ``anchored``: which anchor this service has, and how many lines it is known to hold.
    """
    if session.get_bind().dialect.name == "postgresql":
        _lock(session)
    last = head(session)
    rows = []
    for one in entries:
        values = asdict(one) | {"number": last.number + 1, "anchor": anchor, "anchored": anchored}
        last = Head(last.number + 1, link(last.hash, [values[name] for name in COLUMNS]))
        rows.append(values | {"hash": last.hash})
    session.execute(insert(AuditRow), rows)
    return last


def _lock(session: Session) -> None:
    session.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK})


def _plain(value: Any) -> str | int | None:
    if value is None or type(value) in (str, int):
        return value  # type: ignore[no-any-return]
    if isinstance(value, datetime):
        return value.astimezone(UTC).isoformat(timespec="microseconds")
    if isinstance(value, UUID):
        return value.hex
    raise TypeError(f"{type(value).__name__} has no place in the trail")
