"""What a driver package declares. docs/how-to/write-a-driver.md explains how to write one."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import msgspec

if TYPE_CHECKING:
    from kata.device.bus.port import Bus
    from kata.device.bus.serial_transport import Transport
    from kata.device.config import StationConfig
    from kata.device.config_rules import FieldRule, Range

ENTRY_POINTS: Final = "kata.drivers"
"""Group of the entry points that name drivers. An entry point's name is the ``protocol`` in a station's file."""


def _at_once(config: "StationConfig") -> float:
    """Return 0: a setpoint is on the wire when it has been written."""
    return 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """One driver. Its entry point names an instance."""

    make_bus: "Callable[[StationConfig, Callable[[str, int], Transport]], Bus]"
    """Makes the driver for a station. The second argument opens a port at a baud rate; the port is not open yet."""
    cycle_time_ns: "Callable[[StationConfig], float]"
    """Returns the time of one cycle's bytes and of the drives' delays, setpoints included, in ns. A rate that the bus cannot
    carry is refused.
    """
    setpoint_delay_s: "Callable[[StationConfig], float]" = _at_once
    """Returns the delay between writing a setpoint and its way to the drive, in s. The path's lead compensates it."""
    ranges: "tuple[Range, ...]" = ()
    """Accepted values of the fields that depend on the protocol, and of the driver's own settings (``driver.NAME``)."""
    rules: "tuple[FieldRule, ...]" = ()
    """What must hold between fields, beside the rules for every station."""
    settings: type[msgspec.Struct] | None = None
    """Type of the table ``[driver]`` in a station's file; None: the driver has no settings of its own."""
