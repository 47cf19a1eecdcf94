"""Request and response models of sessions and runs."""

from typing import Final, Literal
from uuid import UUID

from pydantic import ConfigDict, Field

from kata.clinic.recordings.schemas import Figure
from kata.clinic.sessions.checklist import CheckName
from kata.clinic.sessions.identity import Identifiers, PatientIdentity
from kata.motion import edit, end_range
from kata.motion.method import Method
from kata.station.schemas import OptionalKey, ResistanceLevel
from kata.types import By, Moment, Motor, Name, Note, Pain, Schema, Side

EndReason = Literal["completed", "shortened", "stopped", "patient_request", "other"]
"""completed: the session went as planned. shortened: the therapist shortened it. stopped: a stop ended it."""
PainWhen = Literal["pain_before", "pain_during", "pain_after"]
EndFeelKind = Literal["baseline", "test", "stretch"]
RunOutcome = Literal["loaded", "completed", "returned", "stopped", "unloaded", "interrupted"]


MINUTES_PER_SESSION: Final = (0.5, 60.0)
"""End-range times that can be prescribed for a session. Half a minute is a few short holds. The longest time is our choice: it is beyond
what a session on the apparatus lasts.
"""


class PlaybackSettings(Schema):
    """Playback settings of a recording. By default it is played once, as taught."""

    speed_percent: float = Field(
        100.0,
        ge=edit.SPEED_PERCENT[0],
        le=edit.SPEED_PERCENT[1],
        description="Speed, percent of the taught speed.",
        examples=[50.0],
    )
    repetitions: int = Field(1, ge=1, le=200, description="Number of repetitions.", examples=[10])
    pause_s: float = Field(
        0.0, ge=0, le=120, description="Pause at each end between repetitions, seconds.", examples=[2.0]
    )
    range_percent: float = Field(
        100.0,
        ge=edit.RANGE_PERCENT[0],
        le=edit.RANGE_PERCENT[1],
        description="Range of motion, percent of the taught range. The end farther from rest moves towards rest; the end nearer to rest "
        "does not move.",
        examples=[80.0],
    )


class EndRangePrescription(Schema):
    """A prescribed end-range time of one motion, with the band and the torque that count."""

    model_config = ConfigDict(frozen=True)

    motion: int = Field(ge=3, le=6, description="Number of the motion of the shoulder joint in Table 2.", examples=[4])
    minutes: float = Field(
        ge=MINUTES_PER_SESSION[0],
        le=MINUTES_PER_SESSION[1],
        description="End-range time per session, minutes.",
        examples=[5.0],
    )
    band_deg: float = Field(
        end_range.BAND_DEG,
        ge=end_range.BAND_BOUNDS_DEG[0],
        le=end_range.BAND_BOUNDS_DEG[1],
        description="Time counts at most this far before the end of the recorded motion, degrees.",
        examples=[10.0],
    )
    torque_nm: float = Field(
        end_range.TORQUE_NM,
        ge=end_range.TORQUE_BOUNDS_NM[0],
        le=end_range.TORQUE_BOUNDS_NM[1],
        description="Time counts with at least this torque between apparatus and shoulder, newton metres.",
        examples=[0.5],
    )


class Tracking(Schema):
    """Errors of one angle. The tracking error is playback minus the requested motion. The requested motion is the taught samples with
    the run's settings.
    """

    peak_deg: float = Field(
        description="Largest tracking error with its sign, without the start, degrees. In runs of versions that did not store "
        "`compared_percent` it includes the start.",
        examples=[-1.4],
    )
    peak_at_s: float = Field(description="Time of the peak on the motion, seconds.", examples=[6.2])
    rmse_deg: float = Field(
        ge=0,
        description="Root mean square of the tracking error, without the start as in `peak_deg`, degrees.",
        examples=[0.4],
    )
    start_deg: float = Field(
        description="Largest tracking error of the first half second with its sign, degrees. In runs of versions that did not store "
        "`compared_percent` it is the error of the first sample.",
        examples=[0.1],
    )
    wall_peak_deg: float | None = Field(
        None, description="Like `peak_deg`, on the wall clock; null for older runs.", examples=[-1.6]
    )
    wall_rmse_deg: float | None = Field(
        None, ge=0, description="Like `rmse_deg`, on the wall clock; null for older runs.", examples=[0.5]
    )
    change_deg: float | None = Field(
        None,
        description="Largest change by settings, with its sign: requested minus taught angle, "
        "degrees. It includes Reduce range. Null for older runs.",
        examples=[-12.5],
    )
    lag_ms: float | None = Field(
        description="Delay of the playback, milliseconds; null if the angle hardly moves.",
        examples=[12.5],
    )
    taught_min_deg: float | None = Field(description="Lowest requested angle, degrees.", examples=[5.0])
    taught_max_deg: float | None = Field(description="Highest requested angle, degrees.", examples=[100.0])
    played_min_deg: float | None = Field(description="Lowest reached angle, degrees.", examples=[5.2])
    played_max_deg: float | None = Field(description="Highest reached angle, degrees.", examples=[99.1])
    taught_smoothness: float | None = Field(
        le=0,
        description="Spectral arc length of the requested motion in the part that was played: about -1.4 for one "
        "smooth movement, lower with several movements, stops or tremor. Null if the angle hardly moves.",
        examples=[-2.1],
    )
    played_smoothness: float | None = Field(
        le=0, description="Spectral arc length of the playback; null if the angle hardly moves.", examples=[-2.2]
    )


class MotorTracking(Tracking):
    """Errors of one motor in motor angles."""

    motor: Motor
    torque_peak_nm: float | None = Field(
        description="Largest torque during playback with its sign, newton metres.", examples=[2.1]
    )


class MotionTracking(Tracking):
    """Errors of one basic motion in apparatus angles. The patient's angle differs from the apparatus angle by slip at the cuff."""

    motion: int = Field(ge=1, le=6, description="Number of the motion in Table 2 of Sun et al. (2025).", examples=[4])
    name: str = Field(examples=["Abduction / adduction of the shoulder"])
    name_key: OptionalKey = None
    patient_min_deg: float | None = Field(
        None,
        description="Patient's angle when the apparatus reached `played_min_deg`, estimated from goniometer readings, degrees. Null "
        "without readings of this motion at two poses, because then only the apparatus angle is known.",
        examples=[12.0],
    )
    patient_min_uncertainty_deg: float | None = Field(
        None,
        gt=0,
        description="The angle is within plus or minus this value in 95 of 100 cases, degrees.",
        examples=[14.0],
    )
    patient_max_deg: float | None = Field(
        None, description="Like `patient_min_deg`, when the apparatus reached `played_max_deg`.", examples=[91.0]
    )
    patient_max_uncertainty_deg: float | None = Field(
        None, gt=0, description="Like `patient_min_uncertainty_deg`, for `patient_max_deg`.", examples=[13.0]
    )
    end_range_s: float | None = Field(
        None,
        ge=0,
        description="End-range time, seconds: time at most `end_range_band_deg` before the end of the recorded motion, with at least "
        "`end_range_torque_nm` between apparatus and shoulder. Null if the station's load is not identified, for the scapula, for a "
        "motion of less than 20 degrees, and for a run of a version that did not count it.",
        examples=[92.5],
    )
    end_range_band_deg: float | None = Field(
        None, gt=0, description="Band before the end, degrees; null as for `end_range_s`.", examples=[10.0]
    )
    end_range_torque_nm: float | None = Field(
        None, ge=0, description="Least torque, newton metres; null as for `end_range_s`.", examples=[0.5]
    )
    apparatus_min_deg: float = Field(description="Lower end of the apparatus's range, degrees.", examples=[0.0])
    apparatus_max_deg: float = Field(description="Upper end of the apparatus's range, degrees.", examples=[120.0])
    reference_min_deg: float = Field(description="Lower end of a healthy shoulder's range, degrees.", examples=[0.0])
    reference_max_deg: float = Field(description="Upper end of a healthy shoulder's range, degrees.", examples=[180.0])


class Comparison(Schema):
    """Comparison of playback and teaching."""

    samples: int = Field(ge=1, description="Number of compared samples.")
    motors: list[MotorTracking] = Field(min_length=5, max_length=5)
    motions: list[MotionTracking] = Field(
        max_length=6, description="Errors of the basic motions in the recording; empty for older runs."
    )


class RunStop(Schema):
    """The cause of a stop."""

    code: str = Field(examples=["estop_pressed"])
    message: str = Field(examples=["The emergency stop was pressed."])
    message_key: OptionalKey = None


class LearningNote(Schema):
    """A message that the learned method used an earlier correction or learned nothing."""

    message: str = Field(
        examples=[
            "an error grew by more than 10 %: the earlier correction of motor 3 is used again, and it learns half as fast"
        ]
    )
    message_key: OptionalKey = None


class Run(PlaybackSettings):
    """One playback of one recording."""

    id: UUID
    session_id: UUID
    recording_id: UUID
    recording_name: str
    side: Side | None = Field(None, description="Shoulder of the recording.")
    started_at: Moment
    ended_at: Moment | None
    outcome: RunOutcome = Field(
        description="loaded: not ended yet. completed: played to its end. returned: the therapist ended it early. "
        "stopped: a stop ended it. unloaded: never played. interrupted: the control program ended during it."
    )
    stop: RunStop | None
    rate_hz: int | None = Field(ge=1, description="Samples a second.")
    method: Method | None = Field(
        description="paper: 10 Hz, each sample held until the next. smooth: interpolated. learned: smooth, corrected by earlier runs. "
        "Null for a run of a version without methods."
    )
    learning: list[LearningNote] = Field(
        [],
        description="Messages of the learned method about this run. Empty: it learned from every motor, or another method was used.",
    )
    resistance_level: ResistanceLevel | None = Field(
        description="Resistance at which the arm is taken back; null for a run of a version without levels."
    )
    self_paced: bool = Field(False, description="True if the patient's effort set the pace.")
    work_j: float | None = Field(
        None,
        description="Work of the patient along the path, joules. Below 0: the patient resisted more than helped. Null for a run that was not "
        "self-paced or has not ended.",
        examples=[4.2],
    )
    mean_effort_nm: float | None = Field(
        None,
        description="Mean torque of the patient along the path while the arm moved, forwards, newton metres. Null as for `work_j`, and if the "
        "arm did not move.",
        examples=[1.8],
    )
    mean_pace_percent: float | None = Field(
        None,
        ge=0,
        description="Mean pace, percent of the requested speed. Waiting for the patient counts as 0; pauses do not count. Null as for "
        "`work_j`, if nothing was played, and for a run of a version that did not store it.",
        examples=[79.0],
    )
    programme_position: int | None = Field(
        ge=1, description="Position in the session's programme; null for a run that was not planned."
    )
    repetitions_done: int | None = Field(
        ge=0,
        description="Completed repetitions; null while the run continues, and for a run of a version that did not store them.",
    )
    reversals: int | None = Field(
        ge=0, description="Number of times that resistance took the arm back; null as for `repetitions_done`."
    )
    least_range_percent: float | None = Field(
        ge=0,
        le=100,
        description="Smallest share of the range that was played after the range was reduced; null if it was not reduced.",
    )
    compared_percent: float | None = Field(
        None,
        ge=0,
        le=100,
        description="Share of the playing time that was compared, percent. Null if nothing was played, and for a run of "
        "a version that did not store it.",
    )
    partial: bool = Field(
        False,
        description="True if less than 90 % of the playing time was compared, or if the playback ended before its first repetition "
        "was complete. Progress charts and the clinic's figures then ignore the errors.",
    )
    clock_offset_s: float | None = Field(
        None,
        description="Largest difference between the wall clock and the clock of the comparison, seconds. The clock of the comparison is "
        "that of the motion, which starts slowly.",
        examples=[0.094],
    )
    end_feel: EndFeelKind | None = Field(
        None,
        description="Null for a playback. baseline, test: the run measured the end-feel and played no recording. "
        "baseline: with a test weight in the fixers. stretch: the run held the shoulder at a torque.",
    )
    comparison: Comparison | None = Field(description="Null if nothing was played with the requested range.")


class RunFigure(Schema):
    """Figure of one motor: angles on the left axis, error on the right axis, as in the paper."""

    motor: Motor
    figure: Figure


class RunFigures(Schema):
    """One figure per motor."""

    motors: list[RunFigure]


class SessionPatient(Schema):
    """The patient of a session."""

    id: UUID
    name: str
    clinic_number: str


class SessionCreate(Schema):
    """A new session."""

    patient_id: UUID
    therapist: By = Field("", description="Name of the therapist; empty: your name.", examples=["Ito Mai"])
    programme_version_id: UUID | None = Field(
        None, description="The plan: a programme version of the patient's open episode."
    )


class SessionUpdate(Schema):
    """A change of a session. ``updated_at`` is the version that the editor saw. If the session has changed since, nothing is saved."""

    therapist: Name | None = None
    programme_version_id: UUID | None = None
    pain_before: Pain | None = None
    pain_during: Pain | None = None
    pain_after: Pain | None = None
    note: Note | None = None
    updated_at: Moment | None = None


class SessionEnd(Schema):
    """The end of a session."""

    reason: EndReason | None = Field(None, description="Reason; by default the reason that the runs suggest.")


class SessionSign(Schema):
    """The signature of a note. ``updated_at`` is the version that the signer saw. If the session has changed since, it is not signed."""

    signed_by: By = Field("", description="Name of the signer; empty: your name.")
    note: Note = Field(min_length=1, description="The signed note.")
    updated_at: Moment | None = None


class AddendumCreate(Schema):
    """An addendum to a signed note."""

    written_by: By = Field("", description="Name of the author; empty: your name.")
    text: Note = Field(min_length=1)


class Addendum(Schema):
    """A stored addendum."""

    id: UUID
    written_by: str
    text: str
    written_at: Moment


class CheckConfirmation(Schema):
    """A user's confirmation of a check."""

    checked_by: By = Field("", description="Name of the person who checked; empty: your name.")
    identifiers: Identifiers = Field(
        default_factory=set, description="Only for the check `identity`: two identifiers that agree."
    )
    recording_id: UUID | None = Field(None, description="Recording to play; it determines the fixtures.")


class SessionCheck(Schema):
    """One check before teaching or playback."""

    check: CheckName
    subject: str = Field(
        description="Side or fixtures for which an answer is valid; empty: any answer is valid.",
        examples=["arm_fixer_1"],
    )
    sentence: str = Field(examples=["The belt holds the patient in the seat."])
    sentence_key: OptionalKey = None
    detected: bool = Field(
        description="True if the apparatus itself answers the check. A user cannot confirm such a check."
    )
    given: bool
    checked_by: str | None = Field(
        description="Name of the person; null if the apparatus answered, and while the check is open."
    )
    checked_at: Moment | None


class Checklist(Schema):
    """The checks and their answers."""

    patient: PatientIdentity
    checks: list[SessionCheck]
    complete: bool = Field(description="True if every check is answered, so that a motion may be taught or loaded.")


class CheckAnswer(Schema):
    """An answer in the form stored with the session."""

    check: CheckName
    subject: str = Field(
        description="Side or fixtures for which the answer was given; for `identity`, the compared identifiers.",
        examples=["birth_date+name"],
    )
    at: Moment
    by: str = Field(description="Name of the person; empty if the apparatus answered.")


class GoniometerReadingCreate(Schema):
    """A goniometer reading of one basic motion at the present pose, or at a given apparatus angle."""

    motion: int = Field(
        ge=3,
        le=6,
        description="Number of a motion of the shoulder joint in Table 2 of Sun et al. (2025).",
        examples=[4],
    )
    patient_deg: float = Field(
        ge=-180, le=210, description="Angle that the goniometer shows, degrees.", examples=[82.0]
    )
    apparatus_deg: float | None = Field(
        None,
        ge=-180,
        le=210,
        description="Apparatus angle of the motion at that moment, degrees. By default the angle that the apparatus measures now.",
        examples=[90.0],
    )
    read_by: By = Field("", description="Name of the person who read it; empty: your name.")


class GoniometerReading(Schema):
    """A stored goniometer reading."""

    id: UUID
    motion: int = Field(ge=3, le=6, description="Number of the motion in Table 2 of Sun et al. (2025).", examples=[4])
    apparatus_deg: float = Field(description="Apparatus angle at that moment, degrees.", examples=[90.0])
    patient_deg: float = Field(description="Angle that the goniometer showed, degrees.", examples=[82.0])
    read_at: Moment
    read_by: str


class SessionItem(PlaybackSettings):
    """One recording of the session's programme."""

    position: int = Field(ge=1)
    recording_id: UUID
    recording_name: str
    resistance_level: ResistanceLevel
    method: Method
    end_range: EndRangePrescription | None = None
    self_paced: bool = Field(False, description="True if it is prescribed that the patient's effort sets the pace.")


class SessionProgramme(Schema):
    """The plan: one version of a programme."""

    id: UUID
    name: str = Field(examples=["Weeks 3 to 6"])
    version_id: UUID
    number: int = Field(ge=1, description="Number of the version.")
    timer_minutes: float | None = Field(gt=0, description="Minutes of playing after which no further item is started.")
    items: list[SessionItem]


class ReadyPatient(Schema):
    """A patient whose session can begin or continue without the database."""

    patient: SessionPatient
    side: Side | None = Field(description="Shoulder of the open episode.")
    contraindications: str = Field(
        description="Contraindications of the open episode.", examples=["No external rotation beyond 30 degrees."]
    )
    programme: SessionProgramme | None = Field(description="Plan of a new session; null: no session can begin.")
    session: "Session | None" = Field(
        description="The open session, or the last session if it ended during the outage."
    )


class Draft(Schema):
    """A drafted note."""

    text: str
    end_reason: EndReason = Field(description="Suggested reason why the session ended.")


class Session(Schema):
    """A session with its runs in order."""

    id: UUID
    patient: SessionPatient
    episode_id: UUID | None
    side: Side | None = Field(description="Treated shoulder of the session's episode.")
    therapist: str
    station: str
    simulated: bool = Field(
        False, description="True if the apparatus was simulated, so that its measured values are invented."
    )
    programme: SessionProgramme | None = Field(description="Null if recordings were chosen one by one.")
    started_at: Moment
    ended_at: Moment | None
    end_reason: EndReason | None
    checks: list[CheckAnswer] = Field(description="Answers of the checklist, oldest first.")
    pain_before: Pain | None
    pain_during: Pain | None
    pain_after: Pain | None
    note: str
    signed_at: Moment | None = Field(description="Time of the signature; afterwards only addenda can be added.")
    signed_by: str
    addenda: list[Addendum]
    goniometer_readings: list[GoniometerReading] = Field(
        [],
        description="Readings, oldest first. From readings of a motion at two poses, the patient's angles are estimated.",
    )
    updated_at: Moment
    runs: list[Run]
