"""Table of contraindications."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class ContraindicationRow(Base):
    """A contraindication or precaution of a patient. It is resolved, never deleted."""

    __tablename__ = "contraindications"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    episode_id: Mapped[UUID | None] = mapped_column(ForeignKey("episodes.id"))
    """None for a condition of the patient, which concerns both shoulders."""
    code: Mapped[str] = mapped_column(String(32))
    """Code of the kind (:data:`kata.clinic.contraindications.kinds.Code`)."""
    note: Mapped[str] = mapped_column(Text, default="")
    noted_at: Mapped[datetime] = mapped_column(UtcDateTime)
    noted_by: Mapped[str] = mapped_column(String(100))
    signed_off_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    signed_off_by: Mapped[str] = mapped_column(String(100), default="")
    """Name of the doctor who allowed the treatment in spite of this contraindication."""
    resolved_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    resolved_by: Mapped[str] = mapped_column(String(100), default="")
    resolution: Mapped[str] = mapped_column(Text, default="")
    """Reason why this contraindication no longer applies."""
