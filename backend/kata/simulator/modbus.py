"""Implements Modbus RTU on the slave's side, after the Modbus application protocol 1.1b3 and the serial line guide 1.02.

It is intentionally independent of the device's codec, so that each tests the other.
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

MAX_FRAME_BYTES: Final = 256
"""Longest frame in bytes."""
_MIN_FRAME_BYTES: Final = 4
_CHARACTER_BITS: Final = 11
_SILENT_CHARACTERS: Final = 3.5
"""A silence of this many characters ends a frame."""
_EXCEPTION: Final = 0x80


class RefusedError(Exception):
    """The request is refused; ``code`` is the exception code of the answer."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exception {code}")
        self.code = code


@dataclass(frozen=True)
class ModbusRequest:
    """One valid frame. ``data``: the bytes between the function code and the CRC."""

    slave: int
    function: int
    data: bytes


def silence_s(baud: int) -> float:
    """Return the duration in s of the silence that ends a frame."""
    return _SILENT_CHARACTERS * _CHARACTER_BITS / baud


def parse(received: bytes) -> ModbusRequest | None:
    """Return the frame between two silences, or None if it is not valid."""
    if not _MIN_FRAME_BYTES <= len(received) <= MAX_FRAME_BYTES or crc16.modbus(received[:-2]) != int.from_bytes(
        received[-2:], "little"
    ):
        return None
    return ModbusRequest(received[0], received[1], received[2:-2])


def frame(slave: int, function: int, data: bytes) -> bytes:
    """Return an answer with its CRC."""
    body = bytes([slave, function]) + data
    return body + crc16.modbus(body).to_bytes(2, "little")


def exception(slave: int, function: int, code: int) -> bytes:
    """Return an exception answer."""
    return frame(slave, function | _EXCEPTION, bytes([code]))
