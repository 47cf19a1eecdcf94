"""Read and write stations. The caller commits."""

from collections.abc import Sequence
from datetime import datetime
from typing import Final

import msgspec
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.stations.tables import StationRow, StationVersionRow
from kata.device.config import StationConfig, as_toml
from kata.errors import not_found
from kata.motion.axes import CANONICAL_SIDE

_SIMULATED: Final = "simulated"


def register(session: Session, config: StationConfig, software: str, now: datetime, *, simulated: bool) -> None:
    """Register a station whose service has started. A changed configuration becomes a new version.

    Two values make no version: the port of a simulated apparatus, which differs at every start, and the side that the apparatus is set to.
    """
    steady = msgspec.structs.replace(config, side=CANONICAL_SIDE, port=_SIMULATED if simulated else config.port)
    toml = as_toml(steady)
    row = session.get(StationRow, config.name)
    if row is None:
        row = StationRow(name=config.name, registered_at=now)
        session.add(row)
    row.config, row.started_at = toml, now
    session.flush()
    newest = session.scalars(
        select(StationVersionRow)
        .where(StationVersionRow.station == config.name)
        .order_by(StationVersionRow.number.desc())
        .limit(1)
    ).first()
    if newest is None or newest.config != toml:
        number = newest.number + 1 if newest else 1
        session.add(StationVersionRow(station=config.name, number=number, config=toml, software=software, since=now))


def registered(session: Session) -> Sequence[tuple[StationRow, int]]:
    """Return every station by name with the number of its newest version; 0 for a station that an older Kata registered."""
    newest = select(StationVersionRow.station, func.max(StationVersionRow.number).label("number"))
    newest_of = newest.group_by(StationVersionRow.station).subquery()
    query = select(StationRow, func.coalesce(newest_of.c.number, 0)).outerjoin(
        newest_of, newest_of.c.station == StationRow.name
    )
    return [(row, number) for row, number in session.execute(query.order_by(StationRow.name))]


def versions(session: Session, station: str) -> Sequence[StationVersionRow]:
    """Return the versions of a station's configuration, newest first.

    :raises ProblemError: 404 when there is no such station.
    """
    if session.get(StationRow, station) is None:
        raise not_found(texts.STATION_NOT_FOUND)
    query = select(StationVersionRow).where(StationVersionRow.station == station)
    return session.scalars(query.order_by(StationVersionRow.number.desc())).all()
