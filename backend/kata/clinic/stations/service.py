"""What is asked of stations. Commits nothing: the request does."""

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
    """A station's service has started. What its device runs with is a new version, unless it is the newest's.

    Of a simulated apparatus the port is another one at each start, and which shoulder an apparatus stands for is nobody's
    configuration: neither makes a version.
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
    """Every station by name, and the number of its newest version; 0 of one that an older Kata has registered."""
    newest = select(StationVersionRow.station, func.max(StationVersionRow.number).label("number"))
    newest_of = newest.group_by(StationVersionRow.station).subquery()
    query = select(StationRow, func.coalesce(newest_of.c.number, 0)).outerjoin(
        newest_of, newest_of.c.station == StationRow.name
    )
    return [(row, number) for row, number in session.execute(query.order_by(StationRow.name))]


def versions(session: Session, station: str) -> Sequence[StationVersionRow]:
    """What it has run with, the newest first.

    :raises ProblemError: 404 when there is no such station.
    """
    if session.get(StationRow, station) is None:
        raise not_found(texts.STATION_NOT_FOUND)
    query = select(StationVersionRow).where(StationVersionRow.station == station)
    return session.scalars(query.order_by(StationVersionRow.number.desc())).all()
