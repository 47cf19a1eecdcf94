"""Content of a report, independent of the language: plain values that are sent to the worker process."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from kata.motion.edit import PlaybackSettings
from kata.motion.patient_angle import PatientAngle
from kata.plotting.figures import RunFigureSamples


@dataclass(frozen=True)
class ReportPatient:
    """The patient of a report."""

    name: str
    kana: str | None
    clinic_number: str
    birth_date: date | None
    sex: str


@dataclass(frozen=True)
class Check:
    """One answer of the checklist. ``by`` is empty if the apparatus answered."""

    check: str
    subject: str
    at: datetime
    by: str


@dataclass(frozen=True)
class PrintedStop:
    """The cause of a stop."""

    code: str
    message: str
    motor: int | None = None
    """From 1; None if it belongs to no motor, or was stored before 0009."""


def motor_of(key: Mapping[str, Any] | None) -> int | None:
    """Return the motor that is a parameter of a stored text."""
    motor: int | None = key["params"].get("motor") if key else None
    return motor


@dataclass(frozen=True)
class PlaybackDescription:
    """Settings of a playback."""

    asked: PlaybackSettings
    load_level: int | None
    method: str | None


@dataclass(frozen=True)
class MotorErrors:
    """Errors of one motor, in the motor angle (:class:`kata.clinic.sessions.tables.MotorTrackingRow`)."""

    motor: int
    peak_deg: float
    rmse_deg: float
    start_deg: float
    wall_peak_deg: float | None
    change_deg: float | None
    lag_ms: float | None
    torque_peak_nm: float | None


@dataclass(frozen=True)
class MotionReach:
    """Range of the body in one basic motion: requested, reached, and of a healthy shoulder."""

    motion: int
    peak_deg: float
    rmse_deg: float
    asked_deg: tuple[float, float] | None
    reached_deg: tuple[float, float] | None
    reference_deg: tuple[float, float]
    patient_deg: tuple[PatientAngle, PatientAngle] | None = None
    """Patient's angles at the ends of ``reached_deg``; None if only the apparatus angle is known."""


@dataclass(frozen=True)
class PrintedReading:
    """A goniometer reading."""

    motion: int
    apparatus_deg: float
    patient_deg: float
    at: datetime
    by: str


@dataclass(frozen=True)
class RunContent:
    """One playback."""

    number: int
    recording: str
    started_at: datetime
    ended_at: datetime | None
    outcome: str
    stop: PrintedStop | None
    how: PlaybackDescription
    rate_hz: int | None
    reversals: int | None
    least_range_percent: float | None
    compared_percent: float | None
    partial: bool
    clock_offset_s: float | None
    worst_rmse_deg: float | None
    worst_peak_deg: float | None
    motors: tuple[MotorErrors, ...]
    motions: tuple[MotionReach, ...]
    parts: RunFigureSamples | None
    """Data of its curves; None if there is nothing to draw."""


@dataclass(frozen=True)
class PlannedItem:
    """One item of a programme with its runs: their numbers in the report and their outcomes."""

    position: int
    recording: str
    how: PlaybackDescription
    repetitions_done: int
    runs: tuple[tuple[int, str], ...]


@dataclass(frozen=True)
class PrintedPlan:
    """The plan of a session."""

    name: str
    version: int
    made_by: str
    timer_minutes: float | None
    items: tuple[PlannedItem, ...]
    besides: tuple[int, ...]
    """Numbers of the runs that were not planned."""


@dataclass(frozen=True)
class PrintedAddendum:
    """An addendum to a signed note."""

    written_at: datetime
    written_by: str
    text: str


@dataclass(frozen=True)
class SessionContent:
    """One session."""

    patient: ReportPatient
    side: str | None
    diagnosis: str
    diagnosis_code: str
    verification: str
    started_at: datetime
    ended_at: datetime | None
    end_reason: str | None
    therapist: str
    station: str
    simulated: bool
    checks: tuple[Check, ...]
    pain_before: int | None
    pain_during: int | None
    pain_after: int | None
    plan: PrintedPlan | None
    runs: tuple[RunContent, ...]
    readings: tuple[PrintedReading, ...]
    note: str
    signed_at: datetime | None
    signed_by: str
    addenda: tuple[PrintedAddendum, ...]


@dataclass(frozen=True)
class PrintedStage:
    """The stage of a shoulder from a day on."""

    stage: str
    since: date


@dataclass(frozen=True)
class Limit:
    """A doctor's limit of one basic motion. None: the apparatus' own limit."""

    motion: int
    lowest_deg: float | None
    highest_deg: float | None


@dataclass(frozen=True)
class DatedValue:
    """A value and its date."""

    at: datetime
    value: float


@dataclass(frozen=True)
class RomSeries:
    """Range of one motion: the treated shoulder over time, with the values for comparison."""

    motion: str
    kind: str
    position: str
    readings: tuple[DatedValue, ...]
    """Of the treated side, oldest first; at least one."""
    other: DatedValue | None
    """The newest value of the other side."""
    reference_deg: float | None


@dataclass(frozen=True)
class ScoreSeries:
    """One score over time, oldest first; at least one value."""

    name: str
    readings: tuple[DatedValue, ...]


@dataclass(frozen=True)
class PrintedVisit:
    """A session in the episode's list."""

    started_at: datetime
    therapist: str
    planned: int | None
    """Planned repetitions; None without a programme."""
    done: int
    """Planned repetitions that were completed; without a programme, all completed repetitions."""
    stops: int
    pain_before: int | None
    pain_after: int | None
    worst_rmse_deg: float | None
    signed: bool
    simulated: bool


@dataclass(frozen=True)
class PrintedContraindication:
    """A contraindication of the list."""

    code: str
    note: str
    noted_at: datetime
    noted_by: str
    signed_off_at: datetime | None
    signed_off_by: str
    resolved_at: datetime | None
    resolved_by: str
    resolution: str


@dataclass(frozen=True)
class EpisodeContent:
    """The care of one shoulder."""

    patient: ReportPatient
    side: str
    diagnosis: str
    diagnosis_code: str
    verification: str
    onset_on: date | None
    opened_at: datetime
    closed_at: datetime | None
    contraindications: str
    listed: tuple[PrintedContraindication, ...]
    """Contraindications of the list, of the patient and of this shoulder, oldest first."""
    limits: tuple[Limit, ...]
    max_load_level: int | None
    max_speed_deg_s: float | None
    limits_by: str
    stages: tuple[PrintedStage, ...]
    assessed_at: tuple[datetime, ...]
    rom: tuple[RomSeries, ...]
    pain: tuple[ScoreSeries, ...]
    spadi: tuple[DatedValue, ...]
    visits: tuple[PrintedVisit, ...]
    stops: tuple[tuple[PrintedStop, int], ...]
    """Each cause with the number of sessions in which it occurred."""
    closing_note: str
