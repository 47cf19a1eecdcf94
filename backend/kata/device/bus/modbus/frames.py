"""Frames of Modbus RTU: encoding requests and finding answers."""

import struct
from typing import Final

from fastcrc import crc16

EXCEPTION: Final = 0x80
EXCEPTION_BYTES: Final = 5


def encode(slave: int, function: int, data: bytes) -> bytes:
    """Return one frame with its CRC, low byte first."""
    frame = bytes([slave, function]) + data
    return frame + struct.pack("<H", crc16.modbus(frame))


def find_answer(received: bytes, slave: int, function: int, size: int) -> bytes | None:
    """Find a valid answer of ``size`` bytes, or a valid exception, after any noise or echo of the request.

    :returns: the answer from the function byte to the last byte before the CRC; None if there is no valid answer.
    """
    for start in range(len(received) - EXCEPTION_BYTES + 1):
        if received[start] != slave or received[start + 1] & ~EXCEPTION != function:
            continue
        end = start + (EXCEPTION_BYTES if received[start + 1] & EXCEPTION else size)
        frame = received[start:end]
        if len(received) >= end and crc16.modbus(frame[:-2]) == int.from_bytes(frame[-2:], "little"):
            return frame[1:-2]
    return None
