"""Modbus RTU from a slave's side of the line, after the Modbus application protocol 1.1b3 and the serial line guide 1.02.

Written apart from the device's own codec on purpose: two readings of one specification have to agree.
"""

from dataclasses import dataclass
from typing import Final

from fastcrc import crc16

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


def parse(heard: bytes) -> Request | None:
    """What was heard between two silences, if it is a sound frame."""
    if not _SHORTEST <= len(heard) <= LONGEST or crc16.modbus(heard[:-2]) != int.from_bytes(heard[-2:], "little"):
        return None
    return Request(heard[0], heard[1], heard[2:-2])


def frame(slave: int, function: int, data: bytes) -> bytes:
    """An answer, with its CRC."""
    body = bytes([slave, function]) + data
    return body + crc16.modbus(body).to_bytes(2, "little")


def exception(slave: int, function: int, code: int) -> bytes:
    """An answer that says why not."""
    return frame(slave, function | _EXCEPTION, bytes([code]))
