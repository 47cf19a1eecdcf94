"""How many cycles a second a bus can carry, computed from the bytes of one cycle. A higher rate is refused."""

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from kata.device.config import StationConfig

BITS_A_BYTE: Final = 10
_SILENCE_BITS_A_CHARACTER: Final = 11
"""Bits in each character of the silence that ends a Modbus frame, according to the specification."""

_DYNAMIXEL_BYTES: Final = 39 + 19 + 5 * 22 + 14 + 51 + 14 + 18
"""Sync Write of five goals; Sync Read of current, velocity and position; Read of the status registers and of the ports:
11 bytes and on average 7 that distinguish its answer from others.
"""
_DYNAMIXEL_PORT_BYTES: Final = 2
_DYNAMIXEL_ANSWERS: Final = 7
_MODBUS_INPUTS_BYTES: Final = 8 + 6
_MODBUS_READ_BYTES: Final = 8 + 5
"""Without the two bytes for each register read."""
_MODBUS_WRITE_BYTES: Final = 13 + 8
_MODBUS_BOTH_BYTES: Final = 17 + 5
"""Function 23, without the two bytes for each register read."""


def max_cycle_hz(config: "StationConfig") -> float:
    """Return the cycles a second at which the bus would never be idle."""
    return 1e9 / cycle_time_ns(config)


def cycle_time_ns(config: "StationConfig") -> float:
    """Return the time of one cycle's bytes, setpoints included, and of the silences and delays between them."""
    byte_ns = BITS_A_BYTE * 1e9 / config.baud
    delay_ns = config.return_delay_us * 1e3
    if config.protocol == "dynamixel":
        ports = config.inputs.ports
        contacts = _DYNAMIXEL_PORT_BYTES * (max(ports) - min(ports) + 1)
        return (_DYNAMIXEL_BYTES + contacts) * byte_ns + _DYNAMIXEL_ANSWERS * delay_ns
    drives, registers = len(config.axes), 2 * config.modbus.block_registers
    exchanges = 1 + drives if config.modbus.function_23 else 1 + 2 * drives
    both = _MODBUS_BOTH_BYTES if config.modbus.function_23 else _MODBUS_READ_BYTES + _MODBUS_WRITE_BYTES
    # A silence ends the request, and another one the answer, before the next request may begin.
    apart_ns = 2 * silence_ns(config) + delay_ns
    verified_registers = max((span.stop - span.start for span in config.modbus.verified_spans), default=0)
    verification = _MODBUS_READ_BYTES + 2 * verified_registers if verified_registers else 0
    bytes_of_all = _MODBUS_INPUTS_BYTES + drives * (both + registers) + verification
    return bytes_of_all * byte_ns + (exchanges + bool(verification)) * apart_ns


def silence_ns(config: "StationConfig") -> float:
    """Return the silence that ends a Modbus frame."""
    return config.modbus.silence_characters * _SILENCE_BITS_A_CHARACTER * 1e9 / config.baud
