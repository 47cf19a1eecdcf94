"""Table of backups."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class BackupRow(Base):
    """A backup that was made, and whether it has been restored to see that it can be."""

    __tablename__ = "backups"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    kind: Mapped[str] = mapped_column(String(8))
    """nightly or asked."""
    file: Mapped[str] = mapped_column(String(300))
    bytes: Mapped[int] = mapped_column(BigInteger)
    problem: Mapped[str] = mapped_column(Text, default="")
    tested_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    test_problem: Mapped[str] = mapped_column(Text, default="")
    """Empty where the restored copy was whole and equal."""
    audit_rows: Mapped[int | None] = mapped_column(BigInteger)
    """Of the audit trail, verified when it was tried; None where it was not."""
    audit_problem: Mapped[str] = mapped_column(Text, default="")
    """Where that trail was not whole."""
