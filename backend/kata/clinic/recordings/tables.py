"""Tables of teachings and recordings."""

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.arrays import SampleColumn
from kata.database.base import Base, UtcDateTime, utc_now
from kata.database.samples import SampleBlockColumns, SamplesColumns, SampleTables

RECORDING_COLUMNS = (SampleColumn("time_s", "s", 1e-6), SampleColumn("angle_deg", "deg", 1e-4, in_encoder_counts=True))
"""``time_s`` (n,) from 0 at the first sample; ``angle_deg`` (n, 5) motor angles in axis order."""


class TeachingRow(Base):
    """A teaching. Its row is written before the device starts, so that the import of the journal always finds the patient."""

    __tablename__ = "teachings"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    name: Mapped[str] = mapped_column(String(100))
    side: Mapped[str] = mapped_column(String(8))
    taught_by: Mapped[str] = mapped_column(String(100), default="")
    fixtures: Mapped[list[str]] = mapped_column(JSON, default=list)
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)


class RecordingRow(Base):
    """A recording that was taught, derived or imported. Name and note may change, samples never do.

    A taught take has ``teaching_id`` and ``take``, a derived recording has ``parent_id``, and an imported recording has neither.
    """

    __tablename__ = "recordings"
    __table_args__ = (UniqueConstraint("teaching_id", "take"),)

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    teaching_id: Mapped[UUID | None] = mapped_column(ForeignKey("teachings.id"))
    take: Mapped[int | None]
    parent_id: Mapped[UUID | None] = mapped_column(ForeignKey("recordings.id"))
    done: Mapped[list[str]] = mapped_column(JSON, default=list)
    """Texts of all edits in order. The last edit was applied to the parent."""
    done_keys: Mapped[list[dict[str, Any] | None] | None] = mapped_column(JSON(none_as_null=True))
    """Code and parameters of each text in ``done``. An edit from before migration 0009 has None; the whole value is None if all edits
    are older.
    """
    name: Mapped[str] = mapped_column(String(100))
    side: Mapped[str] = mapped_column(String(8))
    station: Mapped[str] = mapped_column(String(100))
    taught_by: Mapped[str] = mapped_column(String(100), default="")
    fixtures: Mapped[list[str]] = mapped_column(JSON, default=list)
    """Fixtures that held the arm (arm fixers and elbow fixers); empty if unknown."""
    taught_at: Mapped[datetime] = mapped_column(UtcDateTime)
    duration_s: Mapped[float]
    rate_hz: Mapped[int]
    samples: Mapped[int]
    simulated: Mapped[bool] = mapped_column(default=False)
    """True if the angles were taught on a simulated apparatus, even if the recording was derived later."""
    note: Mapped[str] = mapped_column(Text)
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime, default=utc_now)
    archived_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class RecordingSamplesRow(SamplesColumns, Base):
    """The samples, in a separate table so that a list never loads them."""

    __tablename__ = "recording_samples"

    recording_id: Mapped[UUID] = mapped_column(ForeignKey("recordings.id"), primary_key=True)


class RecordingSampleBlockRow(SampleBlockColumns, Base):
    """One minute of samples (:data:`RECORDING_COLUMNS`)."""

    __tablename__ = "recording_sample_blocks"

    recording_id: Mapped[UUID] = mapped_column(
        ForeignKey("recording_samples.recording_id", ondelete="CASCADE"), primary_key=True
    )


RECORDING_SAMPLES = SampleTables(RecordingSamplesRow, RecordingSampleBlockRow, "recording_id")
