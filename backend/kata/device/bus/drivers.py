"""Which driver a station's configuration asks for."""

from collections.abc import Callable

from kata.device.bus.dynamixel import DynamixelBus
from kata.device.bus.modbus import ModbusBus
from kata.device.bus.port import Bus
from kata.device.bus.serial_transport import SerialTransport, Transport
from kata.device.config import StationConfig


def make_bus(config: StationConfig, open_transport: Callable[[str, int], Transport] = SerialTransport) -> Bus:
    """The driver, whose port is not opened yet, for the apparatus as it stands. Tests give it a line of their own."""
    config = config.with_side_directions
    if config.protocol == "modbus":
        return ModbusBus(config, open_transport)
    return DynamixelBus(config, open_transport)
