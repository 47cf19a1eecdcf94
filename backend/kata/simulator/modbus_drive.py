"""Simulates the registers of a Modbus drive. Units: 0.01 deg for positions, 0.01 Nm for torques, 0.1 deg/s for speeds.

Values of 32 bits take two registers, high word first, and can only be written together.
"""

import math
import struct
from collections.abc import Callable, Sequence
from typing import Final

from kata.simulator.drive import Drive
from kata.simulator.modbus import DEVICE_FAILURE, ILLEGAL_ADDRESS, ILLEGAL_VALUE, RefusedError
from kata.simulator.parameters import DRIVES

TORQUE_ENABLE, CLEAR, WATCHDOG_MS, TORQUE_LIMIT = 0x0000, 0x0001, 0x0002, 0x0003
MIN_POSITION, MAX_POSITION, RESPONSE_DELAY_US = 0x0004, 0x0006, 0x0008
MIN_VOLTAGE, MAX_VOLTAGE, MAX_TEMPERATURE = 0x0009, 0x000A, 0x000B
"""Read-only limits in 0.1 V and degrees Celsius. Beyond a limit the drive has an error and switches torque off."""
GOAL_POSITION = 0x0010
STATUS, ERROR, PRESENT_POSITION, PRESENT_SPEED, PRESENT_TORQUE = 0x0020, 0x0021, 0x0022, 0x0024, 0x0025
PRESENT_VOLTAGE, PRESENT_TEMPERATURE = 0x0026, 0x0027
TORQUE_IS_ON, WATCHDOG_TRIPPED = 0b01, 0b10
"""Bits of the status word."""

_LONG: Final = (MIN_POSITION, MAX_POSITION, GOAL_POSITION)
_WRITABLE: Final = frozenset((*range(TORQUE_ENABLE, RESPONSE_DELAY_US + 1), GOAL_POSITION, GOAL_POSITION + 1))
_MAX_POSITION: Final = 180_000
_RATED_TORQUE: Final = 1_000
_RESPONSE_DELAY_US: Final = 500
_VOLTAGE_LIMITS: Final = (200, 280)
_TEMPERATURE_LIMIT: Final = 85
_VOLTAGE_ERROR, _TEMPERATURE_ERROR = 1, 2
_WATCHDOG_STEP_MS: Final = 20
_WATCHDOG_STEPS: Final = 127


class ModbusDrive:
    """One drive on the bus. Its slave id is the motor's number unless the drive was exchanged."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.slave = drive.motor
        self.environment = (24.0, 32)
        self.reboot()

    @property
    def response_delay_s(self) -> float:
        """Delay of the drive's answers, in seconds."""
        return self._delay_us * 1e-6

    def reboot(self) -> None:
        """Reset to the power-up state."""
        self._minimum, self._maximum = -_MAX_POSITION, _MAX_POSITION
        self._torque_limit = _RATED_TORQUE
        self._delay_us = _RESPONSE_DELAY_US
        self._error = 0
        self.drive.switch(on=False)
        self.drive.tripped = False
        self.drive.watchdog_s = 0.0
        self._tune()

    def exchange(self, drive_id: int, model: int | None = None) -> None:
        """Replace the drive with another drive that has its power-up values. This protocol has no register for a model."""
        self.slave = drive_id
        self.reboot()

    def fail(self, code: int) -> None:
        """Set the error; 0 means none. An error switches torque off."""
        self._error = code
        if code:
            self.drive.switch(on=False)

    def expose(self, volt: float | None = None, temperature_c: int | None = None) -> None:
        """Change the supply's voltage and the drive's temperature."""
        now_volt, now_c = self.environment
        self.environment = (now_volt if volt is None else volt, now_c if temperature_c is None else temperature_c)
        least, most = _VOLTAGE_LIMITS
        if not least <= round(10 * self.environment[0]) <= most:
            self.fail(_VOLTAGE_ERROR)
        elif self.environment[1] > _TEMPERATURE_LIMIT:
            self.fail(_TEMPERATURE_ERROR)

    def inputs(self, address: int, count: int) -> list[bool]:
        """Return the discrete inputs: True for each closed contact that is wired to this drive.

        :raises RefusedError: when an input does not exist.
        """
        contacts = [self.drive.contacts[port] for port in sorted(self.drive.contacts)]
        if address + count > len(contacts):
            raise RefusedError(ILLEGAL_ADDRESS)
        return contacts[address : address + count]

    def read(self, address: int, count: int) -> list[int]:
        """Return the values of registers.

        :raises RefusedError: when a register does not exist.
        """
        for first, values_of in _SPANS.items():
            if first <= address:
                values = values_of(self)[address - first : address - first + count]
                if len(values) == count:
                    return list(values)
        raise RefusedError(ILLEGAL_ADDRESS)

    def write(self, address: int, values: Sequence[int]) -> None:
        """Write all given registers, or none of them.

        :raises RefusedError: when a register is read-only, a value is invalid, or the drive's state forbids it.
        """
        touched = range(address, address + len(values))
        split_value = any((high in touched) != (high + 1 in touched) for high in _LONG)
        if split_value or not _WRITABLE.issuperset(touched):
            raise RefusedError(ILLEGAL_ADDRESS)
        wanted = dict(enumerate(self._settings()))
        wanted |= enumerate(self._goal(), GOAL_POSITION)
        wanted |= zip(touched, values, strict=True)
        minimum, maximum, goal = (_signed(wanted[high], wanted[high + 1]) for high in _LONG)
        has_goal = GOAL_POSITION in touched
        watchdog_steps = math.ceil(wanted[WATCHDOG_MS] / _WATCHDOG_STEP_MS - 0.5) or int(wanted[WATCHDOG_MS] > 0)
        if (
            wanted[TORQUE_ENABLE] > 1
            or wanted[CLEAR] > 1
            or watchdog_steps > _WATCHDOG_STEPS
            or wanted[TORQUE_LIMIT] > _RATED_TORQUE
            or minimum > maximum
            or (has_goal and not minimum <= goal <= maximum)
        ):
            raise RefusedError(ILLEGAL_VALUE)
        drive = self.drive
        if (has_goal and drive.tripped) or (self._error and TORQUE_ENABLE in touched and wanted[TORQUE_ENABLE]):
            raise RefusedError(DEVICE_FAILURE)

        self._minimum, self._maximum = minimum, maximum
        self._torque_limit, self._delay_us = wanted[TORQUE_LIMIT], wanted[RESPONSE_DELAY_US]
        self._tune()
        drive.watchdog_s = watchdog_steps * _WATCHDOG_STEP_MS / 1000
        drive.tripped = drive.tripped and not wanted[CLEAR]
        kept_goal = drive.goal
        drive.switch(wanted[TORQUE_ENABLE] == 1)
        # Unlike the X series, such a drive turns to the goal that it was given before it had torque.
        drive.goal = kept_goal
        if has_goal:
            drive.set_goal(math.radians(goal / 100))

    def stored(self, address: int, size: int) -> bytes:
        """Return the contents of registers, high byte first, without a request on the bus."""
        return struct.pack(f">{size // 2}H", *self.read(address, size // 2))

    def store(self, address: int, data: bytes) -> None:
        """Change the contents of registers, without a request on the bus."""
        self.write(address, struct.unpack(f">{len(data) // 2}H", data))

    def _tune(self) -> None:
        """Set the drive's gains to those of the tuned servos."""
        gains = DRIVES[self.drive.motor - 1]
        self.drive.tune(gains.p_nm_rad, gains.i_nm_rad_s, gains.d_nm_s_rad, self._torque_limit / 100)

    def _settings(self) -> tuple[int, ...]:
        """Return the registers from TORQUE_ENABLE to MAX_TEMPERATURE."""
        drive = self.drive
        return (
            int(drive.torque_on),
            0,
            round(drive.watchdog_s * 1000),
            self._torque_limit,
            *_long(self._minimum),
            *_long(self._maximum),
            self._delay_us,
            *_VOLTAGE_LIMITS,
            _TEMPERATURE_LIMIT,
        )

    def _goal(self) -> tuple[int, ...]:
        """Return the two registers at GOAL_POSITION."""
        return _long(round(math.degrees(self.drive.goal) * 100))

    def _present(self) -> tuple[int, ...]:
        """Return the registers from STATUS to PRESENT_TEMPERATURE."""
        drive, report = self.drive, self.drive.report
        volt, temperature_c = self.environment
        return (
            TORQUE_IS_ON * drive.torque_on | WATCHDOG_TRIPPED * drive.tripped,
            self._error,
            *_long(round(math.degrees(report.angle) * 100)),
            _short(math.degrees(report.speed) * 10),
            _short(report.torque_nm * 100),
            round(10 * volt),
            _short(temperature_c),
        )


_SPANS: Final[dict[int, Callable[[ModbusDrive], tuple[int, ...]]]] = {
    STATUS: ModbusDrive._present,
    GOAL_POSITION: ModbusDrive._goal,
    TORQUE_ENABLE: ModbusDrive._settings,
}
"""First register of each span without a gap, highest first, and its present values."""


def _long(value: int) -> tuple[int, int]:
    return value >> 16 & 0xFFFF, value & 0xFFFF


def _short(value: float) -> int:
    return min(max(round(value), -0x8000), 0x7FFF) & 0xFFFF


def _signed(high: int, low: int) -> int:
    return (high << 16 | low) - ((high >> 15) << 32)
