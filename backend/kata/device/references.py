"""Builds references for runs (a checked trajectory with its correction) and transfers them between processes.

The reference builder builds and packs them (:func:`serve`, :mod:`kata.device.reference_builder`). The device process
unpacks them (:mod:`kata.device.loader`).
"""

import ctypes
import logging
import math
import os
import socket
import weakref
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

import msgspec
import numpy as np

from kata.device import texts
from kata.device.config import ConfigError, StationConfig
from kata.device.faults import MAX_FROZEN_SETPOINT_DEG
from kata.device.ipc_messages import (
    LONGEST_HOLD_S,
    MOST_REPETITIONS,
    RESISTANCE_LEVELS,
    SAMPLE_FIELDS,
    SHORTEST_HOLD_S,
    EndFeel,
    Load,
    LoadPart,
    Refusal,
    Request,
)
from kata.device.range_override import MIN_SHARE
from kata.device.resistance import RESISTANCE_AFTER_NS
from kata.device.run_limits import PATH_TOLERANCE_DEG
from kata.messages import Text, text_of
from kata.motion import texts as motion_texts
from kata.motion.axes import N_AXES
from kata.motion.end_feel import FASTEST_DEG_S, SLOWEST_DEG_S
from kata.motion.ilc import MAX_CORRECTION_DEG, Correction
from kata.motion.linkage import Floats
from kata.motion.method import rate_hz, reference
from kata.motion.reach import POSE_ROUNDING_DEG, check_poses_of, doctors_set, nearest, reachable_set
from kata.motion.trajectory import HOLD_S, AxisLimits, OverloadError, Trajectory, TrajectoryError, ZeroOrderHold

log = logging.getLogger(__name__)

MAX_MESSAGE_BYTES: Final = 1 << 18
"""Maximum size in bytes of a message between device process and builder. A part of a Load and a station's configuration are
smaller.
"""
_TORQUE_STEP_S: Final = 0.02
_CARRIED_SHARE: Final = 0.85
"""A motion may need this share of the torque that counts as resistance. The rest is for muscle tone and for model errors, which reach 0.6 Nm
near a drive's limit."""
_REDUCED_STEP_S: Final = 0.05
"""Time between two poses of which the reduced range is checked."""
_REDUCED_DIGITS: Final = 2
"""Decimal places of the angles, in deg, by which two such poses are the same."""
_REDUCED_SHARE_STEP: Final = 0.05
"""Difference between two shares of the range that are checked."""
_ONE_WAY_DEG: Final = 0.02
"""A way out may stray back by this in a step of the check: less than an encoder's count."""
_SHORTEST_WAY_DEG: Final = 10.0
_LEAST_LEFT_NM: Final = 0.5
"""At every place of the outward movement, the patient's level must exceed friction and weight by this torque."""
_CORRECTION: Final = "correction"
"""Name of the correction among the trajectory's arrays."""
_READ_ONLY, _SHARED = 1, 1
"""Values of PROT_READ and MAP_SHARED."""
_FAILED: Final = ctypes.c_void_p(-1).value
"""Value of MAP_FAILED."""

_libc = ctypes.CDLL(None, use_errno=True)
_libc.mmap.restype = ctypes.c_void_p
_libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long]
_libc.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]


@dataclass(frozen=True)
class Reference:
    """The reference of a Load."""

    trajectory: Trajectory
    correction: Correction | None = None


class _UnusableError(ValueError):
    """The recording cannot be played with this method; the message says why."""


# -- building -----------------------------------------------------------------------------------------------------


def build(load: Load, config: StationConfig) -> Reference | Refusal:
    """Build the reference of a Load and check it against the station's and the patient's limits.

    A recording of an hour at 100 Hz takes 1.4 s. Extreme float values may raise any arithmetic error.
    """
    if load.self_paced and (refusal := _self_paced_refusal(load, config)):
        return refusal
    try:
        trajectory = _trajectory(load, config)
        _check_end_feel(load, config, trajectory)
        _check_torque(load, config, trajectory)
        trajectory.least_share = np.array(_least_share(load, config, trajectory))
        return Reference(trajectory, _correction(load, trajectory))
    except OverloadError as error:
        return unplayable(text_of(error), texts.MAKE_ARM_LIGHTER())
    except TrajectoryError as error:
        return unplayable(text_of(error))
    except _UnusableError as error:
        return Refusal.of(
            code="unusable",
            message=texts.METHOD_NOT_PLAYABLE(reason=text_of(error)),
            next_step=texts.CHOOSE_ANOTHER_METHOD(),
        )


def unplayable(why: str, next_step: Text | None = None) -> Refusal:
    """Return the refusal of a recording that must not be played. ``why``: a clause without a full stop."""
    return Refusal.of(
        code="unplayable",
        message=texts.RECORDING_NOT_PLAYABLE(reason=why),
        next_step=next_step or texts.TEACH_AGAIN_MORE_SLOWLY(),
    )


def _trajectory(load: Load, config: StationConfig) -> Trajectory:
    try:
        times = np.frombuffer(load.times_s, dtype="<f8")
        angles = np.frombuffer(load.angles_deg, dtype="<f8").reshape(-1, len(config.axes))
    except ValueError as error:
        raise TrajectoryError(texts.NOT_PLAYABLE_SAMPLES_CUT()) from error
    if config.cycle_hz % rate_hz(load.method, config.rate_hz):
        raise _UnusableError(texts.NOT_PLAYABLE_PAPER_RATE())
    trajectory = reference(load.method, times, angles)
    if not 1 <= load.resistance_level <= RESISTANCE_LEVELS:
        raise TrajectoryError(texts.NOT_PLAYABLE_RESISTANCE_LEVEL(levels=RESISTANCE_LEVELS))
    if not 0 <= load.repetition_s < math.inf:
        raise TrajectoryError(texts.NOT_PLAYABLE_REPETITION())
    config.check_reference(load.method, trajectory, load.side)
    if isinstance(trajectory, ZeroOrderHold):
        _check_steps(trajectory)
    _check_patients_limits(load, config, trajectory)
    return trajectory


def _check_steps(trajectory: ZeroOrderHold) -> None:
    """Refuse a sample so far from the one before that a drive which has not moved yet would count as frozen.

    :raises _UnusableError: naming motor, time and step.
    """
    steps_deg = np.abs(np.diff(trajectory.samples, axis=0))
    row, axis = np.unravel_index(int(np.argmax(steps_deg)), steps_deg.shape)
    if steps_deg[row, axis] > MAX_FROZEN_SETPOINT_DEG:
        raise _UnusableError(
            texts.NOT_PLAYABLE_PAPER_STEP(
                motor=int(axis) + 1,
                at_s=(int(row) + 1) * HOLD_S,
                step_deg=float(steps_deg[row, axis]),
                largest_deg=MAX_FROZEN_SETPOINT_DEG,
            )
        )


def _check_patients_limits(load: Load, config: StationConfig, trajectory: Trajectory) -> None:
    """Refuse a trajectory that leaves the patient's range or exceeds the patient's speed limit.

    :raises TrajectoryError: naming motor, time, value and limit.
    """
    ranges = load.limits_deg or tuple((-math.inf, math.inf) for _ in config.axes)
    if len(ranges) != len(config.axes):
        raise TrajectoryError(texts.NOT_PLAYABLE_SOME_LIMITS())
    if not all(low < high for low, high in ranges):
        raise TrajectoryError(texts.NOT_PLAYABLE_LIMITS_CROSSED())
    speed_deg_s = math.inf if load.max_speed_deg_s is None else load.max_speed_deg_s
    if load.max_speed_deg_s is not None and not 0 < speed_deg_s < math.inf:
        raise TrajectoryError(texts.NOT_PLAYABLE_PATIENT_SPEED_ZERO())
    try:
        config.with_speed_limit(load.max_speed_deg_s)
    except ConfigError as error:
        raise TrajectoryError(texts.NOT_PLAYABLE_PATIENT_SPEED_LOW()) from error
    limits = [
        AxisLimits(low, high, min(axis.max_speed_deg_s, speed_deg_s))
        for axis, (low, high) in zip(config.axes, ranges, strict=True)
    ]
    trajectory.check(limits, 0.0)
    if arm := load.arm_limits:
        check_poses_of(trajectory, lambda motors_deg: doctors_set(motors_deg, load.side, arm), POSE_ROUNDING_DEG)


def _least_share(load: Load, config: StationConfig, trajectory: Trajectory) -> float:
    """Return the smallest share of the range from which on the motion stays within the limits of the pose.

    A reduced motion cuts corners. Where the recording goes around a limit, the reduced motion may pass through it.
    """
    times_s = np.append(np.arange(0.0, trajectory.duration_s, _REDUCED_STEP_S), trajectory.duration_s)
    # Repetitions have the same poses.
    poses_deg = np.unique(np.round(trajectory.along(times_s), _REDUCED_DIGITS), axis=0)
    arm = load.arm_limits
    shares = np.linspace(1.0, MIN_SHARE, round((1.0 - MIN_SHARE) / _REDUCED_SHARE_STEP) + 1)
    for greater, share in pairwise(float(share) for share in shares):
        reduced_deg = trajectory.rest_deg + share * (poses_deg - trajectory.rest_deg)
        margin_deg = nearest(reduced_deg, lambda angles: reachable_set(angles, load.side)).margin_deg
        margin_deg += config.pose_tolerance_deg
        if arm:
            margin_deg = min(margin_deg, nearest(reduced_deg, lambda a: doctors_set(a, load.side, arm)).margin_deg)
        if margin_deg < -PATH_TOLERANCE_DEG:
            return greater
    return MIN_SHARE


def _check_torque(load: Load, config: StationConfig, trajectory: Trajectory) -> None:
    """Refuse a motion that the identified drives and load cannot carry at the patient's level.

    The torque is averaged over the time for which resistance must last. Without an identified load no motion is refused.

    :raises OverloadError: naming the motor with the largest excess, time, torque and limit.
    """
    load_model = config.servo_model.load
    if not load_model.known:
        return
    limits_nm = _CARRIED_SHARE * np.array(config.resistance_thresholds_nm(load.resistance_level))
    times = np.arange(0.0, trajectory.duration_s, _TORQUE_STEP_S)
    torque = np.cumsum(load_model.torque_nm(trajectory.motions(times)), axis=0)
    rows = min(round(RESISTANCE_AFTER_NS / 1e9 / _TORQUE_STEP_S), len(times) - 1)
    mean = (torque[rows:] - torque[:-rows]) / rows
    excess = np.abs(mean) / limits_nm
    row, axis = np.unravel_index(int(np.argmax(excess)), excess.shape)
    if excess[row, axis] > 1.0:
        at_s = float(times[row])
        raise OverloadError(
            motion_texts.MOTOR_OVERLOADED(
                motor=int(axis) + 1,
                torque_nm=abs(float(mean[row, axis])),
                at_s=at_s,
                limit_nm=float(limits_nm[axis]),
            ),
            int(axis) + 1,
            at_s,
        )


def _check_end_feel(load: Load, config: StationConfig, trajectory: Trajectory) -> None:
    """Refuse a test that is not a slow way out, or that needs more torque than the patient's level.

    :raises TrajectoryError: when the end-feel test cannot be run as requested. The message names the reason.
    """
    test = load.end_feel
    if test is None:
        return
    expected_nm = np.array(test.expected_nm)
    complete = 1 <= test.motor <= len(config.axes) and test.repetitions >= 1 and len(expected_nm) >= 2
    others = [*test.arm_nm, *([test.back_nm] if test.back_nm else [])]
    curves_complete = all(len(curve) == len(expected_nm) and np.all(np.isfinite(curve)) for curve in others)
    if not (complete and curves_complete and 0 < test.torque_nm < math.inf and np.all(np.isfinite(expected_nm))):
        raise TrajectoryError(texts.NOT_PLAYABLE_END_FEEL_CUT())
    axis = test.motor - 1
    way_deg = trajectory.along(np.arange(0.0, trajectory.duration_s, _TORQUE_STEP_S))[:, axis]
    outward = np.sign(way_deg[-1] - way_deg[0])
    _, speeds = trajectory.speeds()
    slow = np.percentile(speeds[:, axis], 10) >= SLOWEST_DEG_S - 0.1 and speeds[:, axis].max() <= FASTEST_DEG_S + 0.1
    one_way = np.min(np.diff(way_deg) * outward) >= -_ONE_WAY_DEG
    if load.method == "paper" or not (slow and one_way and abs(way_deg[-1] - way_deg[0]) >= _SHORTEST_WAY_DEG):
        raise TrajectoryError(
            texts.NOT_PLAYABLE_END_FEEL_WAY(
                motor=test.motor, least_deg=_SHORTEST_WAY_DEG, slowest=SLOWEST_DEG_S, fastest=FASTEST_DEG_S
            )
        )
    _check_stretch(test, trajectory.duration_s)
    limit_nm = config.resistance_thresholds_nm(load.resistance_level)[axis]
    left_nm = test.torque_nm if test.hold_s else _LEAST_LEFT_NM
    needed_nm = max(test.torque_nm, float(np.max(expected_nm * outward)) + left_nm)
    if needed_nm > limit_nm:
        raise TrajectoryError(
            texts.NOT_PLAYABLE_END_FEEL_TORQUE(motor=test.motor, needed_nm=needed_nm, limit_nm=limit_nm)
        )


def _self_paced_refusal(load: Load, config: StationConfig) -> Refusal | None:
    """Refuse a self-paced run if the patient's effort cannot be known, or with another method."""
    if not config.servo_model.load.known:
        reason = texts.SELF_PACED_WITHOUT_LOAD()
    elif load.method != "smooth" or load.end_feel:
        reason = texts.SELF_PACED_WITH_METHOD()
    else:
        return None
    return Refusal.of(code="not_self_paced", message=reason, next_step=texts.PLAY_WITHOUT_SELF_PACE())


def _check_stretch(test: EndFeel, duration_s: float) -> None:
    """Refuse a stretch whose torque could not be known at rest, or that is held too long or too often.

    :raises TrajectoryError: naming the reason.
    """
    if test.hold_s == 0.0:
        return
    if not (SHORTEST_HOLD_S <= test.hold_s <= LONGEST_HOLD_S and test.repetitions <= MOST_REPETITIONS):
        raise TrajectoryError(
            texts.NOT_PLAYABLE_STRETCH_HOLD(
                least_s=SHORTEST_HOLD_S, most_s=LONGEST_HOLD_S, repetitions=MOST_REPETITIONS
            )
        )
    begin_s, end_s = test.weighed_s
    if not (test.back_nm and test.arm_nm and 0.0 <= begin_s < end_s < duration_s):
        raise TrajectoryError(texts.NOT_PLAYABLE_STRETCH_BASELINE(motor=test.motor))


def _correction(load: Load, trajectory: Trajectory) -> Correction | None:
    """Return the checked correction, or None if the Load has none."""
    if not load.correction_deg:
        return None
    if load.method != "learned":
        raise _UnusableError(texts.NOT_PLAYABLE_CORRECTION_METHOD())
    if len(load.correction_deg) % (N_AXES * 8):
        raise _UnusableError(texts.NOT_PLAYABLE_CORRECTION_CUT())
    angles = np.frombuffer(load.correction_deg, dtype="<f8").reshape(-1, N_AXES)
    step_s = load.correction_step_s
    # The last row must be within one step of the recording's end. NaN fails every comparison.
    lasts_s = trajectory.duration_s
    if not (0 < step_s <= lasts_s and len(angles) >= 2 and abs((len(angles) - 1) * step_s - lasts_s) <= step_s):
        raise _UnusableError(texts.NOT_PLAYABLE_CORRECTION_LENGTH())
    if not np.all(np.abs(angles) <= MAX_CORRECTION_DEG):
        raise _UnusableError(texts.NOT_PLAYABLE_CORRECTION_LARGE(largest_deg=MAX_CORRECTION_DEG))
    return Correction(step_s, angles)


# -- transfer between processes -----------------------------------------------------------------------------------


class Packed(msgspec.Struct, frozen=True, tag_field="type", tag="packed"):
    """Describes a reference whose numbers are in shared memory: float64 arrays, one after the other."""

    kind: Literal["trajectory", "zero_order_hold"]
    shapes: dict[str, tuple[int, ...]]
    """Name and shape of each array, in order."""
    correction_step_s: float


def pack(found: Reference) -> tuple[Packed, int]:
    """Write a reference's numbers into shared memory. Return their layout and the file descriptor, which the caller must
    close.

    :raises OSError: when there is not enough memory.
    """
    arrays = found.trajectory.parts()
    if found.correction:
        arrays[_CORRECTION] = found.correction.angles_deg
    memory = os.memfd_create("reference")
    with open(memory, "wb", closefd=False) as file:
        for array in arrays.values():
            file.write(np.ascontiguousarray(array, dtype=np.float64).data)
    kind: Literal["trajectory", "zero_order_hold"] = (
        "zero_order_hold" if isinstance(found.trajectory, ZeroOrderHold) else "trajectory"
    )
    step_s = found.correction.step_s if found.correction else 0.0
    return Packed(kind, {name: array.shape for name, array in arrays.items()}, step_s), memory


def unpack(packed: Packed, memory: int) -> Reference:
    """Map a packed reference into this process, without computing or copying. The caller closes ``memory``.

    :raises OSError: when the memory cannot be mapped.
    """
    numbers = _mapped(memory)
    arrays: dict[str, Floats] = {}
    begin = 0
    for name, shape in packed.shapes.items():
        end = begin + math.prod(shape)
        arrays[name] = numbers[begin:end].reshape(shape)
        begin = end
    correction = arrays.pop(_CORRECTION, None)
    kind = ZeroOrderHold if packed.kind == "zero_order_hold" else Trajectory
    return Reference(
        kind.from_parts(arrays), None if correction is None else Correction(packed.correction_step_s, correction)
    )


def _mapped(memory: int) -> Floats:
    """Map shared memory and return it as read-only float64 numbers. It is unmapped when the last array that uses it is freed.

    With locked memory the kernel maps every page at once: 7 ms for an hour at 100 Hz. A call through ctypes releases the
    interpreter lock, so the control thread can run meanwhile. Python's own mmap does not release it.
    """
    size = os.fstat(memory).st_size
    address = _libc.mmap(None, size, _READ_ONLY, _SHARED, memory, 0)
    if address == _FAILED:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    pages = (ctypes.c_char * size).from_address(address)
    # Do not unmap at the interpreter's exit, because other threads may still read.
    weakref.finalize(pages, _libc.munmap, address, size).atexit = False
    return np.frombuffer(memoryview(pages).toreadonly(), dtype=np.float64)


def serve(connection: socket.socket) -> None:
    """Answer every Load until the other end closes the socket.

    Receives the station's configuration, then Requests with a Load, each followed by its parts. Sends a Refusal, or a
    :class:`Packed` with the descriptor of its memory.
    """
    config = msgspec.msgpack.decode(connection.recv(MAX_MESSAGE_BYTES), type=StationConfig)
    decoder = msgspec.msgpack.Decoder(Request | LoadPart)
    load: Load | None = None
    samples: dict[str, bytearray] = {}
    while data := connection.recv(MAX_MESSAGE_BYTES):
        message = decoder.decode(data)
        if isinstance(message, Request):
            assert isinstance(message.command, Load)
            # If the Load before was discarded, its remaining parts never arrive. Start again with empty samples.
            load, samples = message.command, {field: bytearray() for field in SAMPLE_FIELDS}
            continue
        samples[message.field] += message.data
        if message.last and load:
            _answer(connection, load, samples, config)
            load, samples = None, {}


def _answer(connection: socket.socket, load: Load, samples: dict[str, bytearray], config: StationConfig) -> None:
    """Build the reference and send the result. After any failure refuse the Load, so that the builder can answer the next one."""
    try:
        built = build(msgspec.structs.replace(load, **{name: bytes(data) for name, data in samples.items()}), config)
        answer, memory = (built, None) if isinstance(built, Refusal) else pack(built)
    except Exception as error:
        log.exception("a recording could not be checked")
        answer, memory = unplayable(texts.NOT_PLAYABLE_CHECK_FAILED(error=type(error).__name__)), None
    socket.send_fds(connection, [msgspec.msgpack.encode(answer)], [] if memory is None else [memory])
    if memory is not None:
        os.close(memory)
