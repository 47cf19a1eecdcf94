"""Which driver a station's configuration asks for."""

from collections.abc import Callable

from kata.device.bus.dynamixel import DynamixelBus
from kata.device.bus.modbus import ModbusBus
from kata.device.bus.port import Bus
from kata.device.bus.serial_transport import Line, SerialLine
from kata.device.config import StationConfig


def make_bus(config: StationConfig, open_line: Callable[[str, int], Line] = SerialLine) -> Bus:
    """The driver, whose port is not opened yet, for the apparatus as it stands. Tests give it a line of their own."""
    config = config.as_it_stands
    if config.protocol == "modbus":
        return ModbusBus(config, open_line)
    return DynamixelBus(config, open_line)
