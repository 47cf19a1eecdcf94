"""The hash chain. Each row of the audit trail contains a hash of itself and the previous row, so no row can be changed alone."""

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

AuditOutcome = Literal["done", "refused", "failed"]

COLUMNS: Final = (
    "number", "at", "account_id", "who", "role", "sign_in_id", "address", "action", "outcome", "patient_id", "subject",
    "station", "detail", "anchor", "anchored",
)  # fmt: skip
"""The hashed columns, in the order in which they are hashed."""
_ENCODER: Final = json.JSONEncoder(separators=(",", ":"))
_LOCK_KEY: Final = 0x6B617461
"""Key of PostgreSQL's advisory lock. Only Kata uses advisory locks in this database."""


@dataclass(frozen=True, slots=True)
class Entry:
    """An audit entry without a place in the chain. Columns and spools store the fields by name, so the names must not change."""

    at: datetime
    account_id: UUID | None
    who: str
    role: str
    sign_in_id: UUID | None
    """Id of the login session."""
    address: str
    action: str
    outcome: AuditOutcome
    patient_id: UUID | None
    subject: str
    station: str
    detail: str


@dataclass(frozen=True, slots=True)
class Head:
    """The head of the chain: number and hash of its last row."""

    number: int
    hash: bytes


NOTHING: Final = Head(0, bytes(32))
"""The head of an empty chain."""


def link(before: bytes, values: Sequence[Any]) -> bytes:
    """Return the hash of a row with these values, ordered as :data:`COLUMNS`. ``before``: hash of the previous row.

    :raises TypeError: for a value of a type that no column has.
    """
    return sha256(before + _ENCODER.encode([_to_json_value(value) for value in values]).encode()).digest()


def head(session: Session) -> Head:
    """Return the present head of the chain."""
    query = select(AuditRow.number, AuditRow.hash).order_by(AuditRow.number.desc()).limit(1)
    row = session.execute(query).one_or_none()
    return Head(row.number, row.hash) if row else NOTHING


def wait_for_others(session: Session) -> None:
    """Wait until every writer that is about to commit has finished. This session then sees their rows. SQLite needs no wait, because it
    has only one writer.
    """
    if session.get_bind().dialect.name == "postgresql":
        # Release the lock at once. Waiting for a row while holding the lock could cause a deadlock.
        with session.begin_nested() as savepoint:
            _take_lock(session)
            savepoint.rollback()


def append(session: Session, entries: Sequence[Entry], anchor: str, anchored: int) -> Head:
    """Append entries to the chain and return the new head, which becomes final with the commit.

    Call it last before the commit, because on PostgreSQL all other writers wait here until the commit.

    :param anchor: id of this service's anchor.
    :param anchored: number of synced lines in that anchor.
    """
    if session.get_bind().dialect.name == "postgresql":
        _take_lock(session)
    last = head(session)
    rows = []
    for entry in entries:
        values = asdict(entry) | {"number": last.number + 1, "anchor": anchor, "anchored": anchored}
        last = Head(last.number + 1, link(last.hash, [values[name] for name in COLUMNS]))
        rows.append(values | {"hash": last.hash})
    session.execute(insert(AuditRow), rows)
    return last


def _take_lock(session: Session) -> None:
    session.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK_KEY})


def _to_json_value(value: Any) -> str | int | None:
    if value is None or type(value) in (str, int):
        return value  # type: ignore[no-any-return]
    if isinstance(value, datetime):
        return value.astimezone(UTC).isoformat(timespec="microseconds")
    if isinstance(value, UUID):
        return value.hex
    raise TypeError(f"the audit trail stores no {type(value).__name__}")
