"""Tables of the stations, and of what each has run with."""

from datetime import datetime

from sqlalchemy import ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class StationRow(Base):
    """An apparatus, as its service last knew it. Its name is its identity: a recording, a correction, a session bear it."""

    __tablename__ = "stations"

    name: Mapped[str] = mapped_column(String(100), primary_key=True)
    config: Mapped[str] = mapped_column(Text)
    """Its TOML."""
    registered_at: Mapped[datetime] = mapped_column(UtcDateTime)
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)


class StationVersionRow(Base):
    """Configuration and calibration that a station's device ran with from a moment on; never changed."""

    __tablename__ = "station_versions"

    station: Mapped[str] = mapped_column(ForeignKey("stations.name"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """From 1, without gaps."""
    config: Mapped[str] = mapped_column(Text)
    """TOML: how the apparatus is wired (bus, inputs), what it may do (limits), and its calibration (zero, direction and lag of each axis)."""
    software: Mapped[str] = mapped_column(String(32))
    """Version of Kata that wrote it down."""
    since: Mapped[datetime] = mapped_column(UtcDateTime)
