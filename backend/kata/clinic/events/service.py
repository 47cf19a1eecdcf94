"""Read device events. The caller commits."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final
from uuid import UUID

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.auth.permissions import ROLE_PERMISSIONS
from kata.clinic.events.observer import ESTOP_TESTED
from kata.clinic.events.schemas import DeviceEvent, EventKind
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.restricted import service as restricted
from kata.pagination import Keyset

_NEWEST_FIRST: Final = Keyset(tuple[datetime, UUID], DeviceEventRow.at, DeviceEventRow.id, descending=True)
_LEFT_OPEN_AMONG: Final = 1000
"""Number of a station's newest events among which the alarms are that were open when its service ended."""


def end_left_open(session: Session, station: str, now: datetime) -> None:
    """End the alarms that were open when the station's service ended. The service calls this when it starts."""
    last = select(DeviceEventRow).where(DeviceEventRow.station == station).order_by(DeviceEventRow.at.desc())
    among = last.limit(_LEFT_OPEN_AMONG).subquery()
    left_open = select(among.c.id).where(among.c.kind == "alarm", among.c.ended_at.is_(None))
    session.execute(update(DeviceEventRow).where(DeviceEventRow.id.in_(left_open)).values(ended_at=now))


@dataclass(frozen=True)
class EventFilter:
    """A filter of events. None: do not filter by this field."""

    station: str | None = None
    session_id: UUID | None = None
    patient_id: UUID | None = None
    kind: EventKind | None = None
    code: str | None = None


def find(
    session: Session, event_filter: EventFilter, limit: int, after: str | None
) -> tuple[Sequence[DeviceEventRow], str | None]:
    """Return a page of events (newest first) and the next cursor.

    :raises ProblemError: 422 when ``after`` is not a valid cursor.
    """
    columns = (
        (DeviceEventRow.station, event_filter.station),
        (DeviceEventRow.session_id, event_filter.session_id),
        (DeviceEventRow.patient_id, event_filter.patient_id),
        (DeviceEventRow.kind, event_filter.kind),
        (DeviceEventRow.code, event_filter.code),
    )
    query = select(DeviceEventRow).where(*(column == value for column, value in columns if value is not None))
    rows = list(session.scalars(_NEWEST_FIRST.page(query, after, limit)))
    return _NEWEST_FIRST.cut(rows, limit, lambda row: (row.at, row.id))


def shown_to(session: Session, actor: Actor, rows: Sequence[DeviceEventRow]) -> list[DeviceEvent]:
    """Return the events for this user. Patient, session and run are left out if the user may not see the record."""
    hidden = restricted.hidden_among(session, actor, (row.patient_id for row in rows if row.patient_id))
    reads_records = "read_records" in ROLE_PERMISSIONS[actor.role]
    items = [DeviceEvent.model_validate(row) for row in rows]
    return [item if reads_records and item.patient_id not in hidden else item.without_patient() for item in items]


def estop_tested_at(session: Session, station: str, since: datetime) -> datetime | None:
    """Return the time at which the emergency stop was last pressed and released, or None if this did not happen since ``since``."""
    query = select(DeviceEventRow.at).where(
        DeviceEventRow.station == station, DeviceEventRow.at >= since, DeviceEventRow.code == ESTOP_TESTED
    )
    return session.scalars(query.order_by(DeviceEventRow.at.desc())).first()
