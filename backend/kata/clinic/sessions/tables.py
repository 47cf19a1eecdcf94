"""Tables of sessions and runs."""

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, LargeBinary, String, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeVersionRow
from kata.clinic.recordings.tables import RecordingRow
from kata.database.arrays import SampleColumn
from kata.database.base import Base, UtcDateTime, utc_now
from kata.database.samples import SampleBlockColumns, SamplesColumns, SampleTables
from kata.messages import sent_key
from kata.motion.axes import BASIC_MOTIONS

SAMPLE_COLUMNS = (
    SampleColumn("time_s", "s", 1e-6),
    SampleColumn("phase", "", 1.0),
    SampleColumn("path_s", "s", 1e-6, along="time_s"),
    SampleColumn("setpoint_deg", "deg", 2e-3),
    SampleColumn("measured_deg", "deg", 1e-4, counted=True),
    SampleColumn("torque_nm", "Nm", 1e-4, counted=True),
)
"""(n,) time since the run's first sample, phase (device.journal), place on the recording; (n, 5) in axis order.

A setpoint is sent to its drive in counts of 0.088 deg. Its resolution here is a fortieth of a count.
"""


class SessionRow(Base):
    """One session. Once it is signed, only addenda are added."""

    __tablename__ = "sessions"
    __table_args__ = (
        Index("ix_sessions_started_at_id", "started_at", "id"),
        Index("ix_sessions_patient_id_started_at", "patient_id", "started_at", "id"),
        Index("ix_sessions_therapist_started_at", "therapist", "started_at", "id"),
        Index("ix_sessions_station_started_at", "station", "started_at", "id"),
        Index("ix_sessions_therapist_station_started_at", "therapist", "station", "started_at", "id"),
    )

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"))
    episode_id: Mapped[UUID | None] = mapped_column(ForeignKey("episodes.id"), index=True)
    programme_version_id: Mapped[UUID | None] = mapped_column(ForeignKey("programme_versions.id"))
    """The plan; None if recordings were chosen one by one."""
    therapist: Mapped[str] = mapped_column(String(100), default="")
    station: Mapped[str] = mapped_column(String(100), default="")
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    checks: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list)
    """The checklist's answers (:class:`kata.clinic.sessions.checklist.Answer`)."""
    pain_before: Mapped[int | None]
    pain_during: Mapped[int | None]
    pain_after: Mapped[int | None]
    """0 to 10."""
    end_reason: Mapped[str | None] = mapped_column(String(16))
    note: Mapped[str] = mapped_column(Text)
    signed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    signed_by: Mapped[str] = mapped_column(String(100), default="")
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime, default=utc_now)
    run_count: Mapped[int] = mapped_column(default=0)
    stop_count: Mapped[int] = mapped_column(default=0)
    """Updated with every run that begins or ends, so that a list need not count."""

    addenda: Mapped[list["AddendumRow"]] = relationship(order_by="AddendumRow.written_at", lazy="selectin")
    patient: Mapped[PatientRow] = relationship(lazy="joined", innerjoin=True)
    episode: Mapped[EpisodeRow | None] = relationship(viewonly=True)
    programme_version: Mapped[ProgrammeVersionRow | None] = relationship()
    runs: Mapped[list["RunRow"]] = relationship(order_by="RunRow.started_at", lazy="selectin", viewonly=True)


class AddendumRow(Base):
    """An addendum to a signed note."""

    __tablename__ = "addenda"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    session_id: Mapped[UUID] = mapped_column(ForeignKey("sessions.id"), index=True)
    written_at: Mapped[datetime] = mapped_column(UtcDateTime)
    written_by: Mapped[str] = mapped_column(String(100))
    text: Mapped[str] = mapped_column(Text)


class SessionStopRow(Base):
    """A cause of a stop in a session. It is found by cause, therapist, station and time without reading the runs."""

    __tablename__ = "session_stops"
    __table_args__ = (
        Index("ix_session_stops_code_started_at", "code", "started_at", "session_id"),
        Index("ix_session_stops_code_therapist_started_at", "code", "therapist", "started_at", "session_id", "station"),
        Index("ix_session_stops_code_station_started_at", "code", "station", "started_at", "session_id"),
    )

    session_id: Mapped[UUID] = mapped_column(ForeignKey("sessions.id"), primary_key=True)
    code: Mapped[str] = mapped_column(String(32), primary_key=True)
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)
    therapist: Mapped[str] = mapped_column(String(100), default="")
    station: Mapped[str] = mapped_column(String(100), default="")
    """All three are copies of the session's columns."""


class RunRow(Base):
    """One playback of one recording. The row is written before the device starts and completed from the journal."""

    __tablename__ = "runs"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    session_id: Mapped[UUID] = mapped_column(ForeignKey("sessions.id"), index=True)
    recording_id: Mapped[UUID] = mapped_column(ForeignKey("recordings.id"), index=True)
    programme_position: Mapped[int | None]
    """Item of the session's programme; None for a run that was not planned."""
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    outcome: Mapped[str] = mapped_column(String(16))
    stop_code: Mapped[str | None] = mapped_column(String(32))
    stop_message: Mapped[str | None] = mapped_column(Text)
    stop_key: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    """Code and parameters of the message; None in rows from before 0009."""
    rate_hz: Mapped[int | None]
    load_level: Mapped[int | None]
    """None for a run from before there were levels."""
    speed_percent: Mapped[float] = mapped_column(default=100.0)
    repetitions: Mapped[int] = mapped_column(default=1)
    pause_s: Mapped[float] = mapped_column(default=0.0)
    range_percent: Mapped[float] = mapped_column(default=100.0)
    """The settings of the playback (:class:`kata.motion.edit.PlaybackSettings`).

    The requested motion is computed from recording and settings whenever it is needed.
    """
    method: Mapped[str | None] = mapped_column(String(16))
    """:data:`kata.motion.method.Method`. None for a run from before there were methods."""
    corrected_by: Mapped[UUID | None]
    """The run whose correction was used, if any. No foreign key: SQLite could not drop it again."""
    samples: Mapped[int | None]
    """Number of compared samples: those of the playback itself."""
    worst_rmse_deg: Mapped[float | None]
    worst_peak_deg: Mapped[float | None]
    """The largest absolute values of the five motors, for lists and charts of many runs."""
    reversals: Mapped[int | None]
    """How often resistance took the arm back; None for a run from before it was stored."""
    least_range_percent: Mapped[float | None]
    """Smallest share of the range that was played after the range was reduced; None if it was not reduced."""
    learned_rms_deg: Mapped[float | None]
    """Size of the learned correction: root mean square of the motor with the largest one.

    None if nothing was learned, and for a run from before it was stored.
    """
    repetitions_done: Mapped[int | None]
    """Completed repetitions. None before the run has ended, and for an interrupted run from before they were counted."""
    played_s: Mapped[float | None]
    """Seconds on the path. None before the run has ended, and if it was not stored."""

    recording: Mapped[RecordingRow] = relationship(lazy="joined", innerjoin=True)
    tracking: Mapped[list["MotorTrackingRow"]] = relationship(order_by="MotorTrackingRow.motor", lazy="selectin")
    motions: Mapped[list["MotionTrackingRow"]] = relationship(order_by="MotionTrackingRow.motion", lazy="selectin")


class _TrackingColumns:
    """Errors of one angle in one run (:class:`kata.motion.tracking.Tracking`): playback minus the requested motion.

    A nullable column is also None for runs from before it was computed.
    """

    peak_deg: Mapped[float]
    peak_at_s: Mapped[float]
    rmse_deg: Mapped[float]
    start_deg: Mapped[float]
    lag_ms: Mapped[float | None]
    taught_min_deg: Mapped[float | None]
    taught_max_deg: Mapped[float | None]
    played_min_deg: Mapped[float | None]
    played_max_deg: Mapped[float | None]
    taught_smoothness: Mapped[float | None]
    played_smoothness: Mapped[float | None]


class MotorTrackingRow(_TrackingColumns, Base):
    """Errors of one motor."""

    __tablename__ = "motor_tracking"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    motor: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    torque_peak_nm: Mapped[float | None]


class MotionTrackingRow(_TrackingColumns, Base):
    """Errors of one basic motion, in the body's angle. Its number is that of Table 2."""

    __tablename__ = "motion_tracking"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    motion: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)

    @property
    def name(self) -> str:
        """Name in Table 2."""
        return BASIC_MOTIONS[self.motion - 1].name

    @property
    def name_key(self) -> dict[str, Any] | None:
        """Code of the name."""
        return sent_key(BASIC_MOTIONS[self.motion - 1].name)

    @property
    def apparatus_min_deg(self) -> float:
        """Lower end of the apparatus' ROM."""
        return BASIC_MOTIONS[self.motion - 1].range_deg[0]

    @property
    def apparatus_max_deg(self) -> float:
        """Upper end of the apparatus' ROM."""
        return BASIC_MOTIONS[self.motion - 1].range_deg[1]

    @property
    def reference_min_deg(self) -> float:
        """Lower end of a healthy shoulder's ROM."""
        return BASIC_MOTIONS[self.motion - 1].reference_deg[0]

    @property
    def reference_max_deg(self) -> float:
        """Upper end of a healthy shoulder's ROM."""
        return BASIC_MOTIONS[self.motion - 1].reference_deg[1]


class RunSamplesRow(SamplesColumns, Base):
    """The samples of the run, in a table of their own so that a list never loads them."""

    __tablename__ = "run_samples"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)


class RunSampleBlockRow(SampleBlockColumns, Base):
    """One minute of samples (:data:`SAMPLE_COLUMNS`)."""

    __tablename__ = "run_sample_blocks"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("run_samples.run_id", ondelete="CASCADE"), primary_key=True)


SAMPLES = SampleTables(RunSamplesRow, RunSampleBlockRow, "run_id")


class RunCorrectionRow(Base):
    """The correction that a run of the learned method taught (:mod:`kata.clinic.sessions.learning`)."""

    __tablename__ = "run_corrections"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    station: Mapped[str] = mapped_column(String(100))
    data: Mapped[bytes] = mapped_column(LargeBinary)
