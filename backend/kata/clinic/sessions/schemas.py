"""Sessions and runs as they go in and out."""

from typing import Literal
from uuid import UUID

from pydantic import Field

from kata.clinic.recordings.schemas import Figure
from kata.clinic.sessions.checklist import CheckName
from kata.motion import edit
from kata.motion.method import Method
from kata.station.schemas import LoadLevel, OptionalKey
from kata.types import By, Moment, Motor, Name, Note, Pain, Schema, Side

EndReason = Literal["completed", "shortened", "stopped", "patient_request", "other"]
"""completed: as planned. shortened: by the therapist. stopped: a stop ended it."""
PainWhen = Literal["pain_before", "pain_during", "pain_after"]
Outcome = Literal["loaded", "completed", "returned", "stopped", "unloaded", "interrupted"]


class PlaybackSettings(Schema):
    """How a recording is to be played. Unless given, as it was taught, once."""

    speed_percent: float = Field(
        100.0,
        ge=edit.SPEED_PERCENT[0],
        le=edit.SPEED_PERCENT[1],
        description="Speed, percent of what was taught.",
        examples=[50.0],
    )
    repetitions: int = Field(1, ge=1, le=200, description="How often.", examples=[10])
    pause_s: float = Field(
        0.0, ge=0, le=120, description="Standstill at each end between repetitions, seconds.", examples=[2.0]
    )
    range_percent: float = Field(
        100.0,
        ge=edit.RANGE_PERCENT[0],
        le=edit.RANGE_PERCENT[1],
        description="Range of motion, percent of what was taught, around the middle of what each motor goes through.",
        examples=[80.0],
    )


class Tracking(Schema):
    """One angle's figures: playback minus what was asked for, which is what was taught with the run's settings."""

    peak_deg: float = Field(description="Largest error with its sign, degrees.", examples=[-1.4])
    peak_at_s: float = Field(description="Where on the motion, seconds.", examples=[6.2])
    rmse_deg: float = Field(ge=0, description="Root of the mean square, degrees.", examples=[0.4])
    start_deg: float = Field(description="Error of the first sample, degrees.", examples=[0.1])
    lag_ms: float | None = Field(
        description="How much later playback does the same, milliseconds; null where the angle hardly moves.",
        examples=[12.5],
    )
    taught_min_deg: float | None = Field(description="Lowest angle asked for, degrees.", examples=[5.0])
    taught_max_deg: float | None = Field(description="Highest angle asked for, degrees.", examples=[100.0])
    played_min_deg: float | None = Field(description="Lowest angle reached, degrees.", examples=[5.2])
    played_max_deg: float | None = Field(description="Highest angle reached, degrees.", examples=[99.1])
    taught_smoothness: float | None = Field(
        le=0,
        description="Spectral arc length of what was asked for, over the part that was played: about -1.4 for one smooth "
        "movement, lower for more of them, for stops and for tremor. Null where the angle hardly moves.",
        examples=[-2.1],
    )
    played_smoothness: float | None = Field(
        le=0, description="Spectral arc length of the playback; null where the angle hardly moves.", examples=[-2.2]
    )


class MotorTracking(Tracking):
    """One motor's figures."""

    motor: Motor
    torque_peak_nm: float | None = Field(
        description="Largest torque while playing with its sign, newton metres.", examples=[2.1]
    )


class MotionTracking(Tracking):
    """One basic motion's figures, in the body's angle."""

    motion: int = Field(ge=1, le=6, description="Its row of Table 2 of Sun et al. (2025).", examples=[4])
    name: str = Field(examples=["Abduction / adduction of the shoulder"])
    name_key: OptionalKey = None
    apparatus_min_deg: float = Field(description="Lower end of the apparatus' range, degrees.", examples=[0.0])
    apparatus_max_deg: float = Field(description="Upper end of the apparatus' range, degrees.", examples=[120.0])
    reference_min_deg: float = Field(description="Lower end of a healthy shoulder's range, degrees.", examples=[0.0])
    reference_max_deg: float = Field(description="Upper end of a healthy shoulder's range, degrees.", examples=[180.0])


class Comparison(Schema):
    """Playback against teaching."""

    samples: int = Field(ge=1, description="Samples compared.")
    motors: list[MotorTracking] = Field(min_length=5, max_length=5)
    motions: list[MotionTracking] = Field(
        max_length=6, description="Those of the six basic motions that the recording moves; none for older runs."
    )


class RunStop(Schema):
    """What stopped a run."""

    code: str = Field(examples=["estop_pressed"])
    message: str = Field(examples=["The emergency stop was pressed."])
    message_key: OptionalKey = None


class Run(PlaybackSettings):
    """One playback of one recording."""

    id: UUID
    session_id: UUID
    recording_id: UUID
    recording_name: str
    started_at: Moment
    ended_at: Moment | None
    outcome: Outcome = Field(
        description="loaded: not ended yet. completed: played to its end. returned: ended early by the therapist. "
        "stopped: by a stop. unloaded: never played. interrupted: the control program ended during it."
    )
    stop: RunStop | None
    rate_hz: int | None = Field(ge=1, description="Samples a second.")
    method: Method | None = Field(
        description="paper: 10 Hz, each sample held. smooth. learned: smooth, corrected by what earlier runs have taught. "
        "Null for a run of before there were methods."
    )
    load_level: LoadLevel | None = Field(
        description="Resistance at which the arm was to be taken back; null for a run of before there were levels."
    )
    programme_position: int | None = Field(
        ge=1, description="Which item of the session's programme it is; null where it was chosen besides."
    )
    repetitions_done: int | None = Field(
        ge=0, description="Whole ones; null while it goes on, and for a run of before that was kept."
    )
    reversals: int | None = Field(
        ge=0, description="How often the arm met resistance and was taken back; null as for repetitions_done."
    )
    least_range_percent: float | None = Field(
        ge=0, le=100, description="How little of its range was played after somebody asked for less; null: nobody did."
    )
    comparison: Comparison | None = Field(description="Null while nothing was played.")


class RunFigure(Schema):
    """The paper's figure for one motor: angles on the left axis, error on the right one."""

    motor: Motor
    figure: Figure


class RunFigures(Schema):
    """One figure a motor."""

    motors: list[RunFigure]


class SessionPatient(Schema):
    """Whose session it is."""

    id: UUID
    name: str
    clinic_number: str


class SessionCreate(Schema):
    """What is needed to begin a session."""

    patient_id: UUID
    therapist: By = Field("", description="Who treats: you, unless somebody else is named.", examples=["Ito Mai"])
    programme_version_id: UUID | None = Field(None, description="What is planned; of the patient's open episode.")


class SessionUpdate(Schema):
    """Any part of it. ``updated_at`` is the one the editor saw; if the session has changed since, nothing is saved."""

    therapist: Name | None = None
    programme_version_id: UUID | None = None
    pain_before: Pain | None = None
    pain_during: Pain | None = None
    pain_after: Pain | None = None
    note: Note | None = None
    updated_at: Moment | None = None


class SessionEnd(Schema):
    """How a session ended."""

    reason: EndReason | None = Field(None, description="As what happened suggests unless given.")


class SessionSign(Schema):
    """Who signs which note. ``updated_at`` as in a change: nobody signs what they have not seen."""

    signed_by: By = Field("", description="You, unless somebody else is named.")
    note: Note = Field(min_length=1, description="The note as it is signed.")
    updated_at: Moment | None = None


class AddendumCreate(Schema):
    """What is added to a signed note."""

    written_by: By = Field("", description="You, unless somebody else is named.")
    text: Note = Field(min_length=1)


class Addendum(Schema):
    """What was added, and when."""

    id: UUID
    written_by: str
    text: str
    written_at: Moment


class CheckConfirmation(Schema):
    """Somebody has looked."""

    checked_by: By = Field("", description="You, unless somebody else is named.")
    recording_id: UUID | None = Field(None, description="What is to be played: it says which fixtures are meant.")


class SessionCheck(Schema):
    """One thing to be in order before something is taught or played."""

    check: CheckName
    subject: str = Field(description="What an answer is good for: a side, fixtures.", examples=["arm_fixer_1"])
    sentence: str = Field(examples=["The belt holds the patient in the seat."])
    sentence_key: OptionalKey = None
    detected: bool = Field(description="The apparatus itself tells; it cannot be ticked.")
    given: bool
    checked_by: str | None = Field(description="Null where it was detected, or is open.")
    checked_at: Moment | None


class Checklist(Schema):
    """What has to be in order, and what is."""

    checks: list[SessionCheck]
    complete: bool = Field(description="Nothing is open: it may be taught, or the recording loaded.")


class CheckAnswer(Schema):
    """An answer as it is kept with the session."""

    check: CheckName
    subject: str = Field(description="What it was given for: a side, fixtures.", examples=["arm_fixer_1"])
    at: Moment
    by: str = Field(description="Empty where the apparatus itself told.")


class SessionItem(PlaybackSettings):
    """One recording of the session's programme."""

    position: int = Field(ge=1)
    recording_id: UUID
    recording_name: str
    load_level: LoadLevel
    method: Method


class SessionProgramme(Schema):
    """What was planned: one version of a programme."""

    id: UUID
    name: str = Field(examples=["Weeks 3 to 6"])
    version_id: UUID
    number: int = Field(ge=1, description="Of the version.")
    timer_minutes: float | None = Field(
        gt=0, description="After so many minutes no further repetition or recording is begun."
    )
    items: list[SessionItem]


class ReadyPatient(Schema):
    """Somebody whom a session can be begun for, or goes on for, without the database."""

    patient: SessionPatient
    side: Side | None = Field(description="Of the episode of care that goes on: the shoulder that is treated.")
    contraindications: str = Field(description="Of that episode.", examples=["No external rotation beyond 30 degrees."])
    programme: SessionProgramme | None = Field(description="What a session is planned by; null: none can be begun.")
    session: "Session | None" = Field(description="The one that goes on, or was ended last meanwhile.")


class Draft(Schema):
    """What the note could say."""

    text: str
    end_reason: EndReason = Field(description="What the session's end could be called.")


class Session(Schema):
    """A session with its runs, in their order."""

    id: UUID
    patient: SessionPatient
    episode_id: UUID | None
    side: Side | None = Field(description="Of the episode: the shoulder that is treated.")
    therapist: str
    station: str
    programme: SessionProgramme | None = Field(description="Null where recordings were chosen one by one.")
    started_at: Moment
    ended_at: Moment | None
    end_reason: EndReason | None
    checks: list[CheckAnswer] = Field(description="The checklist's answers, oldest first.")
    pain_before: Pain | None
    pain_during: Pain | None
    pain_after: Pain | None
    note: str
    signed_at: Moment | None = Field(description="From then on only addenda are added.")
    signed_by: str
    addenda: list[Addendum]
    updated_at: Moment
    runs: list[Run]
