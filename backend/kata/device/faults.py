"""What stops the apparatus: one row a fault, judged every cycle from that cycle's facts alone.

A fault is latched when its condition first holds, and counts as cleared while it no longer does. Each row says how to
stop, because torque off can itself be the harm (the arm drops): category 0 cuts torque in the same cycle, category 1
ramps down first, category 2 ramps down and holds the arm until somebody acknowledges.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from kata.device.config import Axis, StationConfig
from kata.device.config_rules import OVERSPEED
from kata.device.cycle_state import CycleState, Limits

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
    """One row of the table. ``{motor}`` in a sentence is replaced by the motor's number."""

    code: str
    category: Literal[0, 1, 2]
    message: str
    next_step: str
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


_CHECK_AND_ACKNOWLEDGE: Final = "Look after the patient and the arm, then acknowledge."

_REPORT: Final = "Acknowledge, and report this: it should not be possible."

FAULTS: Final = (
    Fault(
        "estop_pressed",
        0,
        "The emergency stop was pressed.",
        "Look after the patient, release the switch, then acknowledge.",
        _estop_pressed,
    ),
    Fault(
        "estop_unknown",
        0,
        "The emergency stop's state is unknown.",
        "Check the switch's cable and its drive's power, then acknowledge.",
        _estop_unknown,
    ),
    Fault(
        "contacts_disagree",
        0,
        "The two contacts of the emergency stop contradict each other.",
        "Support the arm. Have the switch and its wires checked, test the emergency stop, then acknowledge.",
        _contacts_disagree,
    ),
    Fault(
        "bus_lost",
        0,
        "The connection to the motors is lost.",
        "Support the arm: the motors may still hold it. Check the RS-485 adapter and the power supplies; the connection comes back by itself.",
        _bus_lost,
    ),
    Fault(
        "torque_found",
        2,
        "Motor {motor} has held the arm since before the connection came back.",
        "Support the arm, then release the torque.",
        _torque_found,
    ),
    Fault(
        "drive_reset",
        0,
        "Motor {motor} has lost its settings.",
        "Support the arm. Wait until the motor is set up again, test the emergency stop, then acknowledge.",
        _drive_reset,
    ),
    Fault(
        "drive_silent",
        0,
        "Motor {motor} does not answer.",
        "Support the arm: this motor may still hold it. Check its cable and power supply, then acknowledge.",
        _drive_silent,
    ),
    Fault(
        "drive_garbled",
        0,
        "Motor {motor}'s answers come damaged.",
        "Check the bus cable's shield and terminators, and that no two motors share an address; then acknowledge.",
        _drive_garbled,
    ),
    Fault(
        "drive_error",
        0,
        "Motor {motor} reports a hardware error.",
        "Support the arm. Let the motor cool down, switch its power supply off and on, then acknowledge.",
        _drive_error,
    ),
    Fault(
        "drive_watchdog",
        0,
        "Motor {motor} stopped by itself because the bus fell silent.",
        _CHECK_AND_ACKNOWLEDGE,
        _drive_watchdog,
    ),
    Fault(
        "torque_lost",
        0,
        "Motor {motor} has switched its torque off by itself.",
        "Support the arm. Check the motor's power supply, then acknowledge.",
        _torque_lost,
    ),
    Fault(
        "torque_remains",
        0,
        "Motor {motor} still has torque although it was switched off.",
        "Support the arm, then switch the power supplies off.",
        _torque_remains,
    ),
    Fault(
        "position_jump",
        0,
        "Motor {motor} reported a position that it cannot have reached.",
        "Have its encoder looked at, then acknowledge.",
        _position_jump,
    ),
    Fault(
        "position_frozen",
        0,
        "Motor {motor} does not move, or its encoder has stopped.",
        "Look whether the arm is held fast; if it is not, have the encoder looked at. Then acknowledge.",
        _position_frozen,
    ),
    Fault(
        "overtorque",
        0,
        "Motor {motor} gave more than its rated torque.",
        "Look after the patient, have the motor's limits looked at, then acknowledge.",
        _overtorque,
    ),
    Fault("overacceleration", 0, "Motor {motor} moved too abruptly.", _CHECK_AND_ACKNOWLEDGE, _overacceleration),
    Fault("position_limit", 1, "Motor {motor} left its range.", _CHECK_AND_ACKNOWLEDGE, _position_limit),
    Fault("overspeed", 0, "Motor {motor} was too fast.", _CHECK_AND_ACKNOWLEDGE, _overspeed),
    Fault(
        "following_error",
        1,
        "Motor {motor} could not follow its setpoint: something holds the arm.",
        _CHECK_AND_ACKNOWLEDGE,
        _following_error,
    ),
    Fault(
        "setpoint_step",
        0,
        "Motor {motor} was about to be sent a jump.",
        _REPORT,
        _never,
    ),
    Fault("setpoint_limit", 0, "Motor {motor} was about to be sent beyond its limit.", _REPORT, _never),
    Fault("setpoint_acceleration", 0, "Motor {motor} was about to be sent a jerk.", _REPORT, _never),
    Fault("setpoint_frozen", 1, "The control program has stopped planning the movement.", _REPORT, _setpoint_frozen),
    Fault("overrun", 1, "The control computer was too slow.", _CHECK_AND_ACKNOWLEDGE, _overrun),
    Fault(
        "service_silent",
        1,
        "The control computer lost its connection to the clinic service.",
        _CHECK_AND_ACKNOWLEDGE,
        _service_silent,
    ),
    Fault(
        "other_run",
        1,
        "The clinic service and the control computer do not mean the same run.",
        "Acknowledge, and load the recording again.",
        _other_run,
    ),
    Fault(
        "journal_fault",
        1,
        "What is measured can no longer be written to the disk.",
        "Make room on the disk, then acknowledge.",
        _journal_fault,
    ),
    Fault(
        "load_repeated",
        2,
        "Motor {motor} met resistance twice in the same place.",
        "The arm is held: support it, then acknowledge, and its torque goes off.",
        _never,
    ),
    Fault(
        "load_on_the_way",
        2,
        "Motor {motor} met resistance on the way to the start or back.",
        "The arm is held: support it, then acknowledge, and its torque goes off.",
        _never,
    ),
    Fault(
        "load_while_held",
        2,
        "Motor {motor} met resistance while the arm was held.",
        "The arm is held: support it, then acknowledge, and its torque goes off.",
        _never,
    ),
    Fault("operator_stop", 1, "Stopped by the operator.", "Acknowledge when it is safe to go on.", _never),
    Fault(
        "browser_lost",
        1,
        "The browser that operated the apparatus was gone for too long.",
        "Look after the patient, then acknowledge.",
        _never,
    ),
    Fault(
        "unexpected_error",
        0,
        "The control program met an error of its own.",
        "Acknowledge, and report this with the log.",
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
