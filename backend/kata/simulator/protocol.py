"""Implements Dynamixel Protocol 2.0 on the drives' side, after the ROBOTIS e-manual.

It is intentionally independent of the device's codec, so that each tests the other.
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
FACTORY_RESET: Final = 0x06
REBOOT: Final = 0x08
CLEAR: Final = 0x10
BACKUP: Final = 0x20
STATUS: Final = 0x55
SYNC_READ: Final = 0x82
SYNC_WRITE: Final = 0x83
FAST_SYNC_READ: Final = 0x8A
BULK_READ: Final = 0x92
BULK_WRITE: Final = 0x93
FAST_BULK_READ: Final = 0x9A

CLEAR_KEY: Final = bytes.fromhex("44 58 4c 22")
BACKUP_KEY: Final = b"CTRL"
"""Parameters that follow the option of Clear and of Control Table Backup."""

RESULT_FAIL: Final = 0x01
INSTRUCTION_ERROR: Final = 0x02
CRC_ERROR: Final = 0x03
DATA_RANGE_ERROR: Final = 0x04
DATA_LENGTH_ERROR: Final = 0x05
DATA_LIMIT_ERROR: Final = 0x06
ACCESS_ERROR: Final = 0x07
ALERT: Final = 0x80
"""Bit that is set in the error byte of every answer while a hardware error is present."""


@dataclass(frozen=True)
class Instruction:
    """One received packet. ``size``: its length in bytes; ``valid``: True if its CRC is correct."""

    drive_id: int
    code: int
    parameters: bytes
    size: int
    valid: bool


def stuff(body: bytes) -> bytes:
    """Insert a byte into each sequence that looks like a header."""
    return body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")


def unstuff(body: bytes) -> bytes:
    """Undo :func:`stuff`."""
    return body.replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


def status(drive_id: int, error: int, data: bytes = b"") -> bytes:
    """Return a drive's answer."""
    body = stuff(bytes([STATUS, error]) + data)
    packet = HEADER + bytes([drive_id]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16.umts(packet).to_bytes(2, "little")


def fast_blocks(answers: Sequence[tuple[int, int, bytes]], lengths: Sequence[int]) -> list[bytes]:
    """Return the parts that the drives add to the answer packet of a Fast Sync or Bulk Read. ``answers``: drive id, error, data, in order.

    The drives were asked for ``lengths`` bytes. The first drive sends the header. It contains the length of the packet even if some
    drives do not answer. Bytes are not stuffed. Each part ends with the CRC of all bytes so far.
    """
    size = 1 + sum(lengths) + 4 * len(lengths)
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
def _decode(packet: bytes) -> Instruction:
    """Decode a packet. Results are cached, because the same reads are sent repeatedly."""
    body = unstuff(packet[7:-2])
    valid = crc16.umts(packet[:-2]) == int.from_bytes(packet[-2:], "little")
    return Instruction(packet[4], body[0], body[1:], len(packet), valid)


class InstructionParser:
    """Assembles packets, valid or not, from received bytes, and skips noise between them."""

    def __init__(self) -> None:
        self._received = bytearray()

    def reset(self) -> None:
        """Discard an incomplete packet."""
        self._received.clear()

    def feed(self, data: bytes) -> Iterator[Instruction]:
        """Yield the packets that ``data`` completes."""
        received = self._received
        received += data
        while (start := received.find(HEADER)) >= 0:
            del received[:start]
            if len(received) < 7:
                return
            size = 7 + int.from_bytes(received[5:7], "little")
            if size < 10 or size > 1024:
                del received[:4]
                continue
            if len(received) < size:
                return
            instruction = _decode(bytes(received[:size]))
            del received[: size if instruction.valid else 4]
            yield instruction
        del received[: max(0, len(received) - 3)]
