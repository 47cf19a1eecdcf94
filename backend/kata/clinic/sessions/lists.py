"""Lists of sessions, newest first, filtered by patient, time, therapist, station and cause of a stop.

A list contains the columns of the session's own row and loads no runs. A page is read in constant time from an index: of stop causes, of
patient, therapist or station, or of time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final
from uuid import UUID

from pydantic import Field
from sqlalchemy import CTE, ColumnElement, Select, Subquery, func, select
from sqlalchemy.orm import InstrumentedAttribute
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.patients.tables import PatientRow
from kata.clinic.sessions.schemas import SessionPatient
from kata.clinic.sessions.tables import SessionRow, SessionStopRow
from kata.pagination import Keyset
from kata.types import Moment, Schema

_MOST_OPTIONS: Final = 500


class SessionSummary(Schema):
    """A session in a list."""

    id: UUID
    patient: SessionPatient
    episode_id: UUID | None = Field(description="Episode of care of the treated shoulder; null without an episode.")
    started_at: Moment
    ended_at: Moment | None
    therapist: str = Field(description="Name of the therapist; empty if unknown.")
    station: str = Field(description="Empty if nothing was played, and for sessions of versions that did not store it.")
    runs: int = Field(ge=0, description="Number of runs.")
    simulated: bool = Field(
        False, description="True if the apparatus was simulated, so that its measured values are invented."
    )
    stops: int = Field(ge=0, description="Number of stopped runs.")
    signed_at: Moment | None = Field(description="Null until the note is signed.")


class SessionFilterOptions(Schema):
    """Values by which sessions can be filtered."""

    therapists: list[str]
    stations: list[str]
    stops: list[str] = Field(description="Codes of the causes that have stopped a run.", examples=[["estop_pressed"]])


@dataclass(frozen=True)
class SessionFilter:
    """A filter of sessions. None: do not filter by this field."""

    patient_id: UUID | None = None
    since: datetime | None = None
    """Only sessions that started at this time or later."""
    until: datetime | None = None
    """Only sessions that started before this time."""
    therapist: str | None = None
    station: str | None = None
    stop: str | None = None
    unsigned: bool = False
    """Only sessions that have ended and whose note is not signed."""
    hidden: Select[UUID] | None = None
    """Query of the ids of patients whose sessions are excluded."""


UNSIGNED: Final[tuple[ColumnElement[bool], ...]] = (
    SessionRow.signed_at.is_(None),
    SessionRow.ended_at.is_not(None),
    # Always true. SQLite reads the index of the few unsigned sessions because of it, and not that of all.
    SessionRow.therapist >= "",
)
"""Conditions of a session that has ended and whose note is not signed."""
_FEW_UNSIGNED: Final[CTE] = (
    select(SessionRow.id, SessionRow.patient_id, SessionRow.started_at, SessionRow.therapist, SessionRow.station)
    .where(*UNSIGNED)
    .cte("unsigned")
    .prefix_with("MATERIALIZED")
)
"""The unsigned sessions, read before any filter. With a filter, SQLite would read all sessions of a therapist, station or time."""
_BY_TIME: Final = Keyset(tuple[datetime, UUID], SessionRow.started_at, SessionRow.id, descending=True)
_BY_TIME_UNSIGNED: Final = Keyset(
    tuple[datetime, UUID], _FEW_UNSIGNED.c.started_at, _FEW_UNSIGNED.c.id, descending=True
)
_BY_STOP: Final = Keyset(tuple[datetime, UUID], SessionStopRow.started_at, SessionStopRow.session_id, descending=True)


def find(
    session: DatabaseSession, session_filter: SessionFilter, limit: int, after: str | None
) -> tuple[list[SessionSummary], str | None]:
    """Return a page of sessions (newest first) and the next cursor.

    :raises ProblemError: 422 when ``after`` is not a valid cursor.
    """
    # Find the ids first, which needs only an index; then load one page of rows.
    order = _order(session_filter)
    page_ids = order.page(_ids(session_filter), after, limit).subquery()
    rows = _rows(session, page_ids, SessionRow.started_at.desc(), SessionRow.id.desc())
    page_rows, further = order.cut(rows, limit, lambda row: (row.started_at, row.id))
    return [_summary(row) for row in page_rows], further


def summaries(session: DatabaseSession, ids: Select[Any], *order: ColumnElement[Any]) -> list[SessionSummary]:
    """Return the sessions whose ids this query selects, in this order."""
    return [_summary(row) for row in _rows(session, ids.subquery(), *order)]


def filter_options(session: DatabaseSession) -> SessionFilterOptions:
    """Return the therapists, stations and stop causes of the stored sessions."""
    return SessionFilterOptions(
        therapists=_distinct_values(session, SessionRow.therapist),
        stations=_distinct_values(session, SessionRow.station),
        stops=_distinct_values(session, SessionStopRow.code),
    )


_ROWS: Final = select(
    SessionRow.id, SessionRow.started_at, SessionRow.ended_at, SessionRow.therapist, SessionRow.station,
    SessionRow.simulated, SessionRow.run_count, SessionRow.stop_count, SessionRow.signed_at,
    SessionRow.patient_id, SessionRow.episode_id, PatientRow.name, PatientRow.clinic_number,
).join(PatientRow, PatientRow.id == SessionRow.patient_id)  # fmt: skip
"""Query of the columns of a list. Building it takes longer than running it for a page."""


def _rows(session: DatabaseSession, page_ids: Subquery, *order: ColumnElement[Any]) -> Sequence[Any]:
    return session.execute(_ROWS.join(page_ids, page_ids.c.id == SessionRow.id).order_by(*order)).all()


def _order(session_filter: SessionFilter) -> Keyset[tuple[datetime, UUID]]:
    if session_filter.stop is not None:
        return _BY_STOP
    return _BY_TIME_UNSIGNED if session_filter.unsigned else _BY_TIME


def _ids(session_filter: SessionFilter) -> Select[Any]:
    """Return the query of the ids without order and limit. The page adds both."""
    sessions = _FEW_UNSIGNED.c if session_filter.unsigned else SessionRow.__table__.c
    query: Select[Any]
    if session_filter.stop is None:
        columns = sessions
        query = select(sessions.id)
    else:
        columns = SessionStopRow.__table__.c
        query = select(columns.session_id.label("id")).where(columns.code == session_filter.stop)
        if session_filter.patient_id or session_filter.unsigned or session_filter.hidden is not None:
            query = query.where(sessions.id == columns.session_id)
    if session_filter.since:
        query = query.where(columns.started_at >= session_filter.since)
    if session_filter.until:
        query = query.where(columns.started_at < session_filter.until)
    if session_filter.hidden is not None:
        query = query.where(sessions.patient_id.not_in(session_filter.hidden))
    for column, value in (
        (sessions.patient_id, session_filter.patient_id),
        (columns.therapist, session_filter.therapist),
        (columns.station, session_filter.station),
    ):
        if value is not None:
            query = query.where(column == value)
    return query


def _summary(row: Any) -> SessionSummary:
    return SessionSummary(
        id=row.id,
        patient=SessionPatient(id=row.patient_id, name=row.name, clinic_number=row.clinic_number),
        episode_id=row.episode_id,
        started_at=row.started_at,
        ended_at=row.ended_at,
        therapist=row.therapist,
        station=row.station,
        simulated=row.simulated,
        runs=row.run_count,
        stops=row.stop_count,
        signed_at=row.signed_at,
    )


def _distinct_values(session: DatabaseSession, column: InstrumentedAttribute[str]) -> list[str]:
    """Return the distinct non-empty values of an indexed column. The query jumps from value to value, so that it need not read every
    row.
    """
    values = select(func.min(column).label("value")).where(column > "").cte(recursive=True)
    following = select(func.min(column)).where(column > values.c.value).scalar_subquery()
    values = values.union_all(select(following).where(values.c.value.is_not(None)))
    return list(session.scalars(select(values.c.value).where(values.c.value.is_not(None)).limit(_MOST_OPTIONS)))
