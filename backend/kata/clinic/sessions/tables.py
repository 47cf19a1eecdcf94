"""Tables of sessions and runs."""

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, LargeBinary, String, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from kata.clinic.patients.tables import PatientRow
from kata.clinic.recordings.tables import RecordingRow
from kata.database.arrays import Column
from kata.database.base import Base, UtcDateTime

SAMPLE_COLUMNS = (
    Column("time_s", "s", 1e-6),
    Column("phase", "", 1.0),
    Column("path_s", "s", 1e-6),
    Column("setpoint_deg", "deg", 1e-4),
    Column("measured_deg", "deg", 1e-4),
    Column("torque_nm", "Nm", 1e-4),
)
"""(n,) time since the run's first sample, phase (device.journal), place on the recording; (n, 5) in axis order."""


class SessionRow(Base):
    """One visit."""

    __tablename__ = "sessions"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"), index=True)
    started_at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    note: Mapped[str] = mapped_column(Text)

    patient: Mapped[PatientRow] = relationship(lazy="joined", innerjoin=True)
    runs: Mapped[list["RunRow"]] = relationship(order_by="RunRow.started_at", lazy="selectin", viewonly=True)


class RunRow(Base):
    """One playback of one recording: written before the device is asked, completed from its journal."""

    __tablename__ = "runs"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    session_id: Mapped[UUID] = mapped_column(ForeignKey("sessions.id"), index=True)
    recording_id: Mapped[UUID] = mapped_column(ForeignKey("recordings.id"), index=True)
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    outcome: Mapped[str] = mapped_column(String(16))
    stop_code: Mapped[str | None] = mapped_column(String(32))
    stop_message: Mapped[str | None] = mapped_column(Text)
    rate_hz: Mapped[int | None]
    load_level: Mapped[int | None]
    """None where it was played before there were levels."""
    samples: Mapped[int | None]
    """How many were compared: those of the playing itself."""

    recording: Mapped[RecordingRow] = relationship(lazy="joined", innerjoin=True)
    tracking: Mapped[list["MotorTrackingRow"]] = relationship(order_by="MotorTrackingRow.motor", lazy="selectin")


class MotorTrackingRow(Base):
    """One motor's errors in one run, playback minus teaching."""

    __tablename__ = "motor_tracking"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    motor: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    peak_deg: Mapped[float]
    peak_at_s: Mapped[float]
    rmse_deg: Mapped[float]
    start_deg: Mapped[float]


class RunSamplesRow(Base):
    """What the run measured, apart from the record, so that a list never loads it."""

    __tablename__ = "run_samples"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    data: Mapped[bytes] = mapped_column(LargeBinary)
    """:mod:`kata.database.arrays`, :data:`SAMPLE_COLUMNS`."""
