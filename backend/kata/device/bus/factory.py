"""Makes the driver for a station's configuration."""

from collections.abc import Callable

from kata.device.bus.interface import Bus
from kata.device.bus.registry import find_driver
from kata.device.bus.serial_transport import Transport, port_of
from kata.device.config import StationConfig


def make_bus(config: StationConfig, open_transport: Callable[[str, int], Transport] | None = None) -> Bus:
    """Return the driver for the apparatus on its current side. Its port is not open yet. Tests pass their own
    transport.
    """
    return find_driver(config.protocol).make_bus(config.with_side_directions, open_transport or port_of(config))
