"""Calculates the time of one cycle with Modbus drives."""

from typing import TYPE_CHECKING, Final

from kata.device.bus.timing import BITS_A_BYTE

if TYPE_CHECKING:
    from kata.device.config import StationConfig

_SILENCE_BITS_A_CHARACTER: Final = 11
"""Bits in each character of the silence that ends a Modbus frame, according to the specification."""
_INPUTS_BYTES: Final = 8 + 6
_READ_BYTES: Final = 8 + 5
"""Bytes of a read request and its answer, without the two bytes for each register read."""
_WRITE_BYTES: Final = 13 + 8
_BOTH_BYTES: Final = 17 + 5
"""Bytes of function 23 and its answer, without the two bytes for each register read."""


def cycle_time_ns(config: "StationConfig") -> float:
    """Return the time of one cycle's bytes, setpoints included, and of the silences and delays between them."""
    byte_ns = BITS_A_BYTE * 1e9 / config.baud
    delay_ns = config.return_delay_us * 1e3
    drives, registers = len(config.axes), 2 * config.modbus.block_registers
    exchanges = 1 + drives if config.modbus.function_23 else 1 + 2 * drives
    both = _BOTH_BYTES if config.modbus.function_23 else _READ_BYTES + _WRITE_BYTES
    # A silence must follow the request, and another silence the answer, before the next request may begin.
    apart_ns = 2 * silence_ns(config) + delay_ns
    verified_registers = max((span.stop - span.start for span in config.modbus.verified_spans), default=0)
    verification = _READ_BYTES + 2 * verified_registers if verified_registers else 0
    bytes_of_all = _INPUTS_BYTES + drives * (both + registers) + verification
    return bytes_of_all * byte_ns + (exchanges + bool(verification)) * apart_ns


def silence_ns(config: "StationConfig") -> float:
    """Return the duration of the silence that ends a Modbus frame."""
    return config.modbus.silence_characters * _SILENCE_BITS_A_CHARACTER * 1e9 / config.baud
