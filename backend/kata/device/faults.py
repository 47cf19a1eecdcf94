"""What stops the apparatus: one row a fault, judged every cycle from that cycle's facts alone.

A fault is latched when its condition first holds, and counts as cleared while it no longer does. Each row says how to
stop, because torque off can itself be the harm (the arm drops): category 0 cuts torque in the same cycle, category 1
ramps down first, category 2 ramps down and holds the arm until somebody acknowledges.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from kata.device import texts
from kata.device.config import Axis, StationConfig
from kata.device.config_rules import OVERSPEED
from kata.device.cycle_state import CycleState, Limits
from kata.messages import Template

OVERRUN_LIMIT_MS: Final = 250.0
"""Setpoints this late: the arm has stood still, and the present setpoint is no longer near it in time."""
_STEP: Final = 1.5
_STEP_TOLERANCE_DEG: Final = 1.0
_ROUNDING_DEG: Final = 1e-6
_OVERTORQUE_MS: Final = 100.0
_ACCELERATING_MS: Final = 30.0
_JUMP_DEG: Final = 5.0
FROZEN_DEG: Final = 8.0
"""So far a setpoint may go before the drive has answered to it with a single count of its encoder."""
_SETPOINT_PERIODS: Final = 3
_STATUS_SILENCE_MS: Final = 1000.0
_DISAGREEMENTS: Final = 3

Key = tuple[str, int | None]
"""A fault's code and axis (0-4) or None."""

Condition = Callable[[CycleState, StationConfig], Iterable[int | None]]
"""The axes (0-4) for which the fault holds; a single None where it belongs to no axis; nothing where it does not hold."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One row of the table. The code of ``message`` is the fault's; its parameter, if it has one, is the motor's number."""

    code: str
    category: Literal[0, 1, 2]
    message: Template
    next_step: Template
    holds: Condition


def _estop_pressed(facts: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.estop == "open" else ()


def _estop_unknown(facts: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.estop == "unknown" and facts.bus_ok else ()


def _bus_lost(facts: CycleState, config: StationConfig) -> Iterable[None]:
    return () if facts.bus_ok else (None,)


def _drive_silent(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return _unheard(facts, config, garbled=False)


def _drive_garbled(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return _unheard(facts, config, garbled=True)


def _unheard(facts: CycleState, config: StationConfig, *, garbled: bool) -> Iterable[int]:
    if not facts.bus_ok:
        return ()
    ages = zip(facts.drive_age_ms, facts.status_age_ms, facts.garbled, strict=True)
    return (
        n
        for n, (drive_ms, status_ms, unsound) in enumerate(ages)
        if unsound == garbled and (drive_ms > config.silence_ms or status_ms > _STATUS_SILENCE_MS)
    )


def _drive_error(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, error in enumerate(facts.hardware_error) if error)


def _drive_watchdog(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, tripped in enumerate(facts.watchdog_tripped) if tripped and facts.torque_on)


def _torque_lost(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, reported in enumerate(facts.torque_reported) if facts.torque_on and reported is False)


def _torque_remains(facts: CycleState, config: StationConfig) -> Iterable[int]:
    switched_off = not facts.torque_on and not facts.situation.torque_left
    return (n for n, reported in enumerate(facts.torque_reported) if switched_off and reported)


def _torque_found(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, reported in enumerate(facts.torque_reported) if facts.situation.torque_left and reported)


def _drive_reset(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, reset in enumerate(facts.reset) if reset)


def _contacts_disagree(facts: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.contacts_disagree_ms > config.inputs.contacts_disagree_ms else ()


def _position_limit(facts: CycleState, config: StationConfig) -> Iterable[int]:
    if not facts.torque_on:
        return ()
    # Half of the tolerance is in the limits of what may be commanded already.
    tolerance = config.limit_tolerance_deg / 2
    measured = zip(facts.situation.limits_deg, facts.measured_deg, strict=True)
    return (n for n, ((low, high), angle) in enumerate(measured) if not low - tolerance <= angle <= high + tolerance)


def _overspeed(facts: CycleState, config: StationConfig) -> Iterable[int]:
    if not facts.torque_on:
        return ()
    return (
        n
        for n, (axis, speed) in enumerate(zip(config.axes, facts.speed_deg_s, strict=True))
        if abs(speed) > OVERSPEED * axis.max_speed_deg_s
    )


def _following_error(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, lasted in enumerate(facts.following_ms) if lasted > config.following_error_ms)


def _overtorque(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, lasted in enumerate(facts.overtorque_ms) if lasted > _OVERTORQUE_MS and facts.torque_on)


def _overacceleration(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, lasted in enumerate(facts.accelerating_ms) if lasted > _ACCELERATING_MS and facts.torque_on)


def _position_jump(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, jump in enumerate(facts.jump_deg) if jump > _JUMP_DEG and facts.torque_on)


def _position_frozen(facts: CycleState, config: StationConfig) -> Iterable[int]:
    return (n for n, gone in enumerate(facts.frozen_deg) if gone > FROZEN_DEG)


def _setpoint_frozen(facts: CycleState, config: StationConfig) -> Iterable[None]:
    limit = _SETPOINT_PERIODS * config.cycle_hz // facts.situation.rate_hz
    return (None,) if facts.torque_on and facts.setpoint_cycles > limit else ()


def _overrun(facts: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.torque_on and facts.situation.late_ms > OVERRUN_LIMIT_MS else ()


def _service_silent(facts: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.torque_on and facts.situation.service_age_ms > config.service_silence_ms else ()


def _other_run(facts: CycleState, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.torque_on and facts.situation.disagreements >= _DISAGREEMENTS else ()


def _journal_fault(facts: CycleState, config: StationConfig) -> Iterable[None]:
    return () if facts.situation.journal_ok else (None,)


def _never(facts: CycleState, config: StationConfig) -> Iterable[None]:
    """Raised by an act, or before something is sent, and not by a condition; cleared at once."""
    return ()


_CHECK_AND_ACKNOWLEDGE: Final = texts.CHECK_PATIENT_AND_ARM

_REPORT: Final = texts.REPORT_IMPOSSIBLE

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
        _CHECK_AND_ACKNOWLEDGE,
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
    Fault("overacceleration", 0, texts.OVERACCELERATION, _CHECK_AND_ACKNOWLEDGE, _overacceleration),
    Fault("position_limit", 1, texts.POSITION_LIMIT, _CHECK_AND_ACKNOWLEDGE, _position_limit),
    Fault("overspeed", 0, texts.OVERSPEED, _CHECK_AND_ACKNOWLEDGE, _overspeed),
    Fault(
        "following_error",
        1,
        texts.FOLLOWING_ERROR,
        _CHECK_AND_ACKNOWLEDGE,
        _following_error,
    ),
    Fault(
        "setpoint_step",
        0,
        texts.SETPOINT_STEP,
        _REPORT,
        _never,
    ),
    Fault("setpoint_limit", 0, texts.SETPOINT_LIMIT, _REPORT, _never),
    Fault("setpoint_acceleration", 0, texts.SETPOINT_ACCELERATION, _REPORT, _never),
    Fault("setpoint_frozen", 1, texts.SETPOINT_FROZEN, _REPORT, _setpoint_frozen),
    Fault("overrun", 1, texts.OVERRUN, _CHECK_AND_ACKNOWLEDGE, _overrun),
    Fault(
        "service_silent",
        1,
        texts.SERVICE_SILENT,
        _CHECK_AND_ACKNOWLEDGE,
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
        texts.LOAD_REPEATED,
        texts.SUPPORT_THEN_ACKNOWLEDGE,
        _never,
    ),
    Fault(
        "load_on_the_way",
        2,
        texts.LOAD_ON_THE_WAY,
        texts.SUPPORT_THEN_ACKNOWLEDGE,
        _never,
    ),
    Fault(
        "load_while_held",
        2,
        texts.LOAD_WHILE_HELD,
        texts.SUPPORT_THEN_ACKNOWLEDGE,
        _never,
    ),
    Fault("operator_stop", 1, texts.OPERATOR_STOP, texts.ACKNOWLEDGE_WHEN_SAFE, _never),
    Fault(
        "browser_lost",
        1,
        texts.BROWSER_LOST,
        texts.CHECK_PATIENT,
        _never,
    ),
    Fault(
        "unexpected_error",
        0,
        texts.UNEXPECTED_ERROR,
        texts.REPORT_WITH_DEVICE_LOG,
        _never,
    ),
)
"""The fault table, most telling first."""

FAULT_BY_CODE: Final = {fault.code: fault for fault in FAULTS}


def largest_step_deg(axis: Axis, rate_hz: int) -> float:
    """From one setpoint to the next, of so many a second."""
    return _STEP * axis.max_speed_deg_s / rate_hz + _STEP_TOLERANCE_DEG


def refused_setpoints(
    last_deg: Sequence[Sequence[float]],
    next_deg: Sequence[float],
    limits_deg: Limits,
    config: StationConfig,
    rate_hz: int,
) -> list[Key]:
    """The last look at a setpoint before it is sent: beyond a limit, too far from the last one, or too abrupt.

    ``last_deg``: the one or two that went before, the newest last. ``rate_hz``: setpoints a second. Not a number is
    further than any limit.
    """
    newest = last_deg[-1]
    found: list[Key] = []
    for n, (axis, angle, (low, high)) in enumerate(zip(config.axes, next_deg, limits_deg, strict=True)):
        if not low - _ROUNDING_DEG <= angle <= high + _ROUNDING_DEG:
            found.append(("setpoint_limit", n))
        if not abs(angle - newest[n]) <= largest_step_deg(axis, rate_hz):
            found.append(("setpoint_step", n))
        elif len(last_deg) > 1:
            bend = abs(angle - 2 * newest[n] + last_deg[-2][n]) * rate_hz**2
            if bend > axis.max_acceleration_deg_s2:
                found.append(("setpoint_acceleration", n))
    return found
