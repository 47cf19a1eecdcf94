"""Tables of sessions and runs."""

from datetime import datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, LargeBinary, String, Text, false, text
from sqlalchemy.orm import Mapped, column_property, mapped_column, relationship

from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeVersionRow
from kata.clinic.recordings.tables import RecordingRow
from kata.clinic.stations.tables import was_simulated
from kata.database.arrays import SampleColumn
from kata.database.base import Base, UtcDateTime, utc_now
from kata.database.samples import SampleBlockColumns, SamplesColumns, SampleTables
from kata.messages import sent_key
from kata.motion.axes import BASIC_MOTIONS

MIN_COMPARED_PERCENT: Final = 90.0
"""If a smaller share of the playing time was compared, a run's errors are partial. The value is our choice. No publication
states one.
"""

RUN_COLUMNS = (
    SampleColumn("time_s", "s", 1e-6),
    SampleColumn("phase", "", 1.0),
    SampleColumn("path_s", "s", 1e-6, difference_to="time_s"),
    SampleColumn("setpoint_deg", "deg", 2e-3),
    SampleColumn("measured_deg", "deg", 1e-4, in_encoder_counts=True),
    SampleColumn("torque_nm", "Nm", 1e-4, in_encoder_counts=True),
)
"""``(n,)``: time since the run's first sample, phase (device.journal), position on the recording. ``(n, 5)``: the others, in axis order.

A setpoint is sent to its drive in counts of 0.088 deg. The resolution here is a fortieth of a count.
"""


class SessionRow(Base):
    """One session. Once it is signed, only addenda can be added."""

    __tablename__ = "sessions"
    __table_args__ = (
        Index("ix_sessions_started_at_id", "started_at", "id"),
        # The home page counts the sessions of the last weeks by episode without reading their rows.
        Index("ix_sessions_started_at_episode_id", "started_at", "episode_id", "run_count"),
        Index("ix_sessions_episode_id_started_at", "episode_id", "started_at", "run_count"),
        Index("ix_sessions_patient_id_started_at", "patient_id", "started_at", "id"),
        Index("ix_sessions_therapist_started_at", "therapist", "started_at", "id"),
        Index("ix_sessions_station_started_at", "station", "started_at", "id"),
        Index("ix_sessions_therapist_station_started_at", "therapist", "station", "started_at", "id"),
        # Few rows are open or unsigned. This index finds the work of the day without reading the others.
        Index(
            "ix_sessions_open",
            "started_at",
            sqlite_where=text("ended_at IS NULL"),
            postgresql_where=text("ended_at IS NULL"),
        ),
        Index(
            "ix_sessions_unsigned",
            "therapist",
            "started_at",
            sqlite_where=text("signed_at IS NULL"),
            postgresql_where=text("signed_at IS NULL"),
        ),
    )

    id: Mapped[UUID] = mapped_column(primary_key=True)
    patient_id: Mapped[UUID] = mapped_column(ForeignKey("patients.id"))
    episode_id: Mapped[UUID | None] = mapped_column(ForeignKey("episodes.id"))
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
    """Pain score, 0 to 10."""
    end_reason: Mapped[str | None] = mapped_column(String(16))
    note: Mapped[str] = mapped_column(Text)
    signed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    signed_by: Mapped[str] = mapped_column(String(100), default="")
    updated_at: Mapped[datetime] = mapped_column(UtcDateTime, default=utc_now)
    run_count: Mapped[int] = mapped_column(default=0)
    stop_count: Mapped[int] = mapped_column(default=0)
    """Number of stopped runs. It is updated with every run that begins or ends, so that a list need not count."""
    simulated: Mapped[bool] = column_property(was_simulated(station, started_at))
    """True if the station was a simulated apparatus when the session began. This is computed, not stored."""

    addenda: Mapped[list["AddendumRow"]] = relationship(order_by="AddendumRow.written_at", lazy="selectin")
    goniometer_readings: Mapped[list["GoniometerReadingRow"]] = relationship(
        order_by="GoniometerReadingRow.read_at", lazy="selectin"
    )
    patient: Mapped[PatientRow] = relationship(lazy="joined", innerjoin=True)
    episode: Mapped[EpisodeRow | None] = relationship(viewonly=True)
    programme_version: Mapped[ProgrammeVersionRow | None] = relationship()
    runs: Mapped[list["RunRow"]] = relationship(order_by="RunRow.started_at", lazy="selectin", viewonly=True)

    @property
    def side(self) -> str | None:
        """The treated shoulder: of the episode, or of all recordings that were played. None: unknown, or both shoulders."""
        if self.episode:
            return self.episode.side
        sides = {run.recording.side for run in self.runs}
        return sides.pop() if len(sides) == 1 else None


class AddendumRow(Base):
    """An addendum to a signed note."""

    __tablename__ = "addenda"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    session_id: Mapped[UUID] = mapped_column(ForeignKey("sessions.id"), index=True)
    written_at: Mapped[datetime] = mapped_column(UtcDateTime)
    written_by: Mapped[str] = mapped_column(String(100))
    text: Mapped[str] = mapped_column(Text)


class GoniometerReadingRow(Base):
    """A goniometer reading of one basic motion at a pose of a session (:mod:`kata.motion.patient_angle`)."""

    __tablename__ = "goniometer_readings"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    session_id: Mapped[UUID] = mapped_column(ForeignKey("sessions.id"), index=True)
    motion: Mapped[int]
    """Number of the motion in Table 2, 3 to 6."""
    apparatus_deg: Mapped[float]
    """Apparatus angle of the motion at that moment."""
    patient_deg: Mapped[float]
    """Angle that the goniometer showed."""
    read_at: Mapped[datetime] = mapped_column(UtcDateTime)
    read_by: Mapped[str] = mapped_column(String(100))


class SessionStopRow(Base):
    """A cause of a stop in a session. The table is searched by cause, therapist, station and time without reading the runs."""

    __tablename__ = "session_stops"
    __table_args__ = (
        Index("ix_session_stops_code_started_at", "code", "started_at", "session_id"),
        Index("ix_session_stops_code_therapist_started_at", "code", "therapist", "started_at", "session_id", "station"),
        Index("ix_session_stops_code_station_started_at", "code", "station", "started_at", "session_id"),
        # Also counts the sessions with a stop.
        Index("ix_session_stops_started_at", "started_at", "code", "station", "session_id"),
    )

    session_id: Mapped[UUID] = mapped_column(ForeignKey("sessions.id"), primary_key=True)
    code: Mapped[str] = mapped_column(String(32), primary_key=True)
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)
    therapist: Mapped[str] = mapped_column(String(100), default="")
    station: Mapped[str] = mapped_column(String(100), default="")
    """Station, therapist and time are copies of the session's columns."""


class RunRow(Base):
    """One playback of one recording. The row is written before the device starts and completed from the journal."""

    __tablename__ = "runs"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    session_id: Mapped[UUID] = mapped_column(ForeignKey("sessions.id"), index=True)
    recording_id: Mapped[UUID] = mapped_column(ForeignKey("recordings.id"), index=True)
    programme_position: Mapped[int | None]
    """Position in the session's programme; None for a run that was not planned."""
    started_at: Mapped[datetime] = mapped_column(UtcDateTime)
    ended_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    outcome: Mapped[str] = mapped_column(String(16))
    stop_code: Mapped[str | None] = mapped_column(String(32))
    stop_message: Mapped[str | None] = mapped_column(Text)
    stop_key: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    """Code and parameters of the message; None in rows from before migration 0009."""
    rate_hz: Mapped[int | None]
    resistance_level: Mapped[int | None] = mapped_column("load_level")
    """Resistance level, formerly named load level; None for a run of a version without levels."""
    speed_percent: Mapped[float] = mapped_column(default=100.0)
    repetitions: Mapped[int] = mapped_column(default=1)
    pause_s: Mapped[float] = mapped_column(default=0.0)
    range_percent: Mapped[float] = mapped_column(default=100.0)
    """The settings of the playback (:class:`kata.motion.edit.PlaybackSettings`).

    The requested motion is computed from recording and settings whenever it is needed.
    """
    method: Mapped[str | None] = mapped_column(String(16))
    """Playback method (:data:`kata.motion.method.Method`); None for a run of a version without methods."""
    self_paced: Mapped[bool] = mapped_column(default=False, server_default=false())
    """True if the patient's effort set the pace."""
    work_j: Mapped[float | None]
    mean_effort_nm: Mapped[float | None]
    """Work and mean effort of the patient along the path. None if the run was not self-paced or was interrupted. The effort is also None if
    the arm did not move."""
    mean_pace_percent: Mapped[float | None]
    """Mean pace of a self-paced run (:attr:`kata.device.self_pacing.SelfPacing.mean_pace_percent`). None as for the work, if nothing was
    played, and in rows from before migration 0035."""
    corrected_by: Mapped[UUID | None]
    """Run whose correction was used, if any. This is no foreign key, because SQLite could not drop it again."""
    samples: Mapped[int | None]
    """Number of compared samples, which are those of the playback itself."""
    compared_percent: Mapped[float | None]
    """Share of the playing time that was compared; None if nothing was played, and in rows from before migration 0011.

    In rows from before 0011, the figures include the start.
    """
    clock_offset_s: Mapped[float | None]
    """Largest difference between the wall clock and the path's clock (:func:`kata.motion.tracking.wall_clock_s`)."""
    worst_rmse_deg: Mapped[float | None]
    worst_peak_deg: Mapped[float | None]
    """Largest absolute values of the five motors, for lists and charts of many runs. None for a partial run."""
    reversals: Mapped[int | None]
    """Number of times that resistance took the arm back; None for a run of a version that did not store it."""
    least_range_percent: Mapped[float | None]
    """Smallest share of the range that was played after the range was reduced; None if it was not reduced."""
    learning: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list, server_default="[]")
    """Messages of the learned method about this run, with their keys: earlier corrections that were used, and what was not learned."""
    learned_rms_deg: Mapped[float | None]
    """Size of the learned correction in degrees: root mean square of the motor with the largest correction.

    None if nothing was learned, and for a run of a version that did not store it.
    """
    repetitions_done: Mapped[int | None]
    """Completed repetitions. None before the run has ended, and for an interrupted run of a version that did not count them."""
    played_s: Mapped[float | None]
    """Seconds on the path. None before the run has ended, and for a run of a version that did not store it."""

    recording: Mapped[RecordingRow] = relationship(lazy="joined", innerjoin=True)
    tracking: Mapped[list["MotorTrackingRow"]] = relationship(order_by="MotorTrackingRow.motor", lazy="selectin")
    motions: Mapped[list["MotionTrackingRow"]] = relationship(order_by="MotionTrackingRow.motion", lazy="selectin")
    end_feel: Mapped["EndFeelRow | None"] = relationship(lazy="selectin", cascade="all, delete-orphan")
    """None for a playback."""

    @property
    def change_deg(self) -> float | None:
        """Largest difference between the requested and the taught angle among the five motors, with its sign; None if it was not stored."""
        changes = [motor.change_deg for motor in self.tracking if motor.change_deg is not None]
        return max(changes, key=abs, default=None)

    @property
    def partial(self) -> bool:
        """True if too little was compared for a figure of the whole motion: of the playing time, or because the playback was ended before
        its first repetition was complete. Its error may lack the hardest part of the motion.

        A row from before migration 0011 does not contain the share. Such a run is partial if its range was reduced.
        """
        if self.samples is not None and self.outcome != "completed" and not self.repetitions_done:
            return True
        if self.compared_percent is None:
            return self.least_range_percent is not None
        return self.compared_percent < MIN_COMPARED_PERCENT


class _TrackingColumns:
    """Errors of one angle in one run (:class:`kata.motion.tracking.Tracking`): playback minus the requested motion. The requested motion is
    the taught samples with the run's settings.

    A nullable column is also None for runs of versions that did not compute it.
    """

    peak_deg: Mapped[float]
    peak_at_s: Mapped[float]
    rmse_deg: Mapped[float]
    start_deg: Mapped[float]
    lag_ms: Mapped[float | None]
    wall_peak_deg: Mapped[float | None]
    wall_rmse_deg: Mapped[float | None]
    """Like ``peak_deg`` and ``rmse_deg``, on the wall clock."""
    change_deg: Mapped[float | None]
    """Largest change by settings, with its sign: requested minus taught angle."""
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
    """Errors of one basic motion, in angles of the body. Its number is that of Table 2."""

    __tablename__ = "motion_tracking"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    motion: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    end_range_s: Mapped[float | None]
    """End-range time (:mod:`kata.motion.end_range`). None if it was not counted, and for runs from before migration 0026."""
    end_range_band_deg: Mapped[float | None]
    end_range_torque_nm: Mapped[float | None]
    """Band and torque with which it was counted."""

    @property
    def name(self) -> str:
        """Name of the motion in Table 2."""
        return BASIC_MOTIONS[self.motion - 1].name

    @property
    def name_key(self) -> dict[str, Any] | None:
        """Code of the motion's name."""
        return sent_key(BASIC_MOTIONS[self.motion - 1].name)

    @property
    def apparatus_min_deg(self) -> float:
        """Lower end of the apparatus's range of motion."""
        return BASIC_MOTIONS[self.motion - 1].range_deg[0]

    @property
    def apparatus_max_deg(self) -> float:
        """Upper end of the apparatus's range of motion."""
        return BASIC_MOTIONS[self.motion - 1].range_deg[1]

    @property
    def reference_min_deg(self) -> float:
        """Lower end of a healthy shoulder's range of motion."""
        return BASIC_MOTIONS[self.motion - 1].reference_deg[0]

    @property
    def reference_max_deg(self) -> float:
        """Upper end of a healthy shoulder's range of motion."""
        return BASIC_MOTIONS[self.motion - 1].reference_deg[1]


class RunSamplesRow(SamplesColumns, Base):
    """The samples of a run, in a separate table so that a list never loads them."""

    __tablename__ = "run_samples"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)


class RunSampleBlockRow(SampleBlockColumns, Base):
    """One minute of samples (:data:`RUN_COLUMNS`)."""

    __tablename__ = "run_sample_blocks"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("run_samples.run_id", ondelete="CASCADE"), primary_key=True)


RUN_SAMPLES = SampleTables(RunSamplesRow, RunSampleBlockRow, "run_id")


class RunCorrectionRow(Base):
    """The correction that a run of the learned method taught (:mod:`kata.clinic.sessions.stored_corrections`)."""

    __tablename__ = "run_corrections"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    station: Mapped[str] = mapped_column(String(100))
    data: Mapped[bytes] = mapped_column(LargeBinary)


class EndFeelRow(Base):
    """Request of an end-feel run to the apparatus, and its result (:mod:`kata.clinic.sessions.end_feel`)."""

    __tablename__ = "end_feel_runs"

    run_id: Mapped[UUID] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    kind: Mapped[str] = mapped_column(String(8))
    """baseline: with a test weight. test, stretch: with the patient's arm."""
    station: Mapped[str] = mapped_column(String(100))
    motion: Mapped[int]
    """Number of the basic motion in Table 2."""
    motor: Mapped[int]
    outward: Mapped[int]
    """Sign of the motor's angle on the way out. Angles and torques of the result are positive outwards."""
    speed_deg_s: Mapped[float]
    further_deg: Mapped[float]
    """Distance that the way goes beyond the end of the recorded motion."""
    torque_nm: Mapped[float]
    """The chosen torque."""
    baseline_run_id: Mapped[UUID | None]
    """The baseline that is subtracted. This is no foreign key, because a run is erased before the other."""
    unmeasured: Mapped[str | None] = mapped_column(String(24))
    """Reason why there are no figures; None before the run has ended, and if there are figures."""
    range_deg: Mapped[float | None]
    onset_deg: Mapped[float | None]
    stiffness_nm_deg: Mapped[float | None]
    last_third_nm_deg: Mapped[float | None]
    hysteresis_nm: Mapped[float | None]
    interval_range_deg: Mapped[float | None]
    interval_onset_deg: Mapped[float | None]
    interval_stiffness_nm_deg: Mapped[float | None]
    interval_last_third_nm_deg: Mapped[float | None]
    interval_hysteresis_nm: Mapped[float | None]
    """Half of the width of the 95 % interval of each figure."""
    disagreement_nm: Mapped[float | None]
    """Largest difference of the repetitions, RMS."""
    hold_s: Mapped[float | None]
    """Time for which a stretch holds the torque in each repetition; None: the run is no stretch."""
    repetitions: Mapped[int | None]
    largest_deg: Mapped[float | None]
    """Largest angle of a stretch: the motor's angle at the end of the way out."""
    held_s: Mapped[float | None]
    """Time for which a stretch held at least 60 % of its torque; None: not counted."""
    target_nm: Mapped[float | None]
    """Torque of a stretch after all requests to reduce it."""
    curve: Mapped[bytes | None] = mapped_column(LargeBinary)
    """Torque-angle curve (:class:`kata.motion.end_feel.TorqueAngleCurve`): of a test without weight and friction of the apparatus."""
