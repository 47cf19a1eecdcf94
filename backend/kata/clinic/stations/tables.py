"""Tables of the stations and their configurations."""

from datetime import datetime
from typing import Any, Final

from sqlalchemy import ColumnElement, ForeignKey, String, Text, false, func, select
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime

SIMULATED_PORT: Final = "simulated"
"""Port in the stored configuration of a simulated apparatus."""


class StationRow(Base):
    """An apparatus in the state of its last start. Its name identifies it in recordings, corrections and sessions."""

    __tablename__ = "stations"

    name: Mapped[str] = mapped_column(String(100), primary_key=True)
    config: Mapped[str] = mapped_column(Text)
    """The configuration as TOML."""
    registered_at: Mapped[datetime] = mapped_column(UtcDateTime)
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)


class StationVersionRow(Base):
    """Configuration and calibration of a station from a time on. Never changed."""

    __tablename__ = "station_versions"

    station: Mapped[str] = mapped_column(ForeignKey("stations.name"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """From 1, without gaps."""
    config: Mapped[str] = mapped_column(Text)
    """TOML: wiring of the apparatus (bus, inputs), its limits, and its calibration (zero, direction and lag of each axis)."""
    software: Mapped[str] = mapped_column(String(32))
    """Version of Kata that stored it."""
    since: Mapped[datetime] = mapped_column(UtcDateTime)
    changed_by: Mapped[str] = mapped_column(String(100), server_default="")
    """Who imported it on the page; empty where the station's file was changed."""


def was_simulated(station: Any, at: Any) -> ColumnElement[bool]:
    """Return an SQL expression: true if the station was a simulated apparatus at a time, false also for an unregistered station."""
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
