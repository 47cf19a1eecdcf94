"""Selects the driver for a station's configuration."""

from collections.abc import Callable

from kata.device.bus.dynamixel.driver import DynamixelBus
from kata.device.bus.modbus.driver import ModbusBus
from kata.device.bus.port import Bus
from kata.device.bus.serial_transport import SerialTransport, Transport
from kata.device.config import StationConfig


def make_bus(config: StationConfig, open_transport: Callable[[str, int], Transport] = SerialTransport) -> Bus:
    """Return the driver for the apparatus on its current side. Its port is not open yet. Tests pass their own
    transport.
    """
    config = config.with_side_directions
    if config.protocol == "modbus":
        return ModbusBus(config, open_transport)
    return DynamixelBus(config, open_transport)
