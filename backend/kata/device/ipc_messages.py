"""The messages between the service and the device process.

To the device: a :class:`Request` with one command, answered by a :class:`Reply`; and heartbeats. From the device:
:class:`Snapshot` (the newest complete state, may be skipped), :class:`Event` (numbered, never skipped) and
:class:`JournalClosed`. A frame on the socket is a 4-byte little-endian length followed by MessagePack. All frames are
small, so that a Stop or a Heartbeat can be sent between the frames of a Load: its samples follow its Request as
:class:`LoadPart`.
"""

import struct
from collections.abc import Iterator
from typing import Final, Literal, Self, get_args

import msgspec

from kata.messages import MessageKey, key_of
from kata.motion.axes import CANONICAL_SIDE, Side
from kata.motion.method import Method
from kata.motion.reach import ArmLimits

Mode = Literal["offline", "idle", "teaching", "ready", "approaching", "playing", "paused", "returning", "stopped"]
"""offline: no bus, or a drive is missing. idle: torque off, nothing loaded. teaching: torque off, the pedal records. ready: a
recording is loaded and checked, torque off. approaching: the arm moves slowly to the recording's start. paused: torque holds
the arm on the path, also at its start after the approach. playing: the arm moves along the path. returning: the arm moves
slowly to the place where the approach began; then torque is switched off, the run ends and the mode is idle. stopped: a stop
is latched; torque is off once the stop's ramp has ended.
"""

EstopState = Literal["closed", "pressed", "released", "unknown"]
"""closed: the contact is closed, the arm may move. pressed: the contact is open. released: the contact is closed again, but
the stop is not acknowledged. unknown: no reply from the input yet, or none for longer than allowed; this counts as pressed.
"""

TorqueState = Literal["on", "off", "unknown"]
"""The known torque state of a drive. off: the drive itself has reported no torque since torque was last switched and the port
was opened. unknown: no recent report; the drive may be holding the arm. For all drives together: "on" if one drive has
torque, else "unknown" if one drive may have torque.
"""

PedalState = Literal["up", "down", "stuck", "unknown"]
"""stuck: the pedal was down when teaching began and has not been up since, so nothing is recorded."""

CommandName = Literal[
    "teach",
    "finish_teaching",
    "load",
    "unload",
    "approach",
    "play",
    "pause",
    "reduce_range",
    "return",
    "stop",
    "release_torque",
    "acknowledge",
]
RESISTANCE_LEVELS: Final = 25

COMMAND_NAMES: Final[tuple[CommandName, ...]] = get_args(CommandName)


class _Message(msgspec.Struct, frozen=True, kw_only=True, tag_field="type"):
    """Base of every struct on the socket."""


class Refusal(_Message, frozen=True, kw_only=True, tag="refusal"):
    """A refused command: a stable code, a sentence for the therapist, and the next step."""

    code: str
    message: str
    next_step: str
    message_key: MessageKey | None = None
    """Code and parameters of ``message``; None if it has no code."""
    next_step_key: MessageKey | None = None

    @classmethod
    def of(cls, *, code: str, message: str, next_step: str) -> Self:
        """Return a refusal with the codes of its two texts."""
        return cls(
            code=code,
            message=str(message),
            next_step=str(next_step),
            message_key=key_of(message),
            next_step_key=key_of(next_step),
        )


# -- commands -----------------------------------------------------------------------------------------------------


class _Guarded(_Message, frozen=True, kw_only=True):
    """Base of every command that can start motion, release an arm or reset a stop. A Stop or the expiry makes it invalid.

    The defaults are refused, so that a sender that does not know the stop counter cannot start motion.
    """

    stops: int = -1
    """Value of :attr:`Snapshot.stops` in the newest snapshot that the sender has. The device refuses another value, because
    a stop has happened since that snapshot.
    """
    expires_ns: int = 0
    """``time.monotonic_ns`` after which the command is refused. Service and device process read the same clock."""


class Teach(_Message, frozen=True, kw_only=True, tag="teach"):
    """Begin teaching: torque off, record while the pedal is down. From idle."""

    teaching_id: str
    side: Side = CANONICAL_SIDE
    """The patient's side. The command is refused unless the apparatus is set up for this side."""


class FinishTeaching(_Message, frozen=True, kw_only=True, tag="finish_teaching"):
    """End teaching. The journal is finished and handed over to the service."""


SHORTEST_HOLD_S: Final = 1.0
LONGEST_HOLD_S: Final = 120.0
MOST_REPETITIONS: Final = 20
"""Longest hold and largest number of repetitions of a stretch. These values are our choice; the literature prescribes 20 to 60 min per day."""


class EndFeel(_Message, frozen=True, kw_only=True, tag="end_feel"):
    """An end-feel test: move along the recording until the torque is reached, move back at once, and repeat. With ``hold_s`` it is a
    stretch: the torque is held for this time.

    ``torque_nm`` acts between apparatus and shoulder. It is the drive's torque minus ``expected_nm`` and the arm's weight.
    """

    motor: int
    torque_nm: float
    """The arm moves back before it exceeds this torque."""
    expected_nm: tuple[float, ...]
    """The motor's torque on the way out without a shoulder (friction and weight), evenly spaced from the recording's start to its end."""
    back_nm: tuple[float, ...] = ()
    """The same on the way back; empty: as on the way out."""
    arm_nm: tuple[tuple[float, ...], ...] = ()
    """Change of the torque with each factor of the arm's weight, as long as ``expected_nm`` each. The test finds the factors itself."""
    weighed_s: tuple[float, float] = (0.0, 0.0)
    """Start and end of the part of the recording in which the shoulder is free and the arm is weighed."""
    repetitions: int = 3
    hold_s: float = 0.0
    """Time for which a stretch holds the torque; 0: an end-feel test."""


class Load(_Message, frozen=True, kw_only=True, tag="load"):
    """Check a recording against the limits and load it as a new run. From idle.

    ``times_s`` is ``(n,)`` and ``angles_deg`` ``(n, 5)``, both little-endian float64 in C order. If a Stop, Teach or Unload
    arrives during the check, the Load is refused with ``stopped_meanwhile``. A second Load during the check is refused with
    ``busy``.
    """

    run_id: str
    recording_id: str
    times_s: bytes
    angles_deg: bytes
    side: Side = CANONICAL_SIDE
    """The recording's side. The command is refused unless the apparatus is set up for this side."""
    resistance_level: int = RESISTANCE_LEVELS
    """The patient's level from 1 (light resistance makes the arm move back) to 25 (the motors' rated torque)."""
    limits_deg: tuple[tuple[float, float], ...] = ()
    """Limits of the patient and the session: lowest and highest angle of each axis. Empty: no limits."""
    arm_limits: ArmLimits | None = None
    """A doctor's limits for the pose of the arm, not for single motors. Every setpoint is checked against them."""
    method: Method = "smooth"
    """The playback method. Setpoints and samples have the station's ``rate_hz``, but 10 Hz with ``paper``."""
    correction_deg: bytes = b""
    """The correction learned for this recording on this station; only for ``learned``. ``(m, 5)``, little-endian float64 in C
    order, one row every ``correction_step_s`` from start to end. Empty: no correction yet; the recording is played as with
    ``smooth``.
    """
    correction_step_s: float = 0.0
    repetition_s: float = 0.0
    """Period of the motion in the recording; 0 if the motion does not repeat."""
    max_speed_deg_s: float | None = None
    """The patient's speed limit for every axis, also for approach and return. None: only the station's limits apply."""
    end_feel: EndFeel | None = None
    """An end-feel test, whose way out is the recording. None: the recording is played."""
    self_paced: bool = False
    """True if the patient's effort sets the pace. Only for ``smooth``, on a station with an identified load."""


class Unload(_Message, frozen=True, kw_only=True, tag="unload"):
    """Unload the recording. The run ends without being played. From ready."""


class Approach(_Guarded, frozen=True, kw_only=True, tag="approach"):
    """Switch torque on, move slowly to the recording's start and hold there (paused at 0 s). From ready."""


class Play(_Guarded, frozen=True, kw_only=True, tag="play"):
    """Play from the present place on the path. From paused."""


class Pause(_Message, frozen=True, kw_only=True, tag="pause"):
    """Slow down on the path and hold. From playing."""


class ReduceRange(_Message, frozen=True, kw_only=True, tag="reduce_range"):
    """Reduce the range by one step, towards rest. The range recovers slowly. From playing; from paused it applies to the next
    play.
    """


class Return(_Guarded, frozen=True, kw_only=True, tag="return"):
    """Move slowly to the place where the approach began, then switch torque off and end the run. From paused."""


StopCode = Literal["operator_stop", "browser_lost"]
"""Rows of the fault table that a Stop latches."""


class Stop(_Message, frozen=True, kw_only=True, tag="stop"):
    """Controlled stop: ramp down, switch torque off, latch. It is always accepted and overtakes every queued command."""

    because: StopCode = "operator_stop"


class ReleaseTorque(_Guarded, frozen=True, kw_only=True, tag="release_torque"):
    """Switch off the torque that the drives had when the port was opened. The operator must support the arm. From stopped."""


class Acknowledge(_Guarded, frozen=True, kw_only=True, tag="acknowledge"):
    """Reset a stop after its causes have cleared. This never starts motion."""


Guarded = Approach | Play | Return | ReleaseTorque | Acknowledge
"""Commands that carry the stop counter and an expiry."""

Command = (
    Teach
    | FinishTeaching
    | Load
    | Unload
    | Approach
    | Play
    | Pause
    | ReduceRange
    | Return
    | Stop
    | ReleaseTorque
    | Acknowledge
)


def stamped(command: Command, stops: int, expires_ns: int) -> Command:
    """Return a guarded command with the sender's stop counter and an expiry. Return other commands unchanged."""
    if isinstance(command, Guarded):
        return msgspec.structs.replace(command, stops=stops, expires_ns=expires_ns)
    return command


class Request(_Message, frozen=True, kw_only=True, tag="request"):
    """A command with the number that its reply carries."""

    id: int
    command: Command


SampleField = Literal["times_s", "angles_deg", "correction_deg"]
SAMPLE_FIELDS: Final[tuple[SampleField, ...]] = get_args(SampleField)
"""The fields of a Load that are empty in its Request on the socket. :class:`LoadPart` messages carry their data."""


class LoadPart(_Message, frozen=True, kw_only=True, tag="load_part"):
    """A piece of one of the :data:`SAMPLE_FIELDS` of the Load with this request id. The pieces of a field arrive in order."""

    id: int
    field: SampleField
    data: bytes
    last: bool
    """True if this part completes the Load."""


class Heartbeat(_Message, frozen=True, kw_only=True, tag="heartbeat"):
    """Shows that the service is alive. The service sends one at least every 50 ms."""

    run_id: str | None = None
    """The run or teaching that the service expects. "" means none; None means no statement."""


# -- telemetry ----------------------------------------------------------------------------------------------------


class Reply(_Message, frozen=True, kw_only=True, tag="reply"):
    """The answer to a command. ``refusal`` is None if the command was accepted."""

    id: int
    refusal: Refusal | None = None


class AxisState(_Message, frozen=True, kw_only=True, tag="axis"):
    """One axis. ``setpoint_deg`` equals the measured angle until torque is on; None if the drive has never answered."""

    motor: int
    setpoint_deg: float | None
    measured_deg: float | None
    speed_deg_s: float
    torque_nm: float
    torque: TorqueState
    age_ms: float | None
    """Time since the drive last answered; None if it has never answered."""
    voltage_v: float | None = None
    """Supply voltage; None if unknown or not reported."""
    temperature_c: float | None = None
    """Temperature of the drive in degrees Celsius; None if unknown or not reported."""


class DriveWarning(_Message, frozen=True, kw_only=True, tag="drive_warning"):
    """A drive is near one of its own limits. The warning does not stop the apparatus."""

    code: str
    motor: int
    message: str
    next_step: str
    message_key: MessageKey | None = None
    next_step_key: MessageKey | None = None


class StopCause(_Message, frozen=True, kw_only=True, tag="cause"):
    """One latched row of the fault table."""

    code: str
    category: Literal[0, 1, 2]
    message: str
    next_step: str
    axis: int | None = None
    cleared: bool
    """True if the condition no longer holds. A stop can be acknowledged when every cause is cleared."""
    message_key: MessageKey | None = None
    next_step_key: MessageKey | None = None


class StopState(_Message, frozen=True, kw_only=True, tag="stop_state"):
    """The latched stop. Its causes are in the order in which they occurred."""

    causes: tuple[StopCause, ...]
    at_ns: int
    """``time.monotonic_ns`` of the device at the beginning of the stop."""


StretchPhase = Literal["out", "hold", "release"]


class StretchState(_Message, frozen=True, kw_only=True, tag="stretch"):
    """A stretch."""

    phase: StretchPhase
    torque_nm: float
    """Torque between apparatus and shoulder, outwards."""
    target_nm: float
    """The chosen torque, or less after a request."""
    hold_left_s: float
    """Remaining time of the present hold."""
    held_s: float
    """Time in all repetitions with at least 60 % of the target."""
    repetitions_left: int
    """Number of repetitions that have not ended."""


class SelfPacingState(_Message, frozen=True, kw_only=True, tag="self_pacing"):
    """Pace, effort and work of a self-paced run."""

    pace_percent: float
    """Share of the recording's speed, from 0 to 100."""
    effort_nm: float
    """Mean torque of the patient along the path over the last half second, forwards."""
    threshold_nm: float
    """Effort that does not move the arm."""
    work_j: float
    """Work of the patient along the path since the start."""


class RunState(_Message, frozen=True, kw_only=True, tag="run"):
    """The loaded recording and the place on its path."""

    run_id: str
    recording_id: str
    position_s: float
    duration_s: float
    left_s: float
    """Remaining time of the present movement: of the approach while approaching, else of the path."""
    at_start: bool
    resistance_level: int
    reversals: int
    """Number of times that the arm met resistance and moved back."""
    reversing: bool
    """True while the arm moves back from resistance or waits there."""
    range_percent: float
    """Share of the range that is played. It is below 100 after a request to reduce the range."""
    stretch: StretchState | None = None
    self_pacing: SelfPacingState | None = None


class TeachingState(_Message, frozen=True, kw_only=True, tag="teaching_state"):
    """The active teaching and its present or last take."""

    teaching_id: str
    takes: int
    recording: bool
    take_s: float
    """Length of the present or last take."""
    samples: int


class LoopState(_Message, frozen=True, kw_only=True, tag="loop"):
    """Health of the control loop since it started."""

    cycle_hz: int
    rate_hz: int
    cycles: int
    overruns: int
    """Number of cycles that were skipped because the cycle before ended late."""
    lateness_p50_ms: float
    """Percentiles and maximum of the latency with which cycles began."""
    lateness_p99_ms: float
    lateness_p999_ms: float
    lateness_max_ms: float
    bus_errors: int
    drive_errors: tuple[int, ...]
    """Number of cycles, for each axis, in which its drive was polled and sent no valid answer."""
    telemetry_dropped: int
    real_time: bool
    """True if SCHED_FIFO was granted."""
    memory_locked: bool
    """True if no page of the process can be swapped to a disk."""


class Snapshot(_Message, frozen=True, kw_only=True, tag="snapshot"):
    """The newest complete state of one station."""

    t_ns: int
    mode: Mode
    torque: TorqueState
    """Torque state of all drives together."""
    stops: int
    """Number of stops. Each Stop command, each Pause command, each latched stop and each suspension of the computer adds one. Guarded commands
    carry this number.
    """
    verified_since_ns: int | None
    """``time.monotonic_ns`` since which the port has been open and every drive has had its verified configuration, without
    interruption; else None. An emergency stop test from before this time does not count.
    """
    estop: EstopState
    pedal: PedalState
    axes: tuple[AxisState, ...]
    stop: StopState | None
    run: RunState | None
    teaching: TeachingState | None
    refusals: dict[CommandName, Refusal]
    """The refusal of each command that is refused now. Absent commands are allowed."""
    loop: LoopState
    warnings: tuple[DriveWarning, ...] = ()
    """Present warnings, in axis order."""


class Event(_Message, frozen=True, kw_only=True, tag="event"):
    """An event. Events are numbered from 1 without gaps since the device process started."""

    number: int
    t_ns: int
    code: str
    """mode, take_started, take_ended, fault, load_reversal, range_reduced, unloaded, torque, drive_warning."""
    message: str
    message_key: MessageKey | None = None


class JournalClosed(_Message, frozen=True, kw_only=True, tag="journal_closed"):
    """A teaching or run has ended and its journal is complete and synced on disk."""

    path: str


ToDevice = Request | LoadPart | Heartbeat
FromDevice = Reply | Snapshot | Event | JournalClosed


# -- frames -------------------------------------------------------------------------------------------------------

_LENGTH: Final = struct.Struct("<I")
_MAX_FRAME_BYTES: Final = 1024 * 1024
"""Maximum frame length. It limits how long the receiver waits after a damaged length. The longest message is a part of a Load."""
_PART_BYTES: Final = 64 * 1024
"""Maximum size of a part of a Load. It limits the time that a Stop waits for such a part to less than 1 ms."""
LONGEST_LOAD_BYTES: Final = 64 * 1024 * 1024
"""Maximum size of one Load, to limit its memory: 3.8 hours at 100 Hz (48 bytes a sample)."""


def frame(message: ToDevice | FromDevice) -> bytes:
    """Return the bytes of a message on the socket; for a Load with all of its parts."""
    return b"".join(frames_of(message))


def frames_of(message: ToDevice | FromDevice) -> Iterator[bytes]:
    """Yield a message as small frames. Only a Load has more than one frame. Other messages may be sent between its frames."""
    if isinstance(message, Request) and isinstance(message.command, Load):
        yield from map(_framed, parts_of(message.id, message.command))
    else:
        yield _framed(message)


def parts_of(number: int, load: Load) -> Iterator[Request | LoadPart]:
    """Split a Load: yield its Request without samples, then its parts. ``number``: the request's id."""
    yield Request(id=number, command=msgspec.structs.replace(load, **dict.fromkeys(SAMPLE_FIELDS, b"")))
    for field in SAMPLE_FIELDS:
        data = getattr(load, field)
        for begin in range(0, len(data), _PART_BYTES):
            yield LoadPart(id=number, field=field, data=data[begin : begin + _PART_BYTES], last=False)
    yield LoadPart(id=number, field=SAMPLE_FIELDS[-1], data=b"", last=True)


def frames(incoming: bytearray) -> Iterator[bytes]:
    """Yield each complete message in ``incoming`` and remove it from there.

    :raises ValueError: when the bytes cannot be a message.
    """
    while len(incoming) >= _LENGTH.size:
        (length,) = _LENGTH.unpack_from(incoming)
        if length > _MAX_FRAME_BYTES:
            raise ValueError(f"a frame of {length} bytes is longer than any message")
        if len(incoming) < _LENGTH.size + length:
            return
        yield bytes(incoming[_LENGTH.size : _LENGTH.size + length])
        del incoming[: _LENGTH.size + length]


def _framed(message: ToDevice | FromDevice) -> bytes:
    data = msgspec.msgpack.encode(message)
    return _LENGTH.pack(len(data)) + data
