"""Modbus RTU from a slave's side of the line, after the Modbus application protocol 1.1b3 and the serial line guide 1.02.

Written apart from the device's own codec on purpose: two readings of one specification have to agree.
"""

from dataclasses import dataclass
from typing import Final

BROADCAST: Final = 0

READ_DISCRETE_INPUTS: Final = 0x02
READ_HOLDING_REGISTERS: Final = 0x03
WRITE_SINGLE_REGISTER: Final = 0x06
WRITE_MULTIPLE_REGISTERS: Final = 0x10
READ_WRITE_MULTIPLE_REGISTERS: Final = 0x17

ILLEGAL_FUNCTION: Final = 1
ILLEGAL_ADDRESS: Final = 2
ILLEGAL_VALUE: Final = 3
DEVICE_FAILURE: Final = 4

LONGEST: Final = 256
"""Bytes of a frame."""
_SHORTEST: Final = 4
_CHARACTER_BITS: Final = 11
_SILENT_CHARACTERS: Final = 3.5
"""So long a silence ends a frame."""
_EXCEPTION: Final = 0x80


class RefusedError(Exception):
    """What is asked cannot be; ``code`` is the exception code of the answer."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exception {code}")
        self.code = code


@dataclass(frozen=True)
class Request:
    """One sound frame. ``data`` is what follows the function code."""

    slave: int
    function: int
    data: bytes


def silence_s(baud: int) -> float:
    """How long the line must be silent for a frame to have ended."""
    return _SILENT_CHARACTERS * _CHARACTER_BITS / baud


def crc(data: bytes) -> int:
    """CRC-16 with polynomial x^16 + x^15 + x^2 + 1, least significant bit first, from all ones."""
    remainder = 0xFFFF
    for byte in data:
        remainder = (remainder >> 8) ^ _CRC_OF_BYTE[(remainder ^ byte) & 0xFF]
    return remainder


def _crc_of_byte(byte: int) -> int:
    for _ in range(8):
        byte = (byte >> 1) ^ (0xA001 if byte & 1 else 0)
    return byte


_CRC_OF_BYTE: Final = tuple(_crc_of_byte(byte) for byte in range(256))


def parse(heard: bytes) -> Request | None:
    """What was heard between two silences, if it is a sound frame."""
    if not _SHORTEST <= len(heard) <= LONGEST or crc(heard[:-2]) != int.from_bytes(heard[-2:], "little"):
        return None
    return Request(heard[0], heard[1], heard[2:-2])


def frame(slave: int, function: int, data: bytes) -> bytes:
    """An answer, with its CRC."""
    body = bytes([slave, function]) + data
    return body + crc(body).to_bytes(2, "little")


def exception(slave: int, function: int, code: int) -> bytes:
    """An answer that says why not."""
    return frame(slave, function | _EXCEPTION, bytes([code]))
