"""Tables of the stations and their configurations."""

from datetime import datetime

from sqlalchemy import ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


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
