"""Tables of assessments."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from kata.database.base import Base, UtcDateTime


class AssessmentRow(Base):
    """The findings of one day. An assessment that was entered by mistake is withdrawn, never deleted."""

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
    """Average over the last week, 0 to 10."""
    spadi: Mapped[list[int | None] | None] = mapped_column(JSON(none_as_null=True))
    """Answers to the 13 items in order, 0 to 10 each; None if unanswered."""
    spadi_score: Mapped[float | None]
    """Total score, written only for programs from before migration 0011, which read it."""
    questionnaires: Mapped[dict[str, list[int | None]]] = mapped_column(JSON, default=dict)
    """Answers to other questionnaires by code, in the form of ``spadi``."""
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime)
    withdrawn_at: Mapped[datetime | None] = mapped_column(UtcDateTime)

    rom: Mapped[list["RomRow"]] = relationship(lazy="selectin", cascade="all, delete-orphan")


class RomRow(Base):
    """The angle that a shoulder reached in one direction."""

    __tablename__ = "rom_measurements"

    assessment_id: Mapped[UUID] = mapped_column(ForeignKey("assessments.id"), primary_key=True)
    side: Mapped[str] = mapped_column(String(8), primary_key=True)
    motion: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(8), primary_key=True)
    """active or passive."""
    position: Mapped[str] = mapped_column(String(32), primary_key=True)
    """Position of the arm during the measurement, for rotation; otherwise empty."""
    angle_deg: Mapped[float]
