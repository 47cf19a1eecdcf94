"""Table of the audit trail."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, Index, Integer, LargeBinary, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class AuditRow(Base):
    """One link of the chain: an action, a view or a refused attempt. Rows are only added."""

    __tablename__ = "audit"
    __table_args__ = (
        *(
            Index(f"ix_audit_{name}_at", name, "at", "number")
            for name in ("account_id", "patient_id", "action", "outcome", "station")
        ),
        Index("ix_audit_at", "at", "number"),
    )

    number: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True)
    """Number in the chain, from 1 without gaps. An entry that an outage delayed has a higher number than later entries."""
    at: Mapped[datetime] = mapped_column(UtcDateTime)
    account_id: Mapped[UUID | None]
    """This is no foreign key, because the trail outlives the rows that it names."""
    who: Mapped[str] = mapped_column(String(100))
    """The user's name at that time, or the program's name if no user requested the action."""
    role: Mapped[str] = mapped_column(String(16))
    sign_in_id: Mapped[UUID | None]
    """Id of the login session."""
    address: Mapped[str] = mapped_column(String(64))
    action: Mapped[str] = mapped_column(String(64))
    """Operation id of the route, or the action of the program."""
    outcome: Mapped[str] = mapped_column(String(8))
    """done, refused or failed."""
    patient_id: Mapped[UUID | None]
    subject: Mapped[str] = mapped_column(String(100))
    """Kind and id of the object, in addition to the patient."""
    station: Mapped[str] = mapped_column(String(100))
    detail: Mapped[str] = mapped_column(Text)
    """JSON: changed fields, or the reason of a refusal. It never contains a secret or data of a patient."""
    anchor: Mapped[str] = mapped_column(String(32))
    """Id of the anchor file of the service that wrote the row."""
    anchored: Mapped[int] = mapped_column(BigInteger)
    """Number of synced lines in that file when the row was written."""
    hash: Mapped[bytes] = mapped_column(LargeBinary(32))
    """SHA-256 of the previous row's hash and this row."""
