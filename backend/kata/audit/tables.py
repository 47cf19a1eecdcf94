"""Table of the audit trail."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, Index, Integer, LargeBinary, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class AuditRow(Base):
    """One link of the chain: an action, a look or a refused attempt. Rows are only added."""

    __tablename__ = "audit"
    __table_args__ = (
        *(
            Index(f"ix_audit_{name}_at", name, "at", "number")
            for name in ("account_id", "patient_id", "action", "outcome", "station")
        ),
        Index("ix_audit_at", "at", "number"),
    )

    number: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True)
    """From 1, without gaps. What an outage kept back got its number later than what was done after it."""
    at: Mapped[datetime] = mapped_column(UtcDateTime)
    account_id: Mapped[UUID | None]
    """No foreign key, as below: the trail outlives what it speaks of."""
    who: Mapped[str] = mapped_column(String(100))
    """The user's name at that time, or the program's own for what no user asked for."""
    role: Mapped[str] = mapped_column(String(16))
    sign_in_id: Mapped[UUID | None]
    address: Mapped[str] = mapped_column(String(64))
    action: Mapped[str] = mapped_column(String(64))
    """The route's operation id, or what the program did."""
    outcome: Mapped[str] = mapped_column(String(8))
    """done, refused or failed."""
    patient_id: Mapped[UUID | None]
    subject: Mapped[str] = mapped_column(String(100))
    """What else it was done to: kind and id."""
    station: Mapped[str] = mapped_column(String(100))
    detail: Mapped[str] = mapped_column(Text)
    """JSON: which fields changed, why it was refused. Never a secret, never what a field said of a patient."""
    anchor: Mapped[str] = mapped_column(String(32))
    """Which file outside the database the writing service anchors the chain in."""
    anchored: Mapped[int] = mapped_column(BigInteger)
    """How many lines that file was known to hold."""
    hash: Mapped[bytes] = mapped_column(LargeBinary(32))
    """SHA-256 over the link before and all of this row."""
