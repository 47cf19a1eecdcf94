"""Table of backups."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class BackupRow(Base):
    """A backup and the result of its last restore test."""

    __tablename__ = "backups"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    kind: Mapped[str] = mapped_column(String(8))
    """``nightly`` or ``asked``."""
    file: Mapped[str] = mapped_column(String(300))
    bytes: Mapped[int] = mapped_column(BigInteger)
    problem: Mapped[str] = mapped_column(Text, default="")
    tested_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    test_problem: Mapped[str] = mapped_column(Text, default="")
    """Empty if the restored copy was complete and equal."""
    audit_rows: Mapped[int | None] = mapped_column(BigInteger)
    """Number of rows of the audit trail that the restore test verified; None if it verified none."""
    audit_problem: Mapped[str] = mapped_column(Text, default="")
    """Damage of that audit trail; empty if it was intact."""

    @property
    def failure(self) -> str:
        """Reason why the backup was not made, or why its restore test failed; empty otherwise.

        A backup that could not be tested here, because its key is elsewhere, has no failure.
        """
        return self.problem or (self.test_problem if self.tested_at else "")
