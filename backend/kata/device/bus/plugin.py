"""Defines the declaration of a driver package. docs/how-to/write-a-driver.md explains how to write a driver."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import msgspec

if TYPE_CHECKING:
    from kata.device.bus.interface import Bus
    from kata.device.bus.serial_transport import Transport
    from kata.device.config import StationConfig
    from kata.device.config_rules import FieldRule, Range

ENTRY_POINTS: Final = "kata.drivers"
"""Group of the entry points that name drivers. An entry point's name is the ``protocol`` in a station's file."""


def _at_once(config: "StationConfig") -> float:
    """Return 0, because a setpoint is sent as soon as it is written."""
    return 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """Declares one driver. The package's entry point names an instance of this class."""

    make_bus: "Callable[[StationConfig, Callable[[str, int], Transport]], Bus]"
    """Makes the driver for a station. The second argument opens a port at a baud rate; the port is not open yet."""
    cycle_time_ns: "Callable[[StationConfig], float]"
    """Returns the time in ns of one cycle's bytes, setpoints included, and of the drives' delays. The configuration refuses a
    cycle rate that the bus cannot carry.
    """
    setpoint_delay_s: "Callable[[StationConfig], float]" = _at_once
    """Returns the delay in s from writing a setpoint until it is sent to the drive. The path's lead compensates it."""
    ranges: "tuple[Range, ...]" = ()
    """Accepted values of the fields that depend on the protocol, and of the driver's own settings (``driver.NAME``)."""
    rules: "tuple[FieldRule, ...]" = ()
    """Rules between fields, in addition to the rules for every station."""
    settings: type[msgspec.Struct] | None = None
    """Type of the table ``[driver]`` in a station's file; None: the driver has no settings of its own."""
