"""Table of device events."""

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, String, Text, text
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base, UtcDateTime


class DeviceEventRow(Base):
    """An event of the device process. An event of the kind alarm has stopped something."""

    __tablename__ = "device_events"
    __table_args__ = (
        Index("ix_device_events_station_at", "station", "at"),
        # For counting the alarms of a period without reading the events.
        Index(
            "ix_device_events_alarms", "at", "code", "station",
            sqlite_where=text("kind = 'alarm'"), postgresql_where=text("kind = 'alarm'"),
        ),
    )  # fmt: skip

    id: Mapped[UUID] = mapped_column(primary_key=True)
    station: Mapped[str] = mapped_column(String(100))
    at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    kind: Mapped[str] = mapped_column(String(8))
    """alarm or event."""
    code: Mapped[str] = mapped_column(String(32))
    message: Mapped[str] = mapped_column(Text)
    message_key: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    """Code and parameters of the message; None in rows from before migration 0009, and for a mode."""
    category: Mapped[int | None]
    """Category of the stop, if the event is an alarm."""
    axis: Mapped[int | None]
    patient_id: Mapped[UUID | None] = mapped_column(ForeignKey("patients.id"), index=True)
    session_id: Mapped[UUID | None] = mapped_column(ForeignKey("sessions.id"), index=True)
    run_id: Mapped[UUID | None]
    """This is no foreign key, because a run that the device refused is deleted while its events stay."""
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """Time at which an alarm was acknowledged after its cause had cleared."""
