"""Packets of Dynamixel Protocol 2.0: encoding instructions and parsing status packets."""

import struct
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

from fastcrc import crc16

HEADER: Final = b"\xff\xff\xfd\x00"
STATUS: Final = 0x55
BROADCAST: Final = 0xFE
OVERHEAD: Final = 11
"""Bytes of a status packet without data."""


def encode(drive_id: int, instruction: int, parameters: bytes = b"") -> bytes:
    """Return one instruction packet, stuffed and with its CRC: polynomial 0x8005, initial value 0, not reflected
    ("UMTS").
    """
    body = bytes([instruction]) + parameters
    body = body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    packet = HEADER + bytes([drive_id]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16.umts(packet).to_bytes(2, "little")


encode_cached: Final = lru_cache(maxsize=256)(encode)
"""Cached variant of :func:`encode` for read requests, which repeat."""


class StatusParser:
    """Parses received bytes into complete, valid status packets."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.skipped = 0
        """Number of bytes of noise and of packets with a wrong CRC. An echo of our own instructions is not counted."""

    def feed(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        """Yield ``(drive id, error byte, data)`` of each valid packet; drop invalid bytes."""
        buffer = self._buffer
        buffer += data
        while True:
            start = buffer.find(HEADER)
            if start < 0:
                self._skip(max(0, len(buffer) - 3))
                return
            self._skip(start)
            if len(buffer) < 7:
                return
            end = 7 + int.from_bytes(buffer[5:7], "little")
            if not 10 <= end <= 1024:
                self._skip(4)
                continue
            if len(buffer) < end:
                return
            packet = bytes(buffer[:end])
            if crc16.umts(packet[:-2]) != int.from_bytes(packet[-2:], "little"):
                self._skip(4)
                continue
            del buffer[:end]
            if packet[7] == STATUS and end >= OVERHEAD:
                yield packet[4], packet[8], packet[9:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")

    @staticmethod
    def sizes(answers: int, length: int) -> list[int]:
        """Return the sizes on the wire of ``answers`` answers, each with ``length`` bytes of data."""
        return [OVERHEAD + length] * answers

    @property
    def pending(self) -> int:
        """Number of received bytes that may be the beginning of a packet."""
        return len(self._buffer)

    def _skip(self, count: int) -> None:
        del self._buffer[:count]
        self.skipped += count


class SyncParser(StatusParser):
    """Parses the answers to a Sync Read, for which each drive sends a status packet.

    If another drive than the first one answers first, the answers belong to an earlier request with another order, and none is yielded.
    """

    def __init__(self, first: int | None, length: int) -> None:
        """Expect answers with ``length`` bytes of data. ``first``: id of the first drive; None if it may be silent."""
        super().__init__()
        self._first = first
        self._length = length
        self._other_order: bool | None = None
        """None until a drive has answered."""

    def feed(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        """See :class:`StatusParser`. An answer with another length does not count as the first one."""
        for reply in super().feed(data):
            if self._other_order is None and len(reply[2]) == self._length:
                self._other_order = self._first is not None and reply[0] != self._first
            if not self._other_order:
                yield reply


class FastParser:
    """Parses the common packet of a Fast Sync Read. Each drive adds error, id, data and a CRC of all bytes before."""

    def __init__(self, ids: Sequence[int], length: int) -> None:
        self._ids = ids
        self._length = length
        self._start = HEADER + bytes([BROADCAST]) + struct.pack("<H", 1 + len(ids) * (length + 4)) + bytes([STATUS])
        self._buffer = bytearray()
        self._done = 0
        self._crc = 0
        """CRC up to the last valid part. The CRC is continued, because restarting it would take longest for the last part, for
        which the loop waits.
        """
        self.skipped = 0

    def feed(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        """Yield ``(drive id, error byte, data)`` in the requested order; yield nothing after an invalid part."""
        buffer = self._buffer
        buffer += data
        start = buffer.find(self._start)
        if start < 0:
            spare = max(0, len(buffer) - len(self._start) + 1)
            del buffer[:spare]
            self.skipped += spare
            return
        del buffer[:start]
        self.skipped += start
        while self._done < len(self._ids):
            begin = len(self._start) + self._done * (self._length + 4)
            end = begin + self._length + 4
            if len(buffer) < end:
                return
            # Each CRC is part of the data of the next one.
            crc = crc16.umts(buffer[begin - 2 if self._done else 0 : end - 2], self._crc)
            if buffer[begin + 1] != self._ids[self._done] or crc != int.from_bytes(buffer[end - 2 : end], "little"):
                self.skipped += len(buffer) - begin
                del buffer[:]
                return
            self._done += 1
            self._crc = crc
            yield buffer[begin + 1], buffer[begin], bytes(buffer[begin + 2 : end - 2])

    @staticmethod
    def sizes(answers: int, length: int) -> list[int]:
        """Return the sizes on the wire of ``answers`` parts, each with ``length`` bytes of data. The first size includes the
        header.
        """
        return [8 + length + 4] + [length + 4] * (answers - 1)

    @property
    def pending(self) -> int:
        """Number of received bytes that may be the beginning of the packet or of its next part. Valid parts are not counted,
        because a drive may be silent after them.
        """
        if self._done == len(self._ids):
            return 0
        sound = len(self._start) + self._done * (self._length + 4) if self._done else 0
        return max(0, len(self._buffer) - sound)
