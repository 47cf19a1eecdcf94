"""Runs the bus cycle with our own drivers: writes five goals, and reads position, velocity and current of five drives."""

from typing import Final

from kata.bench.bus_cycle import Goals
from kata.device.bus.dynamixel.driver import DynamixelBus
from kata.device.bus.factory import make_bus
from kata.device.bus.serial_transport import SerialTransport
from kata.device.config import StationConfig

_INSTRUCTION_AT: Final = 7
_FAST_SYNC_READ: Final = 0x8A


class KataDrives:
    """Our Dynamixel driver with goals and one read request, which is the same work as for the other libraries."""

    def __init__(self, config: StationConfig, *, fast: bool = True) -> None:
        """Open and configure the drives. ``fast``: True if the drives support Fast Sync Read."""
        self._bus = DynamixelBus(config, SerialTransport if fast else _OlderDrives)
        self._bus.open()
        self._bus.configure(range(len(config.axes)))
        self._goals = Goals(config)
        self.inputs_lost = 0

    def cycle(self) -> int:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._bus.write_setpoints(self._goals.next_deg())
        drives, _, _ = self._bus.read_drives()
        return sum(1 for drive in drives if drive)

    def close(self) -> None:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._bus.close()


class KataCycle:
    """The control loop's whole cycle with the station's driver: goals, drives, their status and the inputs."""

    def __init__(self, config: StationConfig) -> None:
        self._bus = make_bus(config)
        self._bus.open()
        self._bus.configure(range(len(config.axes)))
        self._goals = Goals(config)
        self.inputs_lost = 0

    def cycle(self) -> int:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._bus.write_setpoints(self._goals.next_deg())
        sample = self._bus.read()
        self.inputs_lost += sample.inputs is None
        return sum(1 for drive in sample.drives if drive)

    def close(self) -> None:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._bus.close()


class _OlderDrives(SerialTransport):
    """A serial port whose drives do not support Fast Sync Read. It discards such requests."""

    def send(self, data: bytes) -> None:
        """See :class:`~kata.device.bus.serial_transport.Transport`."""
        if data[_INSTRUCTION_AT] != _FAST_SYNC_READ:
            super().send(data)
