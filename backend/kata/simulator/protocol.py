"""Dynamixel Protocol 2.0 from the drives' side of the wire, after the robotis e-manual.

Written apart from the device's own codec on purpose: two readings of one specification have to agree.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from fastcrc import crc16

HEADER: Final = b"\xff\xff\xfd\x00"
BROADCAST: Final = 0xFE

PING: Final = 0x01
READ: Final = 0x02
WRITE: Final = 0x03
REG_WRITE: Final = 0x04
ACTION: Final = 0x05
REBOOT: Final = 0x08
STATUS: Final = 0x55
SYNC_READ: Final = 0x82
SYNC_WRITE: Final = 0x83
FAST_SYNC_READ: Final = 0x8A
BULK_READ: Final = 0x92
BULK_WRITE: Final = 0x93

INSTRUCTION_ERROR: Final = 0x02
CRC_ERROR: Final = 0x03
DATA_RANGE_ERROR: Final = 0x04
DATA_LENGTH_ERROR: Final = 0x05
DATA_LIMIT_ERROR: Final = 0x06
ACCESS_ERROR: Final = 0x07
ALERT: Final = 0x80
"""Joined to the error byte of every answer while a hardware error stands."""


@dataclass(frozen=True)
class Instruction:
    """One packet as a drive hears it. ``size`` is its length on the wire in bytes; ``sound`` whether its CRC holds."""

    drive_id: int
    code: int
    parameters: bytes
    size: int
    sound: bool


def stuff(body: bytes) -> bytes:
    """Break up what looks like a header."""
    return body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")


def unstuff(body: bytes) -> bytes:
    """Undo :func:`stuff`."""
    return body.replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


def status(drive_id: int, error: int, data: bytes = b"") -> bytes:
    """A drive's answer."""
    body = stuff(bytes([STATUS, error]) + data)
    packet = HEADER + bytes([drive_id]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16.umts(packet).to_bytes(2, "little")


def fast_blocks(answers: Sequence[tuple[int, int, bytes]], promised: int, length: int) -> list[bytes]:
    """A Fast Sync Read's one packet in the parts that each drive adds, from ``(drive id, error, data)`` in order.

    ``promised`` drives were asked for ``length`` bytes each: the header, which the first one sends, says so whether or
    not all of them answer. Nothing is stuffed; each part ends with the CRC of all bytes so far.
    """
    size = 1 + promised * (length + 4)
    sent = HEADER + bytes([BROADCAST]) + size.to_bytes(2, "little") + bytes([STATUS])
    blocks = []
    before = remainder = 0
    for drive_id, error, data in answers:
        unchecked = max(0, before - 2)
        sent += bytes([error, drive_id]) + data
        remainder = crc16.umts(sent[unchecked:], remainder)
        sent += remainder.to_bytes(2, "little")
        blocks.append(sent[before:])
        before = len(sent)
    return blocks


@lru_cache(maxsize=256)
def _understood(packet: bytes) -> Instruction:
    """Those that read are sent over and over."""
    body = unstuff(packet[7:-2])
    sound = crc16.umts(packet[:-2]) == int.from_bytes(packet[-2:], "little")
    return Instruction(packet[4], body[0], body[1:], len(packet), sound)


class InstructionParser:
    """Takes bytes as they come and gives whole packets, sound or not; noise between them is skipped."""

    def __init__(self) -> None:
        self._heard = bytearray()

    def forget(self) -> None:
        """Give up a packet that has only begun."""
        self._heard.clear()

    def feed(self, data: bytes) -> Iterator[Instruction]:
        """Packets completed by ``data``."""
        heard = self._heard
        heard += data
        while (start := heard.find(HEADER)) >= 0:
            del heard[:start]
            if len(heard) < 7:
                return
            size = 7 + int.from_bytes(heard[5:7], "little")
            if size < 10 or size > 1024:
                del heard[:4]
                continue
            if len(heard) < size:
                return
            instruction = _understood(bytes(heard[:size]))
            del heard[: size if instruction.sound else 4]
            yield instruction
        del heard[: max(0, len(heard) - 3)]
