"""Store and read commissionings. The caller commits."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final
from uuid import UUID, uuid4

import msgspec
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.commissionings.schemas import CommissioningKind, CommissioningSignature
from kata.clinic.commissionings.tables import CommissioningRow
from kata.commissioning.record import (
    CHECKED,
    CommissioningRecord,
    RecordedStep,
    check_parts,
    commissioning_part,
    own_steps,
    signature_state,
)
from kata.errors import not_found
from kata.motion.axes import AXES
from kata.pagination import Keyset

_NEWEST_FIRST: Final = Keyset(tuple[datetime, UUID], CommissioningRow.ended_at, CommissioningRow.id, descending=True)
_FIGURES: Final = {
    "friction deg": "friction_deg",
    "play deg": "play_deg",
    "lag s": "lag_s",
    "temperature_c": "temperature_c",
    "voltage_v": "voltage_v",
    "damaged_answers_percent": "damaged_answers_percent",
}
"""Name of the figure by name of the value in the record."""


@dataclass(frozen=True)
class FinishedCommissioning:
    """A commissioning or check that has ended. ``record`` contains only its own steps and those that it took over."""

    kind: CommissioningKind
    done_by: str
    steps: tuple[RecordedStep, ...]
    """Its own steps."""
    record: CommissioningRecord


def finished(record: CommissioningRecord) -> Iterator[FinishedCommissioning]:
    """Yield the commissioning of a record if it has passed, and each finished periodic check."""
    if not record.passed:
        return
    yield _entry("full", commissioning_part(record))
    for part in check_parts(record):
        if part.checks[-1].step == CHECKED[-1] or not part.checks[-1].passed:
            yield _entry("check", part)


def _entry(kind: CommissioningKind, part: CommissioningRecord) -> FinishedCommissioning:
    if kind == "full":
        return FinishedCommissioning(kind, part.by, own_steps(part), part)
    return FinishedCommissioning(kind, part.checks[0].by, part.checks, part)


def add(session: Session, station: str, entry: FinishedCommissioning) -> bool:
    """Store a commissioning or check. Return False if it is already stored."""
    began_at = datetime.fromisoformat(entry.steps[0].began_at)
    stored = select(CommissioningRow.id).where(
        CommissioningRow.station == station, CommissioningRow.kind == entry.kind, CommissioningRow.began_at == began_at
    )
    if session.scalar(stored) is not None:
        return False
    record = msgspec.json.encode(entry.record).decode()
    session.add(CommissioningRow(id=uuid4(), station=station, kind=entry.kind, record=record, **_columns(entry)))
    return True


def _columns(entry: FinishedCommissioning) -> dict[str, Any]:
    """Return the columns that repeat values of the record."""
    last = entry.steps[-1]
    return {
        "done_by": entry.done_by,
        "software": entry.record.kata,
        "began_at": datetime.fromisoformat(entry.steps[0].began_at),
        "ended_at": datetime.fromisoformat(last.ended_at),
        "passed": last.passed,
        "fault": last.fault,
        "fault_key": msgspec.to_builtins(last.fault_key),
        "digest": entry.record.digest,
        "configuration_digest": entry.record.configuration_digest,
        "figures": _figures(entry.steps),
    }


def _figures(steps: Sequence[RecordedStep]) -> list[dict[str, Any]]:
    """Return the newest figures of each motor."""
    of_motor: dict[int, dict[str, Any]] = {motor: {"motor": motor} for motor in AXES}
    for step in steps:
        for value in step.values:
            if value.name in _FIGURES and value.motor in of_motor:
                of_motor[value.motor][_FIGURES[value.name]] = value.after
    return [of_motor[motor] for motor in AXES]


def find(
    session: Session, station: str, limit: int, after: str | None
) -> tuple[Sequence[CommissioningRow], str | None]:
    """Return a page of a station's commissionings and checks (newest first) and the next cursor.

    :raises ProblemError: 422 when ``after`` is not a valid cursor.
    """
    query = select(CommissioningRow).where(CommissioningRow.station == station)
    rows = list(session.scalars(_NEWEST_FIRST.page(query, after, limit)))
    return _NEWEST_FIRST.cut(rows, limit, lambda row: (row.ended_at, row.id))


def get(session: Session, commissioning_id: UUID) -> CommissioningRow:
    """Return a commissioning or check.

    :raises ProblemError: 404 when it does not exist.
    """
    row = session.get(CommissioningRow, commissioning_id)
    if row is None:
        raise not_found(texts.COMMISSIONING_NOT_FOUND)
    return row


def record_of(row: CommissioningRow) -> CommissioningRecord:
    """Return the stored record."""
    return msgspec.json.decode(row.record, type=CommissioningRecord)


def verify(row: CommissioningRow) -> CommissioningSignature:
    """Return whether record and columns are as the station has signed them. Kata never changes a row."""
    record = record_of(row)
    state = signature_state(row.record.encode())
    changed = ["record"] if state == "invalid" else _changed_columns(row, record)
    return CommissioningSignature(state="changed" if changed else state, changed=changed, public_key=record.public_key)


def _changed_columns(row: CommissioningRow, record: CommissioningRecord) -> list[str]:
    columns = _columns(_entry("full" if row.kind == "full" else "check", record))
    return [name for name, value in columns.items() if getattr(row, name) != value]


def not_verified(session: Session, station: str, public_key: str) -> Iterator[str]:
    """Yield a sentence about each row of a station that was changed, or signed with another key than the station's.

    :param public_key: the station's key; empty if it is unknown.
    """
    for row in session.scalars(select(CommissioningRow).where(CommissioningRow.station == station)):
        signature = verify(row)
        if signature.changed:
            yield f"the commissioning record {row.id} was changed in the database: {', '.join(signature.changed)}"
        elif signature.public_key and public_key and signature.public_key != public_key:
            yield f"the commissioning record {row.id} is signed with another key than this station's: {signature.public_key}"


def steps_of(row: CommissioningRow) -> tuple[RecordedStep, ...]:
    """Return the steps of a commissioning or check."""
    record = record_of(row)
    return record.steps if row.kind == "full" else record.checks
