"""What stands in a report, in no language yet: plain values that cross to the process which draws them."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from kata.motion.edit import PlaybackSettings
from kata.plotting.figures import RunFigureSamples


@dataclass(frozen=True)
class ReportPatient:
    """Whose report it is."""

    name: str
    kana: str | None
    clinic_number: str
    birth_date: date | None
    sex: str


@dataclass(frozen=True)
class Check:
    """One answer of the checklist: what for, when, and by whom; empty where the apparatus told it."""

    check: str
    subject: str
    at: datetime
    by: str


@dataclass(frozen=True)
class Stop:
    """What stopped a run."""

    code: str
    message: str
    motor: int | None = None
    """From 1; None where it belongs to none, or was stored before 0009."""


def motor_of(key: Mapping[str, Any] | None) -> int | None:
    """Return the motor that is a parameter of a stored text."""
    motor: int | None = key["params"].get("motor") if key else None
    return motor


@dataclass(frozen=True)
class PlaybackDescription:
    """PlaybackDescription a recording is played."""

    asked: PlaybackSettings
    load_level: int | None
    method: str | None


@dataclass(frozen=True)
class MotorErrors:
    """Playback minus teaching, of one motor."""

    motor: int
    peak_deg: float
    rmse_deg: float
    start_deg: float
    lag_ms: float | None
    torque_peak_nm: float | None


@dataclass(frozen=True)
class MotionReach:
    """PlaybackDescription far the body went in one basic motion: what was asked, what was reached, what a healthy shoulder does."""

    motion: int
    peak_deg: float
    rmse_deg: float
    asked_deg: tuple[float, float] | None
    reached_deg: tuple[float, float] | None
    reference_deg: tuple[float, float]


@dataclass(frozen=True)
class RunContent:
    """One playback."""

    number: int
    recording: str
    started_at: datetime
    ended_at: datetime | None
    outcome: str
    stop: Stop | None
    how: PlaybackDescription
    rate_hz: int | None
    reversals: int | None
    least_range_percent: float | None
    worst_rmse_deg: float | None
    worst_peak_deg: float | None
    motors: tuple[MotorErrors, ...]
    motions: tuple[MotionReach, ...]
    parts: RunFigureSamples | None
    """What its curves are drawn from; None where there is nothing to draw."""


@dataclass(frozen=True)
class PlannedItem:
    """One line of a programme, and the runs that came of it: their numbers in the report and how they ended."""

    position: int
    recording: str
    how: PlaybackDescription
    repetitions_done: int
    runs: tuple[tuple[int, str], ...]


@dataclass(frozen=True)
class Plan:
    """What was prescribed for a session."""

    name: str
    version: int
    made_by: str
    timer_minutes: float | None
    items: tuple[PlannedItem, ...]
    besides: tuple[int, ...]
    """Numbers of the runs that were not planned."""


@dataclass(frozen=True)
class Addendum:
    """What was added to a signed note."""

    written_at: datetime
    written_by: str
    text: str


@dataclass(frozen=True)
class SessionContent:
    """One visit."""

    patient: ReportPatient
    side: str | None
    diagnosis: str
    started_at: datetime
    ended_at: datetime | None
    end_reason: str | None
    therapist: str
    station: str
    checks: tuple[Check, ...]
    pain_before: int | None
    pain_during: int | None
    pain_after: int | None
    plan: Plan | None
    runs: tuple[RunContent, ...]
    note: str
    signed_at: datetime | None
    signed_by: str
    addenda: tuple[Addendum, ...]


@dataclass(frozen=True)
class Stage:
    """From a day on."""

    stage: str
    since: date


@dataclass(frozen=True)
class Limit:
    """What a doctor allows of one basic motion; None: as far as the apparatus goes."""

    motion: int
    lowest_deg: float | None
    highest_deg: float | None


@dataclass(frozen=True)
class DatedValue:
    """A number and when it was found."""

    at: datetime
    value: float


@dataclass(frozen=True)
class RomSeries:
    """One motion's range: the treated shoulder over time, and what it is held against."""

    motion: str
    kind: str
    position: str
    readings: tuple[DatedValue, ...]
    """Of the treated side, oldest first; at least one."""
    other: DatedValue | None
    """The newest of the other side."""
    reference_deg: float | None


@dataclass(frozen=True)
class ScoreSeries:
    """One score over time, oldest first; at least one reading."""

    name: str
    readings: tuple[DatedValue, ...]


@dataclass(frozen=True)
class Visit:
    """A session in the episode's list."""

    started_at: datetime
    therapist: str
    planned: int | None
    """Repetitions that its programme prescribes; None without one."""
    done: int
    """PlaybackDescription many of those were played to their end; without a programme, how many were at all."""
    stops: int
    pain_before: int | None
    pain_after: int | None
    worst_rmse_deg: float | None
    signed: bool


@dataclass(frozen=True)
class EpisodeContent:
    """The care of one shoulder."""

    patient: ReportPatient
    side: str
    diagnosis: str
    onset_on: date | None
    opened_at: datetime
    closed_at: datetime | None
    contraindications: str
    limits: tuple[Limit, ...]
    max_load_level: int | None
    max_speed_deg_s: float | None
    limits_by: str
    stages: tuple[Stage, ...]
    assessed_at: tuple[datetime, ...]
    rom: tuple[RomSeries, ...]
    pain: tuple[ScoreSeries, ...]
    spadi: tuple[DatedValue, ...]
    visits: tuple[Visit, ...]
    stops: tuple[tuple[Stop, int], ...]
    """Causes and in how many sessions each came."""
    closing_note: str
