"""How many cycles a second a bus can carry, computed from the bytes of one cycle. A higher rate is refused."""

from typing import TYPE_CHECKING

from kata.device.bus.dynamixel import bandwidth as dynamixel
from kata.device.bus.modbus import bandwidth as modbus

if TYPE_CHECKING:
    from kata.device.config import StationConfig


def max_cycle_hz(config: "StationConfig") -> float:
    """Return the cycles a second at which the bus would never be idle."""
    return 1e9 / cycle_time_ns(config)


def cycle_time_ns(config: "StationConfig") -> float:
    """Return the time of one cycle on the station's bus."""
    if config.protocol == "dynamixel":
        return dynamixel.cycle_time_ns(config)
    return modbus.cycle_time_ns(config)
