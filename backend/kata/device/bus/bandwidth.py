"""Calculates the highest cycle rate of a bus from the bytes of one cycle. The configuration refuses a higher rate."""

from typing import TYPE_CHECKING

from kata.device.bus.registry import find_driver

if TYPE_CHECKING:
    from kata.device.config import StationConfig


def max_cycle_hz(config: "StationConfig") -> float:
    """Return the cycle rate in Hz at which the bus would never be idle."""
    return 1e9 / cycle_time_ns(config)


def cycle_time_ns(config: "StationConfig") -> float:
    """Return the time of one cycle on the station's bus."""
    return find_driver(config.protocol).cycle_time_ns(config)
