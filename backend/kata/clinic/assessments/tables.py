"""Tables of assessments."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from kata.database.base import Base, UtcDateTime


class AssessmentRow(Base):
    """What was found on a day. Withdrawn when it was entered by mistake, never deleted."""

    __tablename__ = "assessments"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    episode_id: Mapped[UUID] = mapped_column(ForeignKey("episodes.id"), index=True)
    assessed_at: Mapped[datetime] = mapped_column(UtcDateTime)
    assessed_by: Mapped[str] = mapped_column(String(100))
    note: Mapped[str] = mapped_column(Text)
    pain_rest: Mapped[int | None]
    pain_active: Mapped[int | None]
    pain_passive: Mapped[int | None]
    pain_average: Mapped[int | None]
    """0 to 10; the average over the last week."""
    spadi: Mapped[list[int | None] | None] = mapped_column(JSON(none_as_null=True))
    """Its 13 items in their order, 0 to 10 each, None where it was not answered."""
    spadi_score: Mapped[float | None]
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
    withdrawn_at: Mapped[datetime | None] = mapped_column(UtcDateTime)

    rom: Mapped[list["RomRow"]] = relationship(lazy="selectin", cascade="all, delete-orphan")


class RomRow(Base):
    """How far a shoulder went in one direction."""

    __tablename__ = "rom_measurements"

    assessment_id: Mapped[UUID] = mapped_column(ForeignKey("assessments.id"), primary_key=True)
    side: Mapped[str] = mapped_column(String(8), primary_key=True)
    motion: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(8), primary_key=True)
    """Active or passive."""
    position: Mapped[str] = mapped_column(String(32), primary_key=True)
    """Where the arm was meanwhile; of importance for rotation. Empty where nothing is to be said."""
    angle_deg: Mapped[float]
