"""Calculates the time of one cycle with Dynamixel drives."""

from typing import TYPE_CHECKING, Final

from kata.device.bus.timing import BITS_A_BYTE

if TYPE_CHECKING:
    from kata.device.config import StationConfig

_BYTES: Final = 39 + 19 + 5 * 24 + 14 + 51 + 14 + 22
"""Bytes of a cycle without the port data: Sync Write of five goals, Sync Read of current, velocity and position, Read of the
status registers, Read of the ports. The answer to a Read has 11 bytes. The lengths that distinguish answers cost on average 3 bytes for each drive and 11 for the ports.
"""
_PORT_BYTES: Final = 2
_ANSWERS: Final = 7


def cycle_time_ns(config: "StationConfig") -> float:
    """Return the time of one cycle's bytes, setpoints included, and of the drives' delays."""
    byte_ns = BITS_A_BYTE * 1e9 / config.baud
    delay_ns = config.return_delay_us * 1e3
    ports = config.inputs.ports
    contacts = _PORT_BYTES * (max(ports) - min(ports) + 1)
    return (_BYTES + contacts) * byte_ns + _ANSWERS * delay_ns
