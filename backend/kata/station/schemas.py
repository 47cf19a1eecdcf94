"""Live state as it goes to the browser: the device's snapshot, and how far it can be believed."""

from datetime import datetime
from typing import Annotated, Any, Literal
from uuid import UUID

from pydantic import BaseModel, ConfigDict, Field

from kata.device.messages import LOAD_LEVELS, CommandName, EstopState, Mode, PedalState, TorqueState
from kata.messages import key_of
from kata.motion.axes import Side

DeviceState = Literal["starting", "running", "restarting"]
Motor = Annotated[int, Field(ge=1, le=5, description="Motor number, 1 to 5.", examples=[3])]
LoadLevel = Annotated[
    int,
    Field(
        ge=1,
        le=LOAD_LEVELS,
        description="Resistance at which the arm is taken back: 1 the lightest touch, 25 the motors' rated torque.",
        examples=[8],
    ),
]


class _Schema(BaseModel):
    model_config = ConfigDict(frozen=True)


class NestedText(_Schema):
    """A text within another one."""

    code: str = Field(description="Empty: the text has no code, and is not translated.")
    params: dict[str, Any] = Field(description="As those of the text around it.")
    text: str = Field(description="In English.")


Param = int | float | str | NestedText | list[NestedText]


class TextKey(_Schema):
    """Stable code and parameters of a text, for its translation."""

    code: str = Field(description="Of `frontend/server-messages.json`.", examples=["motor_out_of_range"])
    params: dict[str, Param] = Field(examples=[{"motor": 3}])

    @classmethod
    def of(cls, text: str | None) -> "TextKey | None":
        """Return the key of a text; None for a string without a code."""
        key = key_of(text)
        return None if key is None else cls(code=key.code, params=key.params)


OptionalKey = Annotated[
    TextKey | None, Field(description="Code and parameters of the English text beside it; null: it has none.")
]


class AxisInfo(_Schema):
    """What one motor may do."""

    motor: Motor
    min_deg: float = Field(description="Lower end of its range, degrees.", examples=[-20.0])
    max_deg: float = Field(description="Upper end of its range, degrees.", examples=[190.0])
    max_speed_deg_s: float = Field(gt=0, description="Fastest it may be moved, degrees a second.", examples=[150.0])


class StationInfo(_Schema):
    """What does not change while the service runs."""

    name: str = Field(examples=["Station 1"])
    rate_hz: int = Field(ge=1, description="Samples and setpoints a second.", examples=[100])
    cycle_hz: int = Field(ge=20, le=500, description="Bus cycles a second.", examples=[100])
    simulated: bool = Field(
        description="The apparatus is a simulated one; /api/simulator moves its hand, pedal and switch."
    )
    axes: list[AxisInfo] = Field(min_length=5, max_length=5, description="Axis order 1-5.")


class AxisLive(_Schema):
    """One axis now."""

    motor: Motor
    setpoint_deg: float | None = Field(
        description="Degrees; equals the measured angle while torque is off; null while the drive never answered."
    )
    measured_deg: float | None = Field(description="Degrees; null while the drive never answered.")
    speed_deg_s: float = Field(description="Degrees a second.")
    torque_nm: float = Field(description="Newton metres, from the drive's current.")
    torque: TorqueState = Field(description="unknown: the drive may hold the arm.")
    age_ms: float | None = Field(ge=0, description="Since the drive last answered, when the snapshot was made.")


class StopCauseLive(_Schema):
    """Why the apparatus has stopped."""

    code: str = Field(examples=["estop_pressed"])
    category: Literal[0, 1, 2] = Field(description="0: torque off at once. 1: ramped down, then torque off. 2: held.")
    message: str = Field(examples=["The emergency stop was pressed."])
    next_step: str = Field(examples=["Look after the patient, release the switch, then acknowledge."])
    axis: int | None = Field(ge=1, le=5, description="Motor number, where it belongs to one.")
    cleared: bool = Field(description="Its condition no longer holds; acknowledging needs every cause cleared.")
    message_key: OptionalKey = None
    next_step_key: OptionalKey = None


class StopLive(_Schema):
    """A latched stop, first cause first."""

    causes: list[StopCauseLive] = Field(min_length=1)
    arm_held: bool = Field(
        description="The motors hold the arm, or may hold it because their torque is unknown: support the arm."
    )


class PatientRef(_Schema):
    """Who is on the apparatus."""

    id: UUID
    name: str = Field(examples=["Yamada Hanako"])


class RunLive(_Schema):
    """The loaded recording and how far along it the arm is."""

    run_id: UUID
    recording_id: UUID
    session_id: UUID | None
    recording_name: str | None
    changes: list[str] = Field(
        description="What was done to the recording for this run, in words.", examples=[["at 50 % speed"]]
    )
    changes_keys: list[OptionalKey] = Field([], description="Code and parameters of each of `changes`.")
    patient: PatientRef | None
    position_s: float = Field(ge=0, description="Place on the recording, seconds.")
    duration_s: float = Field(ge=0, description="Length of the recording as it is played in this run, seconds.")
    left_s: float = Field(
        description="Seconds left of the approach or return while those go on, else of the recording."
    )
    at_start: bool = Field(description="Held at the recording's start: ready to play.")
    load_level: LoadLevel
    reversals: int = Field(ge=0, description="How often the arm met resistance and was taken back.")
    reversing: bool = Field(description="It is being taken back just now, or waits where it was taken.")
    range_percent: float = Field(
        ge=0, le=100, description="How much of its range is played: below 100 after somebody has asked for less."
    )
    resistance: str | None = Field(
        description="What was met when the arm was last taken back; null when it never was.",
        examples=["Motor 3 met resistance at 12.3 s; the arm is taken back."],
    )
    resistance_key: OptionalKey = None


class TeachingLive(_Schema):
    """The teaching that goes on."""

    teaching_id: UUID
    patient: PatientRef | None
    takes: int = Field(ge=0, description="Takes begun.")
    recording: bool = Field(description="The pedal is down and samples are kept.")
    take_s: float = Field(ge=0, description="Length of the present or last take, seconds.")
    samples: int = Field(ge=0, description="Samples kept in all takes.")


class RefusalLive(_Schema):
    """Why a command would not be accepted now."""

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
    overruns: int = Field(ge=0, description="Cycles missed because the one before ended late.")
    lateness_p50_ms: float = Field(ge=0, description="Half of the cycles began no later than this, milliseconds.")
    lateness_p99_ms: float = Field(ge=0, description="99 % of the cycles began no later than this, milliseconds.")
    lateness_p999_ms: float = Field(ge=0, description="99.9 % of the cycles began no later than this, milliseconds.")
    lateness_max_ms: float = Field(ge=0, description="Latest start of a cycle, milliseconds.")
    bus_errors: int = Field(ge=0, description="Replies that stayed away or came damaged.")
    drive_errors: list[int] = Field(
        min_length=5, max_length=5, description="Axis order: cycles in which no sound answer of the drive came."
    )
    telemetry_dropped: int = Field(ge=0, description="Snapshots that never reached the service.")
    real_time: bool = Field(description="SCHED_FIFO was granted.")
    memory_locked: bool = Field(
        description="The control program's memory is locked, so that it never waits for a disk."
    )


class LeaseLive(_Schema):
    """Who operates the apparatus; everybody else watches, and may stop it."""

    holder: str | None = Field(
        description="Name of whoever operates; null: nobody does, and the first command takes the lease.",
        examples=["Sato"],
    )
    mine: bool = Field(description="It is the browser that this is told to.")
    since: datetime | None
    taken_from: str | None = Field(description="From whom it was taken over; null when it was free.", examples=["Kato"])
    unreachable_since: datetime | None = Field(
        description="Since then the holder's browser cannot be reached: playing is paused 2 s later, and 30 s later "
        "the motors let go of the arm. Null while it is there."
    )
    paused: bool = Field(description="The playback was paused for want of the holder's browser.")


class DatabaseStatus(_Schema):
    """What happens at the station while the database does not answer: kept on this computer, and written there when it does."""

    unavailable_since: datetime | None = Field(
        None, description="Since then the database does not answer; null while it does."
    )
    waiting: int = Field(0, ge=0, description="How much of what happened is kept here and not yet written there.")
    spool_full_since: datetime | None = Field(
        None, description="Since then this computer's disk takes nothing either; null while it does."
    )


class Live(_Schema):
    """The newest state of the station. Without a running device process, everything in it is old: see ``age_ms``."""

    device: DeviceState
    at: datetime = Field(
        description="When the service made this state, UTC. Commands that can start motion carry it as `seen_at`."
    )
    age_ms: float | None = Field(
        ge=0, description="Since the device process last said anything; null when it never has."
    )
    side: Side = Field(description="The shoulder that the apparatus stands for.")
    mode: Mode
    torque: TorqueState = Field(
        description="Of all drives together: on if one has torque, else unknown if one may have."
    )
    stops: int = Field(
        ge=0,
        description="Stops so far: each Stop command and each latched stop counts one. Commands that can start motion carry it.",
    )
    verified_since: datetime | None = Field(
        description="Since then the apparatus has been connected, and every drive configured, without a break; null while it is "
        "not so. An emergency stop test from before does not count."
    )
    estop: EstopState
    pedal: PedalState
    axes: list[AxisLive]
    stop: StopLive | None
    run: RunLive | None
    teaching: TeachingLive | None
    refusals: dict[CommandName, RefusalLive] = Field(
        description="Commands not allowed now, and why; others are allowed."
    )
    lease: LeaseLive
    loop: LoopLive | None
    database: DatabaseStatus = DatabaseStatus()


class EventLive(_Schema):
    """Something that happened on the apparatus."""

    number: int = Field(ge=1, description="Without gaps since the device process started.")
    code: str = Field(examples=["take_started"])
    message: str = Field(examples=["Take 1 is being recorded."])
    message_key: OptionalKey = None
    at: datetime
