"""Sends single requests to Dynamixel drives at one baud rate, without a station's configuration and its cycle."""

import struct
from dataclasses import dataclass
from typing import Final

from kata.device.bus.dynamixel.packets import BROADCAST, OVERHEAD, StatusParser, encode
from kata.device.bus.serial_transport import Transport
from kata.device.bus.timing import BITS_A_BYTE

_PING: Final = 0x01
_READ: Final = 0x02
_WRITE: Final = 0x03
_REBOOT: Final = 0x08
_ALERT: Final = 0x80
_ANSWER_TIMEOUT_NS: Final = 25_000_000
"""Time to wait for an answer in addition to its bytes: for the adapter's latency timer (16 ms by default) and the return delay."""
_SEARCH_NS: Final = 120_000_000
"""The answers to a broadcast ping end with a silence of this length."""
_PING_BYTES: Final = OVERHEAD + 3
_ATTEMPTS: Final = 5


@dataclass(frozen=True)
class FoundDrive:
    """A drive that answered a ping."""

    drive_id: int
    baud: int
    model: int
    firmware: int


class LineError(Exception):
    """A drive did not answer, or refused a write."""

    def __init__(self, drive_id: int, *, damaged: bool = False, error: int = 0) -> None:
        """``damaged``: True if bytes arrived, but no valid answer. ``error``: error of the drive's answer; 0 for none."""
        super().__init__(f"drive {drive_id}: {f'error {error}' if error else 'damaged' if damaged else 'silent'}")
        self.damaged = damaged


class DriveLine:
    """An open port at one baud rate."""

    def __init__(self, transport: Transport, baud: int) -> None:
        """Prepare for requests. ``transport``: open at ``baud``."""
        self._transport = transport
        self._baud = baud
        self._byte_ns = BITS_A_BYTE * 1_000_000_000 // baud
        self.requests = 0
        self.damaged = 0
        """Number of requests whose answer was damaged or came with other bytes."""
        self.latencies_ns: list[int] = []
        """Time of each answer beyond the transmission time of request and answer at this baud rate."""

    def find(self) -> dict[int, FoundDrive]:
        """Return every drive that answers at this baud rate, by id. Drives that share an id damage each other's answer."""
        answers, _ = self._exchange(encode(BROADCAST, _PING), _SEARCH_NS, size=_PING_BYTES)
        return {
            drive_id: FoundDrive(drive_id, self._baud, int.from_bytes(data[:2], "little"), data[2])
            for drive_id, error, data in answers
            if len(data) == 3
        }

    def read(self, drive_id: int, address: int, length: int) -> bytes:
        """Return the contents of registers.

        :raises LineError: when no valid answer comes in several attempts.
        """
        damaged = False
        for _ in range(_ATTEMPTS):
            data, other_bytes = self.read_once(drive_id, address, length)
            damaged |= other_bytes
            if data is not None:
                return data
        raise LineError(drive_id, damaged=damaged)

    def read_once(self, drive_id: int, address: int, length: int) -> tuple[bytes | None, bool]:
        """Return the contents of registers (None without a valid answer), and whether other bytes arrived."""
        request = encode(drive_id, _READ, struct.pack("<HH", address, length))
        answers, other_bytes = self._exchange(
            request, _ANSWER_TIMEOUT_NS, size=OVERHEAD + length, expected=(drive_id, length)
        )
        valid = [data for sender, error, data in answers if sender == drive_id and len(data) == length]
        return (valid[0] if valid else None), other_bytes

    def write(self, drive_id: int, address: int, data: bytes) -> None:
        """Write registers.

        :raises LineError: when the drive does not answer or refuses the write.
        """
        request = encode(drive_id, _WRITE, struct.pack("<H", address) + data)
        damaged = False
        for _ in range(_ATTEMPTS):
            answers, other_bytes = self._exchange(request, _ANSWER_TIMEOUT_NS, size=OVERHEAD, expected=(drive_id, 0))
            damaged |= other_bytes
            if refused := [error & ~_ALERT for sender, error, _ in answers if sender == drive_id]:
                if refused[0]:
                    raise LineError(drive_id, error=refused[0])
                return
        raise LineError(drive_id, damaged=damaged)

    def reboot(self, drive_id: int) -> None:
        """Restart a drive: torque off, RAM at its defaults."""
        self._exchange(encode(drive_id, _REBOOT), _ANSWER_TIMEOUT_NS, size=OVERHEAD, expected=(drive_id, 0))

    def _exchange(
        self, request: bytes, patience_ns: int, *, size: int, expected: tuple[int, int] | None = None
    ) -> tuple[list[tuple[int, int, bytes]], bool]:
        """Send a request. Return the answers, and whether other bytes arrived.

        :param size: number of bytes of an answer.
        :param expected: id and length of the only answer; None: several answers may come, each within ``patience_ns`` after the one before.
        """
        transport, parser = self._transport, StatusParser()
        earliest_ns = transport.now_ns() + (len(request) + size) * self._byte_ns
        transport.send(request)
        answers: list[tuple[int, int, bytes]] = []
        deadline_ns = earliest_ns + patience_ns
        complete = False
        while not complete and (data := transport.receive(earliest_ns, deadline_ns)):
            now_ns = transport.now_ns()
            answers += parser.feed(data)
            if expected is None:
                deadline_ns = now_ns + patience_ns
            complete = expected is not None and any(
                (drive_id, len(data)) == expected or error & ~_ALERT for drive_id, error, data in answers
            )
        if complete:
            self.latencies_ns.append(max(0, transport.now_ns() - earliest_ns))
        other_bytes = parser.skipped + parser.pending > 0
        self.requests += 1
        self.damaged += other_bytes
        return answers, other_bytes
