"""Monitors supply voltage and temperature of the drives, and warns before a drive's own limits are reached.

A warning does not stop the apparatus. At the limit itself the drive switches its torque off, which is the fault ``drive_error``.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from kata.device import texts
from kata.device.bus.interface import DriveHealth
from kata.device.ipc_messages import DriveWarning
from kata.messages import Template, Text, key_of

TEMPERATURE_MARGIN_C: Final = 10.0
"""A warning begins this far below the temperature at which the drive switches its torque off."""
VOLTAGE_MARGIN_V: Final = 0.5
"""A warning begins this far above the drive's lowest and below its highest supply voltage."""
WARNING_HOLD_S: Final = 10.0
"""Time for which a warning remains after its condition was last observed, so that a voltage that sags with each motion
causes one warning.
"""
_MAX_AGE_NS: Final = 10_000_000_000
"""Values older than this count as unknown."""


_Params = dict[str, float]


def _hot(health: DriveHealth) -> _Params | None:
    value, limit = health.temperature_c, health.max_temperature_c
    if value is None or limit is None or value < limit - TEMPERATURE_MARGIN_C:
        return None
    return {"temperature_c": value, "limit_c": limit}


def _low(health: DriveHealth) -> _Params | None:
    value, limit = health.voltage_v, health.min_voltage_v
    if value is None or limit is None or value > limit + VOLTAGE_MARGIN_V:
        return None
    return {"voltage_v": value, "limit_v": limit}


def _high(health: DriveHealth) -> _Params | None:
    value, limit = health.voltage_v, health.max_voltage_v
    if value is None or limit is None or value < limit - VOLTAGE_MARGIN_V:
        return None
    return {"voltage_v": value, "limit_v": limit}


@dataclass(frozen=True, slots=True)
class WarningKind:
    """One kind of warning. ``check`` returns the message's parameters except ``motor``, or None if the condition does not hold."""

    message: Template
    next_step: Template
    check: Callable[[DriveHealth], _Params | None]


WARNING_KINDS: Final = (
    WarningKind(texts.DRIVE_HOT, texts.END_AND_LET_COOL, _hot),
    WarningKind(texts.SUPPLY_LOW, texts.HAVE_SUPPLY_CHECKED, _low),
    WarningKind(texts.SUPPLY_HIGH, texts.HAVE_SUPPLY_CHECKED, _high),
)


class HealthMonitor:
    """Stores the newest values of each drive and the present warnings."""

    def __init__(self, axes: int) -> None:
        self._newest: list[DriveHealth | None] = [None] * axes
        self._warnings: dict[tuple[int, int], tuple[int, Text]] = {}
        """Time at which the condition was last observed, and the text, by axis and kind."""

    def update(self, health: Iterable[DriveHealth]) -> list[Text]:
        """Store the reported values. Return the texts of the warnings that begin."""
        begun = []
        for drive in health:
            self._newest[drive.axis] = drive
            for n, kind in enumerate(WARNING_KINDS):
                found = kind.check(drive)
                if found is None:
                    continue
                text = kind.message(motor=drive.axis + 1, **found)
                if (drive.axis, n) not in self._warnings:
                    begun.append(text)
                self._warnings[drive.axis, n] = (drive.t_ns, text)
        return begun

    def newest(self, axis: int, t_ns: int) -> DriveHealth | None:
        """Return the newest values of a drive (axis 0-4); None if they are unknown at ``t_ns``."""
        health = self._newest[axis]
        return health if health and t_ns - health.t_ns <= _MAX_AGE_NS else None

    def warnings(self, t_ns: int) -> tuple[DriveWarning, ...]:
        """Return the warnings at ``t_ns`` in axis order. Discard warnings that have ended."""
        hold_ns = int(WARNING_HOLD_S * 1e9)
        self._warnings = {key: seen for key, seen in self._warnings.items() if t_ns - seen[0] <= hold_ns}
        return tuple(
            [self._warning(axis, kind, text) for (axis, kind), (_, text) in sorted(self._warnings.items(), key=_place)]
        )

    @staticmethod
    def _warning(axis: int, kind: int, text: Text) -> DriveWarning:
        next_step = WARNING_KINDS[kind].next_step()
        return DriveWarning(
            code=text.key.code,
            motor=axis + 1,
            message=str(text),
            next_step=str(next_step),
            message_key=key_of(text),
            next_step_key=key_of(next_step),
        )


def _place(item: tuple[tuple[int, int], object]) -> tuple[int, int]:
    return item[0]
