"""Refreshes the derived tables. Every commit that changes sessions, runs or assessments refreshes the rows that depend on them.

:meth:`kata.database.engine.Database.write` calls :class:`DerivedTablesHook`. Every program that writes such records registers it: the
service in ``api/set_up.py``, and ``kata seed``.

A row is computed from the records each time, so a repeated import changes nothing. A failure is logged and never fails the commit, because
treatment records are more important than figures. The next change of the same hour or episode corrects the row.
"""

import logging
from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any, Final, TypedDict
from uuid import UUID

from sqlalchemy import Select, case, delete, event, func, inspect, select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.clinic.statistics import episode_changes, parts
from kata.clinic.statistics.measures import MEASURES
from kata.clinic.statistics.tables import EpisodeOutcomeRow, StationHourRow
from kata.database.base import Base
from kata.database.engine import Database

log = logging.getLogger(__name__)

_STALE: Final = "statistics"
"""Key of the changed records in ``Session.info``."""
_NOT_PLAYED: Final = ("loaded", "unloaded", "running")
_OF_SESSION: Final = ("station", "started_at", "run_count")


class _Stale(TypedDict):
    hours: set[tuple[str, datetime]]
    sessions: set[UUID]
    episodes: set[UUID]


class DerivedTablesHook:
    """Hook that refreshes the derived rows in the transaction that makes them stale. Each :class:`Database` that writes
    records has one.
    """

    def __init__(self, database: Database) -> None:
        """Register as the database's hook for derived rows."""
        database.derived_hook = self

    def began(self, session: Session) -> None:
        """Start to collect the session's changes."""
        session.info[_STALE] = _Stale(hours=set(), sessions=set(), episodes=set())
        event.listen(session, "after_flush", _collect)

    def about_to_commit(self, session: Session) -> None:
        """Refresh the rows that the session has made stale. A failure is logged, and the session's other changes are committed."""
        stale: _Stale = session.info.pop(_STALE)
        event.remove(session, "after_flush", _collect)
        try:
            with session.begin_nested():
                refresh(session, stale["hours"], stale["sessions"], stale["episodes"])
        except SQLAlchemyError as error:
            log.warning("figures of the clinic were not updated: %s", error)

    def committed(self, session: Session) -> None:
        """Do nothing, because all work is done before the commit."""


def _collect(session: Session, _: object) -> None:
    """Store which derived rows a flush makes stale."""
    stale: _Stale = session.info[_STALE]
    for row in (*session.new, *session.dirty, *session.deleted):
        if isinstance(row, SessionRow):
            if row in session.new or row in session.deleted or _changes(row, _OF_SESSION):
                stale["hours"].update(_hours_of(row))
        elif isinstance(row, RunRow):
            stale["sessions"].add(row.session_id)
        elif isinstance(row, AssessmentRow):
            stale["episodes"].add(row.episode_id)


def refresh(session: Session, hours: set[tuple[str, datetime]], sessions: set[UUID], episodes: set[UUID]) -> None:
    """Compute the rows of these stations and parts of hours, of those of these sessions, and of these episodes. The caller commits."""
    if sessions:
        starts = select(SessionRow.station, SessionRow.started_at).where(SessionRow.id.in_(sessions))
        hours = hours | {(station, parts.begin_of(at)) for station, at in session.execute(starts)}
    # Rows are written in a fixed order, so that two services do not wait for each other's rows.
    for station, hour in sorted(hours):
        if station:
            upsert(session, StationHourRow, [dict(_sums_of(session, station, hour))])
    for episode_id in sorted(episodes, key=str):
        _refresh_episode(session, episode_id)


def upsert(session: Session, table: type[Base], rows: list[dict[str, Any]]) -> None:
    """Insert rows or replace those with the same key."""
    if not rows:
        return
    target: Any = table.__table__
    insert = (sqlite if session.get_bind().dialect.name == "sqlite" else postgresql).insert
    statement = insert(target)
    keys = [column.name for column in target.primary_key]
    replaced = {column.name: statement.excluded[column.name] for column in target.columns if column.name not in keys}
    session.connection().execute(statement.on_conflict_do_update(index_elements=keys, set_=replaced), rows)


def _sums_of(session: Session, station: str, hour: datetime) -> Mapping[str, Any]:
    sums = session.execute(_sums(station, hour)).mappings().one()
    return {"hour": hour, "station": station} | dict(sums)


def _sums(station: str, hour: datetime) -> Select[Any]:
    played = RunRow.outcome.not_in(_NOT_PLAYED)
    rmse = case((played, RunRow.worst_rmse_deg))
    moved = RunRow.samples.is_not(None) | RunRow.compared_percent.is_not(None)
    return (
        select(
            func.count(SessionRow.id.distinct()).label("sessions"),
            func.count(case((played, RunRow.id))).label("playbacks"),
            func.count(case((RunRow.outcome == "stopped", RunRow.id))).label("stopped"),
            func.coalesce(func.sum(case((played, RunRow.played_s))), 0.0).label("played_s"),
            func.coalesce(func.sum(case((played, RunRow.repetitions_done))), 0).label("repetitions"),
            func.count(rmse).label("compared"),
            func.count(case((played & moved & RunRow.worst_rmse_deg.is_(None), RunRow.id))).label("left_out"),
            func.coalesce(func.sum(rmse), 0.0).label("rmse_sum_deg"),
            func.coalesce(func.sum(rmse * rmse), 0.0).label("rmse_square_sum_deg2"),
            func.max(case((played, RunRow.worst_peak_deg))).label("peak_deg"),
        )
        .select_from(SessionRow)
        .outerjoin(RunRow, RunRow.session_id == SessionRow.id)
        .where(SessionRow.station == station, SessionRow.started_at >= hour, SessionRow.started_at < parts.end_of(hour))
        .where(SessionRow.run_count > 0)
    )


def _refresh_episode(session: Session, episode_id: UUID) -> None:
    side = session.scalar(select(EpisodeRow.side).where(EpisodeRow.id == episode_id))
    if side is None:
        return
    assessed = (
        select(AssessmentRow.id, AssessmentRow.assessed_at, AssessmentRow.spadi_score, AssessmentRow.pain_average)
        .where(AssessmentRow.episode_id == episode_id, AssessmentRow.withdrawn_at.is_(None))
        .order_by(AssessmentRow.assessed_at, AssessmentRow.id)
    )
    values: dict[str, list[tuple[datetime, float]]] = {measure: [] for measure in MEASURES}
    at_of = {}
    for assessment_id, at, score, pain in session.execute(assessed):
        at_of[assessment_id] = at
        for measure, value in (("spadi", score), ("pain", pain)):
            if value is not None:
                values[measure].append((at, float(value)))
    measured = select(RomRow.assessment_id, RomRow.motion, RomRow.position, RomRow.angle_deg).where(
        RomRow.assessment_id.in_(at_of), RomRow.side == side, RomRow.kind == "passive"
    )
    names = {measure.motion: name for name, measure in MEASURES.items() if measure.motion}
    for assessment_id, motion, position, angle_deg in session.execute(measured):
        if (motion, position) in names:
            values[names[motion, position]].append((at_of[assessment_id], angle_deg))
    ordered = {measure: sorted(points) for measure, points in values.items() if points}
    if ordered:
        begin_at, end_at = episode_changes.ends(ordered)
        row = {
            "episode_id": episode_id, "begin_at": begin_at, "end_at": end_at, "changes": episode_changes.pack(ordered),
        }  # fmt: skip
        upsert(session, EpisodeOutcomeRow, [row])
    else:
        session.connection().execute(delete(EpisodeOutcomeRow).where(EpisodeOutcomeRow.episode_id == episode_id))


def _changes(row: Any, names: tuple[str, ...]) -> bool:
    attributes = inspect(row).attrs
    return any(attributes[name].history.has_changes() for name in names)


def _hours_of(row: SessionRow) -> Iterator[tuple[str, datetime]]:
    """Yield the station hour of a session, and the one to which it belonged before a change."""
    attributes = inspect(row).attrs
    stations = {row.station, *(attributes.station.history.deleted or ())}
    for moment in {row.started_at, *(attributes.started_at.history.deleted or ())}:
        yield from ((station, parts.begin_of(moment)) for station in stations if station)
