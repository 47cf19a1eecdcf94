"""Content of a report as plain values, independent of the language. The worker process receives it."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from kata.motion.edit import PlaybackSettings
from kata.motion.end_feel import TorqueAngleCurve
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
    """One answer of the checklist. ``by`` is empty if the answer came from the apparatus."""

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
    """Motor number from 1; None if the cause belongs to no motor, or if an older version stored it."""


def motor_of(key: Mapping[str, Any] | None) -> int | None:
    """Return the motor number that is a parameter of a stored text, or None."""
    motor: int | None = key["params"].get("motor") if key else None
    return motor


@dataclass(frozen=True)
class PlaybackDescription:
    """Settings of a playback."""

    asked: PlaybackSettings
    resistance_level: int | None
    method: str | None
    self_paced: bool = False
    """True if the patient's effort sets the pace."""


@dataclass(frozen=True)
class MotorErrors:
    """Errors of one motor in motor angles (:class:`kata.clinic.sessions.tables.MotorTrackingRow`)."""

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
    """Ranges of the body in one basic motion: the requested one, the reached one, and that of a healthy shoulder."""

    motion: int
    peak_deg: float
    rmse_deg: float
    asked_deg: tuple[float, float] | None
    reached_deg: tuple[float, float] | None
    reference_deg: tuple[float, float]
    patient_deg: tuple[PatientAngle, PatientAngle] | None = None
    """The patient's angles at the ends of ``reached_deg``; None if only the apparatus angle is known."""
    end_range_s: float | None = None
    """End-range time; None if it was not counted."""
    end_range_limits: tuple[float, float] | None = None
    """Band in deg and torque in Nm with which it was counted."""


@dataclass(frozen=True)
class PrintedReading:
    """A goniometer reading."""

    motion: int
    apparatus_deg: float
    patient_deg: float
    at: datetime
    by: str


@dataclass(frozen=True)
class PrintedEndFeel:
    """An end-feel test or its baseline. Figures are None if there is a reason instead."""

    kind: str
    motion: int
    torque_nm: float
    unmeasured: str | None
    range_deg: tuple[float, float] | None
    """Range and half of its 95 % interval."""
    onset_deg: float | None
    stiffness_nm_deg: float | None
    outward: int
    """Sign of the apparatus angle on the way out."""
    curve: TorqueAngleCurve | None
    """Its angles and torques are positive outwards. None for a baseline, and if nothing was measured."""
    held_s: float | None
    """Time for which a stretch held its torque. None for a test and a baseline, and if it was not counted."""


@dataclass(frozen=True)
class RunContent:
    """One playback."""

    number: int
    recording: str
    side: str
    """The shoulder of the recording."""
    started_at: datetime
    ended_at: datetime | None
    outcome: str
    stop: PrintedStop | None
    playback_settings: PlaybackDescription
    rate_hz: int | None
    reversals: int | None
    least_range_percent: float | None
    compared_percent: float | None
    partial: bool
    clock_offset_s: float | None
    work_j: float | None
    """Work of the patient in a self-paced run; None in another run."""
    mean_effort_nm: float | None
    mean_pace_percent: float | None
    """None also in a self-paced run of a version that did not store it."""
    worst_rmse_deg: float | None
    worst_peak_deg: float | None
    motors: tuple[MotorErrors, ...]
    motions: tuple[MotionReach, ...]
    end_feel: PrintedEndFeel | None
    """None for a playback."""
    parts: RunFigureSamples | None
    """Data for the run's curves; None if there is nothing to draw."""


@dataclass(frozen=True)
class PlannedItem:
    """One item of a programme, with the numbers of its runs in the report and their outcomes."""

    position: int
    recording: str
    playback_settings: PlaybackDescription
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
class PrintedEndRange:
    """End-range time of one motion in a session or a week: counted, and prescribed."""

    begins: datetime | date
    """Start of the session, or the Monday of the week."""
    motion: int
    counted_s: float | None
    """None if no time was counted."""
    prescribed_s: float | None
    """None if no number of sessions per week is prescribed."""


@dataclass(frozen=True)
class PrintedDose:
    """The prescribed end-range time of one motion, of a session and of its week."""

    thresholds: tuple[tuple[float, float], ...]
    """Band in degrees and torque in Nm of each item that prescribes the motion."""
    session: PrintedEndRange
    week: PrintedEndRange


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
    doses: tuple[PrintedDose, ...] = ()
    """Prescribed end-range times, by motion."""


@dataclass(frozen=True)
class PrintedStage:
    """The stage of a shoulder from a given day on."""

    stage: str
    since: date


@dataclass(frozen=True)
class Limit:
    """A doctor's limit of one basic motion. None means the apparatus's own limit."""

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
    """Range of one motion: values of the treated shoulder over time, and values for comparison."""

    motion: str
    kind: str
    position: str
    readings: tuple[DatedValue, ...]
    """Values of the treated side, oldest first; at least one."""
    other: DatedValue | None
    """The newest value of the other side."""
    reference_deg: float | None


@dataclass(frozen=True)
class ScoreSeries:
    """Values of one score over time, oldest first; at least one."""

    name: str
    readings: tuple[DatedValue, ...]


@dataclass(frozen=True)
class PrintedThreshold:
    """A change of a total in points, with its source. ``up_to``: upper end, if the source gives a range."""

    points: float
    source: str
    up_to: float | None = None


@dataclass(frozen=True)
class QuestionnaireSeries:
    """Totals of one questionnaire over time, oldest first; at least one."""

    title: str
    lowest: float
    highest: float
    better: str
    """lower or higher."""
    is_t_score: bool
    important: PrintedThreshold
    detectable: PrintedThreshold
    readings: tuple[DatedValue, ...]
    meaning: str | None
    """Meaning of the change from the first to the newest total (:mod:`kata.clinic.questionnaires.changes`); None for a single total."""


@dataclass(frozen=True)
class PrintedSession:
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
    was_played: bool
    """True if the apparatus began a motion of a recording."""


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
    needs_permission: bool
    """True if it forbids treatment, and a doctor may allow it but has not."""


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
    """Contraindications from the list that concern the patient or this shoulder, also those of its other episodes, oldest first."""
    limits: tuple[Limit, ...]
    max_resistance_level: int | None
    max_speed_deg_s: float | None
    limits_by: str
    stages: tuple[PrintedStage, ...]
    assessed_at: tuple[datetime, ...]
    rom: tuple[RomSeries, ...]
    pain: tuple[ScoreSeries, ...]
    questionnaires: tuple[QuestionnaireSeries, ...]
    sessions: tuple[PrintedSession, ...]
    stops: tuple[tuple[PrintedStop, int], ...]
    """Each cause of a stop, with the number of sessions in which it occurred."""
    closing_note: str
    end_range_weeks: tuple[PrintedEndRange, ...] = ()
    """Weeks with a counted or prescribed end-range time, by motion, oldest first."""


@dataclass(frozen=True)
class PrescriptionItem:
    """One recording of a prescription, and the settings of its playback."""

    recording: str
    playback_settings: PlaybackDescription


@dataclass(frozen=True)
class Prescription:
    """The newest version of a programme."""

    name: str
    sessions_per_week: int | None
    items: tuple[PrescriptionItem, ...]


@dataclass(frozen=True)
class RehabilitationPlanContent:
    """Data of the record for a rehabilitation plan."""

    episode: EpisodeContent
    prescriptions: tuple[Prescription, ...]
