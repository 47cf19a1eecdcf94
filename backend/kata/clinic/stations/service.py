"""Read and write stations. The caller commits."""

from collections.abc import Sequence
from datetime import datetime

import msgspec
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.stations.tables import SIMULATED_PORT, StationRow, StationVersionRow, was_simulated
from kata.device.config import StationConfig, as_toml
from kata.errors import not_found
from kata.motion.axes import CANONICAL_SIDE


def register(
    session: Session, config: StationConfig, software: str, now: datetime, *, simulated: bool, changed_by: str = ""
) -> None:
    """Register a station whose service has started or whose file was imported. A changed configuration becomes a new version.

    Two values do not make a new version: the port of a simulated apparatus, which differs at every start, and the side to which the
    apparatus is set.
    """
    steady = msgspec.structs.replace(config, side=CANONICAL_SIDE, port=SIMULATED_PORT if simulated else config.port)
    toml = as_toml(steady)
    row = session.get(StationRow, config.name)
    if row is None:
        row = StationRow(name=config.name, registered_at=now)
        session.add(row)
    row.config = toml
    if not changed_by:
        row.started_at = now
    session.flush()
    newest = session.scalars(
        select(StationVersionRow)
        .where(StationVersionRow.station == config.name)
        .order_by(StationVersionRow.number.desc())
        .limit(1)
    ).first()
    if newest is None or newest.config != toml:
        number = newest.number + 1 if newest else 1
        session.add(
            StationVersionRow(
                station=config.name, number=number, config=toml, software=software, since=now, changed_by=changed_by
            )
        )


def is_simulated(session: Session, station: str, at: datetime) -> bool:
    """Return True if the station was a simulated apparatus at this time. Return False for a station that is not registered."""
    return bool(session.scalar(select(was_simulated(station, at))))


def registered(session: Session) -> Sequence[tuple[StationRow, int]]:
    """Return every station by name with the number of its newest version, or 0 for a station that an older Kata registered."""
    newest = select(StationVersionRow.station, func.max(StationVersionRow.number).label("number"))
    newest_of = newest.group_by(StationVersionRow.station).subquery()
    query = select(StationRow, func.coalesce(newest_of.c.number, 0)).outerjoin(
        newest_of, newest_of.c.station == StationRow.name
    )
    return [(row, number) for row, number in session.execute(query.order_by(StationRow.name))]


def version(session: Session, station: str, number: int | None) -> StationVersionRow:
    """Return a version of a station's configuration, by default the newest.

    :raises ProblemError: 404 when there is no such version.
    """
    query = select(StationVersionRow).where(StationVersionRow.station == station)
    if number is not None:
        query = query.where(StationVersionRow.number == number)
    row = session.scalars(query.order_by(StationVersionRow.number.desc()).limit(1)).first()
    if row is None:
        raise not_found(texts.STATION_NOT_FOUND)
    return row


def versions(session: Session, station: str) -> Sequence[StationVersionRow]:
    """Return the versions of a station's configuration, newest first.

    :raises ProblemError: 404 when there is no such station.
    """
    if session.get(StationRow, station) is None:
        raise not_found(texts.STATION_NOT_FOUND)
    query = select(StationVersionRow).where(StationVersionRow.station == station)
    return session.scalars(query.order_by(StationVersionRow.number.desc())).all()
