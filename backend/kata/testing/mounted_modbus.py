"""Provides simulated Modbus drives whose encoders have another zero or count in the opposite direction."""

from collections.abc import Callable, Sequence
from typing import Final

from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.drives import SimulatedDrives
from kata.simulator.lines import ModbusLine
from kata.simulator.modbus_bus import SimulatedModbusBus
from kata.simulator.modbus_drive import (
    GOAL_POSITION,
    MAX_POSITION,
    MIN_POSITION,
    PRESENT_POSITION,
    PRESENT_SPEED,
    PRESENT_TORQUE,
    ModbusDrive,
)

_POSITIONS: Final = (MIN_POSITION, MAX_POSITION, GOAL_POSITION, PRESENT_POSITION)
_WORD: Final = 0xFFFF


class MountedModbusDrive(ModbusDrive):
    """A Modbus drive with its mounting. The registers contain counts of the encoder; the drive itself uses the shaft's angle."""

    _zero, _sign = 0, 1

    def mount(self, zero: int, sign: int) -> None:
        """Set the encoder's count at the shaft's angle 0. ``sign``: -1 if it counts in the opposite direction."""
        self._zero, self._sign = zero, sign

    def read(self, address: int, count: int) -> list[int]:
        """See :meth:`ModbusDrive.read`."""
        return self._converted(address, super().read(address, count), lambda angle: self._sign * angle + self._zero)

    def write(self, address: int, values: Sequence[int]) -> None:
        """See :meth:`ModbusDrive.write`."""
        super().write(address, self._converted(address, values, lambda count: self._sign * (count - self._zero)))

    def _converted(self, address: int, values: Sequence[int], position_of: Callable[[int], int]) -> list[int]:
        """Return the registers from ``address`` on with every position, speed and torque converted."""
        converted = list(values)
        for register in _POSITIONS:
            at = register - address
            if 0 <= at < len(converted) - 1:
                position = position_of(_signed(converted[at], converted[at + 1]))
                converted[at], converted[at + 1] = position >> 16 & _WORD, position & _WORD
        if self._sign > 0:
            return converted
        for register in (PRESENT_SPEED, PRESENT_TORQUE):
            at = register - address
            if 0 <= at < len(converted):
                converted[at] = -converted[at] & _WORD
        low, high = MIN_POSITION - address, MAX_POSITION - address
        if low >= 0 and high < len(converted) - 1:
            # The lower end of the shaft is the upper end of its encoder.
            converted[low : low + 2], converted[high : high + 2] = converted[high : high + 2], converted[low : low + 2]
        return converted


def mounted_modbus_drives(apparatus: SimulatedApparatus, baud: int) -> SimulatedDrives:
    """Return Modbus RTU drives that can be mounted."""
    bus = SimulatedModbusBus(apparatus, baud)
    bus.drives[:] = [MountedModbusDrive(drive) for drive in apparatus.drives]
    return SimulatedDrives(ModbusLine(bus), bus.faults, bus.drives)


def _signed(high: int, low: int) -> int:
    return (high << 16 | low) - ((high >> 15) << 32)
