"""Tables of teachings and of the recordings that came out of them."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, LargeBinary, String, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.arrays import Column
from kata.database.base import Base, UtcDateTime

SAMPLE_COLUMNS = (Column("time_s", "s", 1e-6), Column("angle_deg", "deg", 1e-4))
"""``time_s`` (n,) from 0 at the first sample; ``angle_deg`` (n, 5) motor angles, axis order."""


class TeachingRow(Base):
    """A teaching that was begun: written before the device is asked, so that its journal always finds its patient."""

    __tablename__ = "teachings"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    name: Mapped[str] = mapped_column(String(100))
    side: Mapped[str] = mapped_column(String(8))
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)


class RecordingRow(Base):
    """One take. Name and note may change, what was recorded may not."""

    __tablename__ = "recordings"
    __table_args__ = (UniqueConstraint("teaching_id", "take"),)

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    teaching_id: Mapped[UUID] = mapped_column(ForeignKey("teachings.id"))
    take: Mapped[int]
    name: Mapped[str] = mapped_column(String(100))
    side: Mapped[str] = mapped_column(String(8))
    station: Mapped[str] = mapped_column(String(100))
    taught_at: Mapped[datetime] = mapped_column(UtcDateTime)
    duration_s: Mapped[float]
    rate_hz: Mapped[int]
    samples: Mapped[int]
    note: Mapped[str] = mapped_column(Text)
    archived_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class RecordingSamplesRow(Base):
    """The samples, apart from the record, so that a list never loads them."""

    __tablename__ = "recording_samples"

    recording_id: Mapped[UUID] = mapped_column(ForeignKey("recordings.id"), primary_key=True)
    data: Mapped[bytes] = mapped_column(LargeBinary)
    """:mod:`kata.database.arrays`, :data:`SAMPLE_COLUMNS`."""
