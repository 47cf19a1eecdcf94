"""Tables of sums and changes from which the clinic's figures are read. They are derived
(:mod:`kata.clinic.statistics.derived_tables`) and name no patient.
"""

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, Index, LargeBinary, String
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class StationHourRow(Base):
    """The use of one station in the sessions that began within one part of an hour (:mod:`kata.clinic.statistics.parts`)."""

    __tablename__ = "station_hours"
    # A period's rows lie side by side in the table itself. An index would find each of them with another search.
    __table_args__ = {"sqlite_with_rowid": False}  # noqa: RUF012 - SQLAlchemy's own form

    hour: Mapped[datetime] = mapped_column(UtcDateTime, primary_key=True)
    """Beginning of the part."""
    station: Mapped[str] = mapped_column(String(100), primary_key=True)
    sessions: Mapped[int]
    playbacks: Mapped[int]
    stopped: Mapped[int]
    """Number of stopped playbacks."""
    played_s: Mapped[float]
    """Seconds on the path, summed over all playbacks."""
    repetitions: Mapped[int]
    compared: Mapped[int]
    """Number of playbacks with a tracking error of the whole motion."""
    left_out: Mapped[int] = mapped_column(default=0, server_default="0")
    """Number of playbacks whose tracking error is partial (:attr:`kata.clinic.sessions.tables.RunRow.partial`). The sums leave them out."""
    rmse_sum_deg: Mapped[float]
    rmse_square_sum_deg2: Mapped[float]
    """Sums of the worst motor's RMSE of the compared playbacks and of its square. They give mean and spread without reading the runs."""
    peak_deg: Mapped[float | None]
    """Largest error of the compared playbacks."""


class EpisodeOutcomeRow(Base):
    """First and last value of each measure in an episode of care."""

    __tablename__ = "episode_outcomes"
    # A period's episodes are found without reading the other rows.
    __table_args__ = (Index("ix_episode_outcomes_end_at", "end_at", "begin_at"),)

    episode_id: Mapped[UUID] = mapped_column(ForeignKey("episodes.id"), primary_key=True)
    begin_at: Mapped[datetime] = mapped_column(UtcDateTime)
    """Earliest time of the last assessments of the measures."""
    end_at: Mapped[datetime] = mapped_column(UtcDateTime)
    """Latest time of the last assessments of the measures."""
    changes: Mapped[bytes] = mapped_column(LargeBinary)
    """The changes of the measures (:mod:`kata.clinic.statistics.episode_changes`)."""
