"""Defines and evaluates the fault table. Each row is one fault and is evaluated every cycle from that cycle's state alone.

A fault is latched when its condition first holds, and is cleared after the condition no longer holds. Each row states
how to stop, because switching torque off can also do harm: the arm drops. Category 0 cuts torque in the same cycle. Category 1
ramps down, then cuts torque. Category 2 ramps down and holds the arm until the operator acknowledges.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, Literal

from kata.device import texts
from kata.device.config import StationConfig
from kata.device.config_rules import OVERSPEED_FACTOR
from kata.device.cycle_state import CycleState
from kata.messages import Template

MAX_OVERRUN_MS: Final = 250.0
"""A setpoint that is later than this is a fault: the arm has stopped meanwhile, so the next setpoint would be far from it."""
_MAX_OVERTORQUE_MS: Final = 100.0
_MAX_OVERACCELERATION_MS: Final = 30.0
_MAX_JUMP_DEG: Final = 5.0
MAX_FROZEN_SETPOINT_DEG: Final = 8.0
"""Maximum distance that a setpoint may move without any change in the drive's reported position."""
_MAX_SETPOINT_PERIODS: Final = 3
_MAX_STATUS_AGE_MS: Final = 1000.0
_MAX_RUN_ID_MISMATCHES: Final = 3

FaultKey = tuple[str, int | None]
"""Fault code, and axis (0-4) or None."""

Condition = Callable[[CycleState, StationConfig], Iterable[int | None]]
"""Returns the axes (0-4) for which the fault holds. A fault without an axis returns a single None. If the fault does not
hold, the result is empty.
"""


@dataclass(frozen=True, slots=True)
class Fault:
    """One row of the table. The code of ``message`` is the fault's code. The only parameter that the message may have is the
    motor number.
    """

    code: str
    category: Literal[0, 1, 2]
    message: Template
    next_step: Template
    holds: Condition


def _estop_pressed(state: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if state.estop == "open" else ()


def _estop_unknown(state: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if state.estop == "unknown" and state.bus_ok else ()


def _bus_lost(state: CycleState, config: StationConfig) -> Iterable[None]:
    return () if state.bus_ok else (None,)


def _other_adapter(state: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if state.context.other_adapter else ()


def _drive_silent(state: CycleState, config: StationConfig) -> Iterable[int]:
    return _not_answering(state, config, corrupt=False)


def _drive_garbled(state: CycleState, config: StationConfig) -> Iterable[int]:
    return _not_answering(state, config, corrupt=True)


def _not_answering(state: CycleState, config: StationConfig, *, corrupt: bool) -> Iterable[int]:
    if not state.bus_ok:
        return ()
    ages = zip(state.drive_age_ms, state.status_age_ms, state.corrupt, strict=True)
    return (
        n
        for n, (drive_ms, status_ms, is_corrupt) in enumerate(ages)
        if is_corrupt == corrupt and (drive_ms > config.silence_ms or status_ms > _MAX_STATUS_AGE_MS)
    )


def _drive_error(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, error in enumerate(state.hardware_error) if error)


def _drive_watchdog(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, tripped in enumerate(state.watchdog_tripped) if tripped and state.torque_on)


def _torque_lost(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, reported in enumerate(state.torque_reported) if state.torque_on and reported is False)


def _torque_remains(state: CycleState, config: StationConfig) -> Iterable[int]:
    switched_off = not state.torque_on and not state.context.torque_inherited
    return (n for n, reported in enumerate(state.torque_reported) if switched_off and reported)


def _torque_found(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, reported in enumerate(state.torque_reported) if state.context.torque_inherited and reported)


def _drive_reset(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, lost in enumerate(state.settings_lost) if lost)


def _contacts_disagree(state: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if state.contacts_disagree_ms > config.inputs.contacts_disagree_ms else ()


def _position_limit(state: CycleState, config: StationConfig) -> Iterable[int]:
    if not state.torque_on:
        return ()
    # The commanded limits already include half of the tolerance.
    tolerance = config.limit_tolerance_deg / 2
    measured = zip(state.context.limits_deg, state.measured_deg, strict=True)
    return (n for n, ((low, high), angle) in enumerate(measured) if not low - tolerance <= angle <= high + tolerance)


def _overspeed(state: CycleState, config: StationConfig) -> Iterable[int]:
    if not state.torque_on:
        return ()
    return (
        n
        for n, (axis, speed) in enumerate(zip(config.axes, state.speed_deg_s, strict=True))
        if abs(speed) > OVERSPEED_FACTOR * axis.max_speed_deg_s
    )


def _following_error(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, lasted in enumerate(state.following_ms) if lasted > config.following_error_ms)


def _overtorque(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, lasted in enumerate(state.overtorque_ms) if lasted > _MAX_OVERTORQUE_MS and state.torque_on)


def _overacceleration(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (
        n for n, lasted in enumerate(state.accelerating_ms) if lasted > _MAX_OVERACCELERATION_MS and state.torque_on
    )


def _position_jump(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, jump in enumerate(state.jump_deg) if jump > _MAX_JUMP_DEG and state.torque_on)


def _position_frozen(state: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, moved_deg in enumerate(state.frozen_deg) if moved_deg > MAX_FROZEN_SETPOINT_DEG)


def _setpoint_frozen(state: CycleState, config: StationConfig) -> Iterable[None]:
    limit = _MAX_SETPOINT_PERIODS * config.cycle_hz // state.context.rate_hz
    return (None,) if state.torque_on and state.setpoint_cycles > limit else ()


def _overrun(state: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if state.torque_on and state.context.late_ms > MAX_OVERRUN_MS else ()


def _service_silent(state: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if state.torque_on and state.context.service_age_ms > config.service_silence_ms else ()


def _other_run(state: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if state.torque_on and state.context.run_id_mismatches >= _MAX_RUN_ID_MISMATCHES else ()


def _journal_fault(state: CycleState, config: StationConfig) -> Iterable[None]:
    return () if state.context.journal_ok else (None,)


def _raised_by_code(state: CycleState, config: StationConfig) -> Iterable[None]:
    """Return no axis, because the code raises this fault directly, for a command or before sending a setpoint."""
    return ()


FAULTS: Final = (
    Fault(
        "estop_pressed",
        0,
        texts.ESTOP_PRESSED,
        texts.RELEASE_SWITCH,
        _estop_pressed,
    ),
    Fault(
        "estop_unknown",
        0,
        texts.ESTOP_UNKNOWN,
        texts.CHECK_SWITCH_CABLE,
        _estop_unknown,
    ),
    Fault(
        "contacts_disagree",
        0,
        texts.CONTACTS_DISAGREE,
        texts.HAVE_SWITCH_CHECKED,
        _contacts_disagree,
    ),
    Fault(
        "bus_lost",
        0,
        texts.BUS_LOST,
        texts.CHECK_ADAPTER_AND_POWER,
        _bus_lost,
    ),
    Fault(
        "other_adapter",
        0,
        texts.OTHER_ADAPTER,
        texts.CONNECT_FORMER_ADAPTER,
        _other_adapter,
    ),
    Fault(
        "torque_found",
        2,
        texts.TORQUE_FOUND,
        texts.SUPPORT_AND_RELEASE_TORQUE,
        _torque_found,
    ),
    Fault(
        "drive_reset",
        0,
        texts.DRIVE_RESET,
        texts.WAIT_FOR_SET_UP,
        _drive_reset,
    ),
    Fault(
        "drive_silent",
        0,
        texts.DRIVE_SILENT,
        texts.CHECK_MOTOR_CABLE,
        _drive_silent,
    ),
    Fault(
        "drive_garbled",
        0,
        texts.DRIVE_GARBLED,
        texts.CHECK_BUS_CABLE,
        _drive_garbled,
    ),
    Fault(
        "drive_error",
        0,
        texts.DRIVE_ERROR,
        texts.LET_MOTOR_COOL,
        _drive_error,
    ),
    Fault(
        "drive_watchdog",
        0,
        texts.DRIVE_WATCHDOG,
        texts.CHECK_PATIENT_AND_ARM,
        _drive_watchdog,
    ),
    Fault(
        "torque_lost",
        0,
        texts.TORQUE_LOST,
        texts.CHECK_MOTOR_POWER,
        _torque_lost,
    ),
    Fault(
        "torque_remains",
        0,
        texts.TORQUE_REMAINS,
        texts.SUPPORT_AND_SWITCH_OFF,
        _torque_remains,
    ),
    Fault(
        "position_jump",
        0,
        texts.POSITION_JUMP,
        texts.HAVE_ENCODER_CHECKED,
        _position_jump,
    ),
    Fault(
        "position_frozen",
        0,
        texts.POSITION_FROZEN,
        texts.LOOK_WHETHER_ARM_IS_HELD,
        _position_frozen,
    ),
    Fault(
        "overtorque",
        0,
        texts.OVERTORQUE,
        texts.HAVE_LIMITS_CHECKED,
        _overtorque,
    ),
    Fault("overacceleration", 0, texts.OVERACCELERATION, texts.CHECK_PATIENT_AND_ARM, _overacceleration),
    Fault("position_limit", 1, texts.POSITION_LIMIT, texts.CHECK_PATIENT_AND_ARM, _position_limit),
    Fault("overspeed", 0, texts.OVERSPEED, texts.CHECK_PATIENT_AND_ARM, _overspeed),
    Fault(
        "following_error",
        1,
        texts.FOLLOWING_ERROR,
        texts.CHECK_PATIENT_AND_ARM,
        _following_error,
    ),
    Fault(
        "setpoint_step",
        0,
        texts.SETPOINT_STEP,
        texts.REPORT_IMPOSSIBLE,
        _raised_by_code,
    ),
    Fault("setpoint_limit", 0, texts.SETPOINT_LIMIT, texts.REPORT_IMPOSSIBLE, _raised_by_code),
    Fault("setpoint_acceleration", 0, texts.SETPOINT_ACCELERATION, texts.REPORT_IMPOSSIBLE, _raised_by_code),
    Fault("setpoint_frozen", 1, texts.SETPOINT_FROZEN, texts.REPORT_IMPOSSIBLE, _setpoint_frozen),
    Fault("overrun", 1, texts.OVERRUN, texts.CHECK_PATIENT_AND_ARM, _overrun),
    Fault(
        "service_silent",
        1,
        texts.SERVICE_SILENT,
        texts.CHECK_PATIENT_AND_ARM,
        _service_silent,
    ),
    Fault(
        "other_run",
        1,
        texts.OTHER_RUN,
        texts.ACKNOWLEDGE_AND_LOAD_AGAIN,
        _other_run,
    ),
    Fault(
        "journal_fault",
        1,
        texts.JOURNAL_FAULT,
        texts.MAKE_ROOM_ON_DISK,
        _journal_fault,
    ),
    Fault(
        "load_repeated",
        2,
        texts.RESISTANCE_REPEATED,
        texts.SUPPORT_THEN_ACKNOWLEDGE,
        _raised_by_code,
    ),
    Fault(
        "load_on_the_way",
        2,
        texts.RESISTANCE_ON_APPROACH_OR_RETURN,
        texts.SUPPORT_THEN_ACKNOWLEDGE,
        _raised_by_code,
    ),
    Fault(
        "arm_too_heavy",
        2,
        texts.ARM_TOO_HEAVY,
        texts.SUPPORT_AND_MAKE_LIGHTER,
        _raised_by_code,
    ),
    Fault(
        "load_while_held",
        2,
        texts.RESISTANCE_WHILE_HELD,
        texts.SUPPORT_THEN_ACKNOWLEDGE,
        _raised_by_code,
    ),
    Fault("operator_stop", 1, texts.OPERATOR_STOP, texts.ACKNOWLEDGE_WHEN_SAFE, _raised_by_code),
    Fault(
        "browser_lost",
        1,
        texts.BROWSER_LOST,
        texts.CHECK_PATIENT,
        _raised_by_code,
    ),
    Fault(
        "unexpected_error",
        0,
        texts.UNEXPECTED_ERROR,
        texts.REPORT_WITH_DEVICE_LOG,
        _raised_by_code,
    ),
)
"""The fault table. The most informative faults come first."""

FAULT_BY_CODE: Final = {fault.code: fault for fault in FAULTS}


def evaluate_faults(state: CycleState, config: StationConfig) -> list[FaultKey]:
    """Return every fault that holds in this cycle, in table order."""
    return [(fault.code, axis) for fault in FAULTS for axis in fault.holds(state, config)]
