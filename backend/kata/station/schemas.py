"""The live state that the browser receives: the device's snapshot and its age."""

from datetime import datetime
from typing import Annotated, Any, Literal
from uuid import UUID

from pydantic import BaseModel, ConfigDict, Field

from kata.device.ipc_messages import (
    RESISTANCE_LEVELS,
    CommandName,
    EstopState,
    Mode,
    PedalState,
    StretchPhase,
    TorqueState,
)
from kata.messages import key_of
from kata.motion.axes import Side
from kata.station.rhythm_schemas import RhythmLive

DeviceState = Literal["starting", "running", "restarting"]
Motor = Annotated[int, Field(ge=1, le=5, description="Motor number, 1 to 5.", examples=[3])]
ResistanceLevel = Annotated[
    int,
    Field(
        ge=1,
        le=RESISTANCE_LEVELS,
        description="Resistance at which the arm moves back, from 1 (light) to 25 (the motors' rated torque).",
        examples=[8],
    ),
]


class _Schema(BaseModel):
    model_config = ConfigDict(frozen=True)


class NestedText(_Schema):
    """A text within another text."""

    code: str = Field(description="Empty: the text has no code and is not translated.")
    params: dict[str, Any] = Field(description="Parameters, like those of the outer text.")
    text: str = Field(description="The text in English.")


Param = int | float | str | NestedText | list[NestedText]


class TextKey(_Schema):
    """Stable code and parameters of a text, for its translation."""

    code: str = Field(description="Code in `frontend/server-messages.json`.", examples=["motor_out_of_range"])
    params: dict[str, Param] = Field(examples=[{"motor": 3}])

    @classmethod
    def of(cls, text: str | None) -> "TextKey | None":
        """Return the key of a text; None for a string without a code."""
        key = key_of(text)
        return None if key is None else cls(code=key.code, params=key.params)


OptionalKey = Annotated[
    TextKey | None, Field(description="Code and parameters of the English text; null: it has none.")
]


class AxisInfo(_Schema):
    """Limits of one motor."""

    motor: Motor
    min_deg: float = Field(description="Lowest angle, degrees.", examples=[-20.0])
    max_deg: float = Field(description="Highest angle, degrees.", examples=[190.0])
    max_speed_deg_s: float = Field(gt=0, description="Highest speed, degrees a second.", examples=[150.0])


class StationInfo(_Schema):
    """Properties that do not change while the service runs."""

    name: str = Field(examples=["Station 1"])
    rate_hz: int = Field(ge=1, description="Samples and setpoints a second.", examples=[100])
    cycle_hz: int = Field(ge=20, le=500, description="Bus cycles a second.", examples=[100])
    simulated: bool = Field(description="The apparatus is simulated; /api/simulator moves its hand, pedal and switch.")
    axes: list[AxisInfo] = Field(min_length=5, max_length=5, description="Axis order 1-5.")


class AxisLive(_Schema):
    """State of one axis."""

    motor: Motor
    setpoint_deg: float | None = Field(
        description="Degrees; equals the measured angle while torque is off; null while the drive never answered."
    )
    measured_deg: float | None = Field(description="Degrees; null while the drive never answered.")
    speed_deg_s: float = Field(description="Degrees a second.")
    torque_nm: float = Field(description="Newton metres, from the drive's current.")
    torque: TorqueState = Field(description="unknown: the drive may hold the arm.")
    age_ms: float | None = Field(ge=0, description="Time from the drive's last answer to the snapshot, milliseconds.")
    voltage_v: float | None = Field(None, description="Supply voltage, volts; null: unknown, or not reported.")
    temperature_c: float | None = Field(
        None, description="Temperature of the drive, degrees Celsius; null: unknown, or not reported."
    )


class DriveWarningLive(_Schema):
    """A drive is near one of its own limits. The warning does not stop the apparatus."""

    code: str = Field(examples=["drive_hot"])
    motor: Motor
    message: str = Field(examples=["Motor 3 has reached 72 °C. It switches off above 80 °C."])
    next_step: str = Field(
        examples=[
            "End the motion and let the motor cool down. If it stays warm, check whether the arm pushes against something."
        ]
    )
    message_key: OptionalKey = None
    next_step_key: OptionalKey = None


class DriveTrendPoint(_Schema):
    """Values that the drives reported at one time."""

    at: datetime
    voltage_v: list[float | None] = Field(
        min_length=5, max_length=5, description="Axis order: supply voltage, volts; null: unknown."
    )
    temperature_c: list[float | None] = Field(
        min_length=5, max_length=5, description="Axis order: temperature, degrees Celsius; null: unknown."
    )


class StopCauseLive(_Schema):
    """A cause of the stop."""

    code: str = Field(examples=["estop_pressed"])
    category: Literal[0, 1, 2] = Field(description="0: torque off at once. 1: ramped down, then torque off. 2: held.")
    message: str = Field(examples=["The emergency stop was pressed."])
    next_step: str = Field(examples=["Support the arm and check the patient. Release the switch, then acknowledge."])
    axis: int | None = Field(ge=1, le=5, description="Motor number, if the cause belongs to a motor.")
    cleared: bool = Field(
        description="The condition has ended. A stop can be acknowledged when every cause is cleared."
    )
    message_key: OptionalKey = None
    next_step_key: OptionalKey = None


class StopLive(_Schema):
    """A latched stop with its causes, the first one first."""

    causes: list[StopCauseLive] = Field(min_length=1)
    arm_held: bool = Field(
        description="The motors hold the arm, or may hold it because their torque is unknown: support the arm."
    )


class PatientRef(_Schema):
    """The patient on the apparatus."""

    id: UUID
    name: str = Field(examples=["Yamada Hanako"])


class EndRangeLive(_Schema):
    """The prescribed end-range time of the loaded run, and the part of it that this run has reached so far."""

    motion: int = Field(ge=3, le=6, description="Number of the motion in Table 2.", examples=[4])
    name: str = Field(examples=["Abduction / adduction of the shoulder"])
    name_key: OptionalKey = None
    counted_s: float | None = Field(
        ge=0,
        description="End-range time of this run so far, seconds, counted from the live state. The stored time after the run replaces it. "
        "Null if the station's load is not identified: no time is counted.",
    )
    prescribed_s: float = Field(gt=0, description="Prescribed end-range time per session, seconds.")
    band_deg: float = Field(gt=0, description="Time counts at most this far before the end, degrees.")
    torque_nm: float = Field(gt=0, description="Time counts with at least this torque, newton metres.")
    problem: str | None = Field(
        None,
        description="The reason why the torque cannot be reached at the run's resistance level, so that no time is counted; null if it can.",
    )
    problem_key: OptionalKey = None


class StretchLive(_Schema):
    """A stretch."""

    phase: StretchPhase = Field(description="out: towards the torque. hold: the torque is held. release: back to rest.")
    torque_nm: float = Field(description="Torque between apparatus and shoulder, outwards, newton metres.")
    target_nm: float = Field(
        gt=0, description="The chosen torque, or less after a request to reduce it, newton metres."
    )
    hold_left_s: float = Field(ge=0, description="Remaining time of the present hold, seconds.")
    held_s: float = Field(ge=0, description="Time with at least 60 % of the torque in all repetitions, seconds.")
    repetitions_left: int = Field(ge=0, description="Number of repetitions that have not ended.")


class SelfPacingLive(_Schema):
    """Pace, effort and work of a self-paced run."""

    pace_percent: float = Field(ge=0, le=100, description="Pace, percent of the recording's speed.")
    effort_nm: float = Field(
        description="Mean torque of the patient along the path over the last half second, forwards, newton metres."
    )
    threshold_nm: float = Field(ge=0, description="Effort that does not move the arm, newton metres.")
    work_j: float = Field(description="Work of the patient along the path since the start, joules.")


class RunLive(_Schema):
    """The loaded recording and the arm's position in it."""

    run_id: UUID
    recording_id: UUID
    session_id: UUID | None
    recording_name: str | None
    changes: list[str] = Field(
        description="Changes of the recording for this run, as texts.", examples=[["at 50 % speed"]]
    )
    changes_keys: list[OptionalKey] = Field([], description="Code and parameters of each of `changes`.")
    patient: PatientRef | None
    position_s: float = Field(ge=0, description="Position in the recording, seconds.")
    duration_s: float = Field(ge=0, description="Length of the playback in this run, seconds.")
    left_s: float | None = Field(
        description="Remaining time of approach or return, else of the recording, seconds; null: it depends on the patient, in an end-feel "
        "test, a stretch or a self-paced run."
    )
    at_start: bool = Field(description="The arm is held at the recording's start and ready to play.")
    resistance_level: ResistanceLevel
    reversals: int = Field(ge=0, description="Number of times that the arm met resistance and moved back.")
    reversing: bool = Field(description="The arm moves back from resistance, or waits after it.")
    range_percent: float = Field(
        ge=0, le=100, description="Share of the range that is played: below 100 after a request to reduce it."
    )
    resistance: str | None = Field(
        description="Description of the last resistance; null: none.",
        examples=["Motor 3 met resistance at 12.3 s; the arm is moved back."],
    )
    resistance_key: OptionalKey = None
    stretch: StretchLive | None = Field(None, description="Null: the run is no stretch.")
    self_pacing: SelfPacingLive | None = Field(None, description="Null: the run is not self-paced.")
    end_range: EndRangeLive | None = Field(None, description="Null: no end-range time is prescribed for this run.")


class TeachingLive(_Schema):
    """The running teaching."""

    teaching_id: UUID
    patient: PatientRef | None
    takes: int = Field(ge=0, description="Number of takes so far.")
    recording: bool = Field(description="The pedal is down and samples are recorded.")
    take_s: float = Field(ge=0, description="Length of the present or last take, seconds.")
    samples: int = Field(ge=0, description="Samples recorded in all takes.")


class RefusalLive(_Schema):
    """Reason why a command is refused now."""

    code: str = Field(examples=["is_idle"])
    message: str = Field(examples=["No recording is loaded."])
    next_step: str = Field(examples=["Load a recording first."])
    message_key: OptionalKey = None
    next_step_key: OptionalKey = None


class LoopLive(_Schema):
    """Health of the control loop since it started."""

    cycle_hz: int = Field(ge=20, le=500, description="Bus cycles a second.")
    rate_hz: int = Field(ge=1, description="Samples and setpoints a second.")
    cycles: int = Field(ge=0)
    overruns: int = Field(ge=0, description="Cycles missed because the previous cycle ended late.")
    lateness_p50_ms: float = Field(ge=0, description="Half of the cycles began no later than this, milliseconds.")
    lateness_p99_ms: float = Field(ge=0, description="99 % of the cycles began no later than this, milliseconds.")
    lateness_p999_ms: float = Field(ge=0, description="99.9 % of the cycles began no later than this, milliseconds.")
    lateness_max_ms: float = Field(ge=0, description="Latest start of a cycle, milliseconds.")
    bus_errors: int = Field(ge=0, description="Replies that were missing or damaged.")
    drive_errors: list[int] = Field(
        min_length=5, max_length=5, description="Axis order: cycles without a valid answer of the drive."
    )
    telemetry_dropped: int = Field(ge=0, description="Snapshots that never reached the service.")
    real_time: bool = Field(description="SCHED_FIFO was granted.")
    memory_locked: bool = Field(description="The control program's memory is locked, so it never waits for a disk.")


class LeaseLive(_Schema):
    """The lease of the apparatus. Its holder operates; other users watch and may stop the apparatus."""

    holder: str | None = Field(
        description="Name of the operator; null: the lease is free, and the first command takes it.",
        examples=["Sato"],
    )
    mine: bool = Field(description="The receiving browser holds the lease.")
    since: datetime | None
    taken_from: str | None = Field(
        description="Previous operator, if this one took over; else null.", examples=["Kato"]
    )
    unreachable_since: datetime | None = Field(
        description="Time since which the holder's browser has been unreachable. A page that hangs is unreachable from 1 s after "
        "its last shown state. Playback pauses 2 s later, and the motors release the arm after 30 s. Null while it is reachable."
    )
    paused: bool = Field(description="The playback was paused because the holder's browser was unreachable.")


class DatabaseStatus(_Schema):
    """The database as the station sees it. While it is unavailable, records are spooled on this computer."""

    unavailable_since: datetime | None = Field(
        None, description="Time since which the database has been unavailable; null while it is available."
    )
    waiting: int = Field(0, ge=0, description="Number of spooled records that are not in the database yet.")
    spool_full_since: datetime | None = Field(
        None, description="Time since which this computer's disk has been unable to store records; null while it can."
    )


class Live(_Schema):
    """The newest state of the station. Without a running device process it is out of date: see ``age_ms``."""

    device: DeviceState
    at: datetime = Field(
        description="Time at which the service made this state, UTC. Commands that can start motion carry it as `seen_at`."
    )
    age_ms: float | None = Field(
        ge=0, description="Age of the device process's last snapshot, milliseconds; null: none yet."
    )
    side: Side = Field(description="The shoulder that the apparatus is set to.")
    mode: Mode
    torque: TorqueState = Field(
        description="Torque of all drives together: on if one drive has torque, else unknown if one drive may have torque."
    )
    stops: int = Field(
        ge=0,
        description="Number of stops. Each Stop command, each Pause command, each latched stop, each load and each reversal by resistance "
        "adds one. Commands that can start motion carry this number.",
    )
    verified_since: datetime | None = Field(
        description="Time since which the apparatus has been connected and every drive configured, without interruption; else null. "
        "An emergency-stop test from before this time does not count."
    )
    estop: EstopState
    pedal: PedalState
    axes: list[AxisLive]
    stop: StopLive | None
    run: RunLive | None
    teaching: TeachingLive | None
    rhythm: RhythmLive | None = Field(
        None, description="Rhythm of the present take or playback, once a second; null without one."
    )
    refusals: dict[CommandName, RefusalLive] = Field(
        description="Commands that are refused now, with the reasons. Other commands are allowed."
    )
    lease: LeaseLive
    loop: LoopLive | None
    warnings: list[DriveWarningLive] = Field([], description="Drives near their own limits, in axis order.")
    database: DatabaseStatus = DatabaseStatus()


class EventLive(_Schema):
    """An event of the apparatus."""

    number: int = Field(
        ge=1, description="Consecutive since the device process started; 1 for an event of the service."
    )
    code: str = Field(examples=["take_started"])
    message: str = Field(examples=["Take 1 is being recorded."])
    message_key: OptionalKey = None
    at: datetime
