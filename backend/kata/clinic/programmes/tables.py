"""Tables of programmes."""

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, String, Text, UniqueConstraint, false
from sqlalchemy.orm import Mapped, mapped_column, relationship

from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.recordings.tables import RecordingRow
from kata.database.base import Base, UtcDateTime


class ProgrammeRow(Base):
    """A prescription within an episode. Its versions contain the recordings and settings."""

    __tablename__ = "programmes"
    # The clinic's outcomes read the programmes of thousands of episodes from the index alone.
    __table_args__ = (Index("ix_programmes_episode_id", "episode_id", "archived_at", "created_at", "name"),)

    id: Mapped[UUID] = mapped_column(primary_key=True)
    episode_id: Mapped[UUID] = mapped_column(ForeignKey("episodes.id"))
    name: Mapped[str] = mapped_column(String(100))
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
    archived_at: Mapped[datetime | None] = mapped_column(UtcDateTime)

    episode: Mapped[EpisodeRow] = relationship(lazy="joined", innerjoin=True)
    versions: Mapped[list["ProgrammeVersionRow"]] = relationship(
        order_by="ProgrammeVersionRow.number", back_populates="programme"
    )
    """The versions are loaded when they are accessed, because a list shows only the newest one."""


class ProgrammeVersionRow(Base):
    """A prescription that is valid from a date on. Rows are never changed."""

    __tablename__ = "programme_versions"
    __table_args__ = (UniqueConstraint("programme_id", "number"),)

    id: Mapped[UUID] = mapped_column(primary_key=True)
    programme_id: Mapped[UUID] = mapped_column(ForeignKey("programmes.id"))
    number: Mapped[int]
    """Number of the version, from 1."""
    made_at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    made_by: Mapped[str] = mapped_column(String(100))
    note: Mapped[str] = mapped_column(Text)
    timer_minutes: Mapped[float | None]
    """Minutes of playing in a session after which no further item is started."""
    sessions_per_week: Mapped[int | None]
    """Prescribed number of sessions per week; None if no number is prescribed."""

    programme: Mapped[ProgrammeRow] = relationship(back_populates="versions")
    items: Mapped[list["ProgrammeItemRow"]] = relationship(order_by="ProgrammeItemRow.position", lazy="selectin")


class ProgrammeItemRow(Base):
    """One recording of a version with its settings."""

    __tablename__ = "programme_items"

    version_id: Mapped[UUID] = mapped_column(ForeignKey("programme_versions.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """Position in the version, from 1."""
    recording_id: Mapped[UUID] = mapped_column(ForeignKey("recordings.id"))
    speed_percent: Mapped[float]
    repetitions: Mapped[int]
    pause_s: Mapped[float]
    range_percent: Mapped[float]
    resistance_level: Mapped[int] = mapped_column("load_level")
    """Resistance level, formerly named load level."""
    method: Mapped[str] = mapped_column(String(16))
    duration_s: Mapped[float] = mapped_column(default=0.0)
    """Duration of all repetitions with pauses. It is computed when the version is made, because neither recording nor version changes."""

    end_range: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    """Prescribed end-range time (:class:`kata.clinic.sessions.schemas.EndRangePrescription`); None if none is prescribed."""
    self_paced: Mapped[bool] = mapped_column(default=False, server_default=false())
    """True if the patient's effort sets the pace."""

    recording: Mapped[RecordingRow] = relationship(lazy="joined", innerjoin=True)
