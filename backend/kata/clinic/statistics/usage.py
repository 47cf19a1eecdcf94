"""Use and tracking error of the stations, computed from the sums of each hour or part of an hour. Restricted records are counted, because
no patient is named.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from typing import Any, Final

from sqlalchemy import ColumnElement, distinct, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.sessions.tables import SessionStopRow
from kata.clinic.statistics import intervals, parts
from kata.clinic.statistics.intervals import SampleSums
from kata.clinic.statistics.local_days import local_day, local_week
from kata.clinic.statistics.schemas import (
    Period,
    StationDrift,
    StationTracking,
    StationUse,
    StopCount,
    Stops,
    TrackingQuality,
    Usage,
)
from kata.clinic.statistics.tables import StationHourRow

RECENT: Final = timedelta(weeks=4)
BEFORE: Final = timedelta(weeks=12)
"""The last four weeks are compared with this time before them. It contains some dozen playbacks, and is short enough to notice a drift
early.
"""
_COUNT_DEG: Final = 360 / 4096
"""One encoder count of a drive in degrees. The apparatus cannot measure a smaller change."""


_USE: Final = (
    StationHourRow.sessions,
    StationHourRow.playbacks,
    StationHourRow.stopped,
    StationHourRow.played_s,
    StationHourRow.repetitions,
)
_ERROR: Final = (StationHourRow.compared, StationHourRow.left_out, StationHourRow.rmse_sum_deg)


@dataclass(frozen=True)
class Span:
    """A period, the clinic's time zone, and the station (None: all stations)."""

    since: datetime
    until: datetime
    zone: tzinfo = UTC
    station: str | None = None

    def of_station(self, column: InstrumentedAttribute[str]) -> tuple[ColumnElement[bool], ...]:
        """Return the condition that a row belongs to the station."""
        # For the bare column, SQLite reads all events of the station from its index, and not only the alarms of the time.
        return () if self.station is None else (column.concat("") == self.station,)


def usage(session: Session, span: Span, by: Period) -> Usage:
    """Return the use of each station by day or week."""
    rows = [
        StationUse(
            begins_on=row.begins_on,
            station=row.station,
            sessions=row.sessions,
            playbacks=row.playbacks,
            stopped=row.stopped,
            hours=row.played_s / 3600,
            repetitions=row.repetitions,
        )
        for row in _sums(session, span, by, _USE)
        if row.sessions
    ]
    return Usage(rows=rows)


def tracking(session: Session, span: Span) -> TrackingQuality:
    """Return the tracking error of each station by week, and its change at the end of the period."""
    sums = list(_sums(session, span, "week", _ERROR))
    rows = [
        StationTracking(
            begins_on=row.begins_on,
            station=row.station,
            playbacks=row.compared,
            rmse_deg=row.rmse_sum_deg / row.compared,
            peak_deg=row.peak_deg,
        )
        for row in sums
        if row.compared
    ]
    recent = _samples(session, span, span.until - RECENT, span.until)
    before = _samples(session, span, span.until - RECENT - BEFORE, span.until - RECENT)
    stations = sorted(recent.keys() | before.keys())
    drift = [_drift(name, recent.get(name), before.get(name)) for name in stations]
    return TrackingQuality(rows=rows, drift=drift, left_out=sum(row.left_out for row in sums))


def stops(session: Session, span: Span) -> Stops:
    """Return the number of stopped sessions and of alarms by cause and station."""
    counts: dict[tuple[str, str], list[int]] = defaultdict(lambda: [0, 0])
    within = (
        SessionStopRow.started_at >= span.since,
        SessionStopRow.started_at < span.until,
        *span.of_station(SessionStopRow.station),
    )
    stopped = (
        select(SessionStopRow.code, SessionStopRow.station, func.count())
        .where(*within)
        .group_by(SessionStopRow.code, SessionStopRow.station)
    )
    alarms = (
        select(DeviceEventRow.code, DeviceEventRow.station, func.count())
        .where(DeviceEventRow.kind == "alarm", DeviceEventRow.at >= span.since, DeviceEventRow.at < span.until)
        .where(*span.of_station(DeviceEventRow.station))
        .group_by(DeviceEventRow.code, DeviceEventRow.station)
    )
    for place, query in enumerate((stopped, alarms)):
        for code, station, count in session.execute(query):
            counts[code, station][place] += count
    rows = [
        StopCount(code=code, station=station, sessions=sessions, alarms=alarmed)
        for (code, station), (sessions, alarmed) in counts.items()
    ]
    rows.sort(key=lambda row: (-row.sessions, -row.alarms, row.code, row.station))
    total = select(func.sum(StationHourRow.sessions)).where(*_within(span, span.since, span.until))
    stopped_sessions = select(func.count(distinct(SessionStopRow.session_id))).where(*within)
    return Stops(rows=rows, sessions=session.scalar(total) or 0, stopped_sessions=session.scalar(stopped_sessions) or 0)


def _sums(session: Session, span: Span, by: Period, columns: Sequence[InstrumentedAttribute[Any]]) -> Iterable[Any]:
    """Return the sums of these columns for each day or week and station, as rows in this order."""
    hour = StationHourRow.__table__.c.hour
    # Only stored hours are searched for changes of the offset, because a span may begin in the year 1.
    # SQLite reads an index's end for one of both, but the whole index for both at once.
    first, last = (session.scalar(select(end(hour))) for end in (func.min, func.max))
    since = max(span.since, first) if first else span.since
    until = min(span.until, last + parts.LONGEST) if first else span.since
    begin = local_day if by == "day" else local_week
    begins_on = begin(hour, since, until, span.zone).label("begins_on")
    sums = [func.sum(column).label(column.key) for column in columns]
    query = (
        select(begins_on, StationHourRow.station, *sums, func.max(StationHourRow.peak_deg).label("peak_deg"))
        .where(*_within(span, span.since, span.until))
        .group_by(begins_on, StationHourRow.station)
        .order_by(begins_on, StationHourRow.station)
    )
    return session.execute(query)


def _within(span: Span, since: datetime, until: datetime) -> Sequence[Any]:
    return [StationHourRow.hour >= since, StationHourRow.hour < until, *span.of_station(StationHourRow.station)]


def _samples(session: Session, span: Span, since: datetime, until: datetime) -> dict[str, SampleSums]:
    query = (
        select(
            StationHourRow.station,
            func.sum(StationHourRow.compared),
            func.sum(StationHourRow.rmse_sum_deg),
            func.sum(StationHourRow.rmse_square_sum_deg2),
        )
        .where(*_within(span, since, until), StationHourRow.compared > 0)
        .group_by(StationHourRow.station)
    )
    return {station: SampleSums(count, total, squares) for station, count, total, squares in session.execute(query)}


def _drift(station: str, recent: SampleSums | None, before: SampleSums | None) -> StationDrift:
    change = intervals.of_difference(recent, before) if recent and before else None
    return StationDrift(
        station=station,
        playbacks=recent.number if recent else 0,
        rmse_deg=recent.mean if recent else None,
        before_deg=before.mean if before else None,
        change_deg=change,
        drifting=change is not None and change.low > _COUNT_DEG,
    )
