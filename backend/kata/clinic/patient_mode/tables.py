"""Table of the patient's mode."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class PatientModeRow(Base):
    """A browser on which a patient fills in a questionnaire. Its screen is locked; unlocking it ends the patient's mode."""

    __tablename__ = "patient_modes"

    login_session_id: Mapped[UUID] = mapped_column(ForeignKey("sign_ins.id"), primary_key=True)
    episode_id: Mapped[UUID] = mapped_column(ForeignKey("episodes.id"))
    questionnaire: Mapped[str] = mapped_column(String(32))
    language: Mapped[str] = mapped_column(String(8))
    answers: Mapped[list[int | None]] = mapped_column(JSON)
    """Answers to all items so far; empty once the questionnaire is finished."""
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)
    finished_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
