"""Tables of restricted records: care teams and break-glass accesses."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, Index, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class CareTeamRow(Base):
    """A member of a restricted patient's care team."""

    __tablename__ = "care_team"
    __table_args__ = (Index("ix_care_team_account_id_patient_id", "account_id", "patient_id"),)

    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), primary_key=True)
    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), primary_key=True)


class BreakGlassAccessRow(Base):
    """Break-glass access of an account to a restricted record, for a limited time. The table keeps its former name."""

    __tablename__ = "broken_glass"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    account_id: Mapped[UUID] = mapped_column(ForeignKey("accounts.id"), index=True)
    reason: Mapped[str] = mapped_column(Text)
    at: Mapped[datetime] = mapped_column(UtcDateTime)
    until: Mapped[datetime] = mapped_column(UtcDateTime)
    reviewed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    reviewed_by: Mapped[str] = mapped_column(String(100), default="")
