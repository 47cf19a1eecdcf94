"""Table of the commissioning records."""

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class CommissioningRow(Base):
    """A finished commissioning or periodic check of a station, imported from the record in the folder of the station's file. It is never
    changed.
    """

    __tablename__ = "commissionings"
    __table_args__ = (UniqueConstraint("station", "kind", "began_at"),)

    id: Mapped[UUID] = mapped_column(primary_key=True)
    station: Mapped[str] = mapped_column(ForeignKey("stations.name"))
    kind: Mapped[str] = mapped_column(String(8))
    """full or check."""
    done_by: Mapped[str] = mapped_column(String(100))
    software: Mapped[str] = mapped_column(String(32))
    """Version of Kata that began the record."""
    began_at: Mapped[datetime] = mapped_column(UtcDateTime)
    ended_at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    passed: Mapped[bool]
    fault: Mapped[str] = mapped_column(Text)
    """Fault of the step that failed; empty if all steps passed."""
    fault_key: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    digest: Mapped[str] = mapped_column(String(64))
    """SHA-256 of ``record``."""
    configuration_digest: Mapped[str] = mapped_column(String(64))
    figures: Mapped[list[dict[str, Any]]] = mapped_column(JSON)
    """Measured figures of each motor that show drift (:class:`kata.clinic.commissionings.schemas.MotorCondition`)."""
    record: Mapped[str] = mapped_column(Text)
    """The record as JSON, with only the steps of this commissioning or check."""
