"""How many cycles a second a bus can carry, computed from the bytes of one cycle. A higher rate is refused."""

from typing import TYPE_CHECKING

from kata.device.bus.registry import find_driver

if TYPE_CHECKING:
    from kata.device.config import StationConfig


def max_cycle_hz(config: "StationConfig") -> float:
    """Return the cycles a second at which the bus would never be idle."""
    return 1e9 / cycle_time_ns(config)


def cycle_time_ns(config: "StationConfig") -> float:
    """Return the time of one cycle on the station's bus."""
    return find_driver(config.protocol).cycle_time_ns(config)
