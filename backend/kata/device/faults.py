"""What stops the apparatus: one row a fault, judged every cycle from that cycle's facts alone.

A fault is latched when its condition first holds, and counts as cleared while it no longer does. Each row says how to
stop, because torque off can itself be the harm (the arm drops): category 0 cuts torque in the same cycle, category 1
ramps down for a quarter of a second first.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from kata.device.config import StationConfig
from kata.device.facts import Facts

OVERRUN_LIMIT_MS: Final = 250.0
"""Setpoints this late: the arm has stood still, and the present setpoint is no longer near it in time."""
_OVERSPEED: Final = 1.5
_STEP: Final = 1.5

Condition = Callable[[Facts, StationConfig], Iterable[int | None]]
"""The axes (0-4) for which the fault holds; a single None where it belongs to no axis; nothing where it does not hold."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One row of the table. ``{motor}`` in a sentence is replaced by the motor's number."""

    code: str
    category: Literal[0, 1]
    message: str
    next_step: str
    holds: Condition


def _estop_pressed(facts: Facts, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.estop == "open" else ()


def _estop_unknown(facts: Facts, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.estop == "unknown" and facts.bus_ok else ()


def _bus_lost(facts: Facts, config: StationConfig) -> Iterable[None]:
    return () if facts.bus_ok else (None,)


def _drive_silent(facts: Facts, config: StationConfig) -> Iterable[int]:
    return (n for n, age in enumerate(facts.drive_age_ms) if age > config.silence_ms and facts.bus_ok)


def _drive_error(facts: Facts, config: StationConfig) -> Iterable[int]:
    return (n for n, error in enumerate(facts.hardware_error) if error)


def _drive_watchdog(facts: Facts, config: StationConfig) -> Iterable[int]:
    return (n for n, tripped in enumerate(facts.watchdog_tripped) if tripped and facts.torque_on)


def _torque_lost(facts: Facts, config: StationConfig) -> Iterable[int]:
    return (n for n, reported in enumerate(facts.torque_reported) if facts.torque_on and reported is False)


def _torque_remains(facts: Facts, config: StationConfig) -> Iterable[int]:
    return (n for n, reported in enumerate(facts.torque_reported) if not facts.torque_on and reported)


def _position_limit(facts: Facts, config: StationConfig) -> Iterable[int]:
    if not facts.torque_on:
        return ()
    tolerance = config.limit_tolerance_deg
    return (
        n
        for n, (axis, angle) in enumerate(zip(config.axes, facts.measured_deg, strict=True))
        if not axis.min_deg - tolerance <= angle <= axis.max_deg + tolerance
    )


def _overspeed(facts: Facts, config: StationConfig) -> Iterable[int]:
    if not facts.torque_on:
        return ()
    return (
        n
        for n, (axis, speed) in enumerate(zip(config.axes, facts.speed_deg_s, strict=True))
        if abs(speed) > _OVERSPEED * axis.max_speed_deg_s
    )


def _following_error(facts: Facts, config: StationConfig) -> Iterable[int]:
    return (n for n, lasted in enumerate(facts.following_ms) if lasted > config.following_error_ms)


def setpoint_steps(before_deg: Sequence[float], after_deg: Sequence[float], config: StationConfig) -> list[int]:
    """The axes whose next setpoint is further from the last one than the axis may move in that time; it is not sent."""
    return [
        n
        for n, (axis, before, after) in enumerate(zip(config.axes, before_deg, after_deg, strict=True))
        if not abs(after - before) <= _STEP * axis.max_speed_deg_s / config.rate_hz + 1.0
    ]


def _overrun(facts: Facts, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.torque_on and facts.late_ms > OVERRUN_LIMIT_MS else ()


def _service_silent(facts: Facts, config: StationConfig) -> Iterable[None]:
    return (None,) if facts.torque_on and facts.service_age_ms > config.service_silence_ms else ()


def _journal_fault(facts: Facts, config: StationConfig) -> Iterable[None]:
    return () if facts.journal_ok else (None,)


def _never(facts: Facts, config: StationConfig) -> Iterable[None]:
    """Raised by an act, or before something is sent, and not by a condition; cleared at once."""
    return ()


_CHECK_AND_ACKNOWLEDGE: Final = "Look after the patient and the arm, then acknowledge."

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
        "bus_lost",
        0,
        "The connection to the motors is lost.",
        "Check the RS-485 adapter and the power supplies; it is reconnected by itself. Then acknowledge.",
        _bus_lost,
    ),
    Fault(
        "drive_silent",
        0,
        "Motor {motor} does not answer.",
        "Check its cable and power supply, then acknowledge.",
        _drive_silent,
    ),
    Fault(
        "drive_error",
        0,
        "Motor {motor} reports a hardware error.",
        "Let it cool down, switch its power supply off and on, then acknowledge.",
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
        "Check its power supply, then acknowledge.",
        _torque_lost,
    ),
    Fault(
        "torque_remains",
        0,
        "Motor {motor} still has torque although it was switched off.",
        "Switch the power supplies off.",
        _torque_remains,
    ),
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
        "Acknowledge, and report this: it should not be possible.",
        _never,
    ),
    Fault("overrun", 1, "The control computer was too slow.", _CHECK_AND_ACKNOWLEDGE, _overrun),
    Fault(
        "service_silent",
        1,
        "The control computer lost its connection to the clinic service.",
        _CHECK_AND_ACKNOWLEDGE,
        _service_silent,
    ),
    Fault(
        "journal_fault",
        1,
        "What is measured can no longer be written to the disk.",
        "Make room on the disk, then acknowledge.",
        _journal_fault,
    ),
    Fault("operator_stop", 1, "Stopped by the operator.", "Acknowledge when it is safe to go on.", _never),
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
