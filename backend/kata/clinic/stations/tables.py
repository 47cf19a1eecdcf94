"""Tables of the stations and their configurations."""

from datetime import datetime
from typing import Any, Final

from sqlalchemy import ColumnElement, ForeignKey, String, Text, false, func, select
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime

SIMULATED_PORT: Final = "simulated"
"""Port in the stored configuration of a simulated apparatus."""


class StationRow(Base):
    """An apparatus as it was at its last start. Recordings, corrections and sessions refer to it by name."""

    __tablename__ = "stations"

    name: Mapped[str] = mapped_column(String(100), primary_key=True)
    config: Mapped[str] = mapped_column(Text)
    """Configuration as TOML."""
    registered_at: Mapped[datetime] = mapped_column(UtcDateTime)
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)


class StationVersionRow(Base):
    """Configuration and calibration of a station from a given time on. Rows are never changed."""

    __tablename__ = "station_versions"

    station: Mapped[str] = mapped_column(ForeignKey("stations.name"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """Number of the version, from 1 without gaps."""
    config: Mapped[str] = mapped_column(Text)
    """Configuration as TOML: wiring of the apparatus (bus, inputs), its limits, and its calibration (zero, direction and lag of each
    axis).
    """
    software: Mapped[str] = mapped_column(String(32))
    """Version of Kata that stored the row."""
    since: Mapped[datetime] = mapped_column(UtcDateTime)
    changed_by: Mapped[str] = mapped_column(String(100), server_default="")
    """User who imported it on the page; empty if the station's file was edited."""


def was_simulated(station: Any, at: Any) -> ColumnElement[bool]:
    """Return an SQL expression that is true if the station was a simulated apparatus at a given time. It is false for an unregistered
    station.
    """
    simulated = StationVersionRow.config.contains(f'\nport = "{SIMULATED_PORT}"\n')
    newest = (
        select(simulated)
        .where(StationVersionRow.station == station, StationVersionRow.since <= at)
        .order_by(StationVersionRow.number.desc())
        .limit(1)
        .correlate_except(StationVersionRow)
        .scalar_subquery()
    )
    return func.coalesce(newest, false())
