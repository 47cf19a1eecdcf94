"""Requests to Modbus drives: sends a request and receives its answer within a time limit."""

import struct
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from typing import Final

from kata.device import texts
from kata.device.bus.interface import BusError
from kata.device.bus.modbus.bandwidth import silence_ns
from kata.device.bus.modbus.frames import EXCEPTION, EXCEPTION_BYTES, encode, find_answer
from kata.device.bus.serial_transport import Transport
from kata.device.bus.timing import BITS_A_BYTE
from kata.device.config import StationConfig

READ: Final = 0x03
WRITE: Final = 0x10
BROADCAST: Final = 0
_MAX_SLACK_NS: Final = 4_000_000
_MIN_SLACK_NS: Final = 500_000
_SLACK_SHARE: Final = 0.2
"""See the Dynamixel driver. The share is smaller because transmission on this slower bus takes more of a cycle."""
_TEST_LENGTHS: Final = 8
"""An overdue slave is tested with requests of so many different lengths in turn."""
_EARLIEST_SHARE: Final = 0.8
"""Share of the transmission time. An answer that arrives earlier belongs to an earlier request."""


@dataclass(frozen=True, slots=True)
class ModbusAnswer:
    """One answer with its time. ``data`` is None without a valid answer; ``corrupt`` then says whether bytes arrived."""

    t_ns: int
    data: bytes | None
    corrupt: bool
    exception: int = 0


def _tests(longest: int) -> Iterator[tuple[int, int]]:
    """Return pairs of lengths. A pair comes again after ``longest * (longest - 1)`` pairs."""
    return zip(cycle(range(1, longest + 1)), cycle(range(1, max(2, longest))), strict=False)


class ModbusRequests:
    """Sends requests to the drives and receives their answers, within the time of their bytes and a slack."""

    def __init__(self, config: StationConfig, open_transport: Callable[[str, int], Transport]) -> None:
        """Prepare the requests without opening the port. ``open_transport`` opens a port at a baud rate."""
        self._config = config
        self._open_transport = open_transport
        self._byte_ns = BITS_A_BYTE * 1_000_000_000 / config.baud
        self._silence_ns = int(silence_ns(config))
        self._delay_ns = config.return_delay_us * 1000
        self._slack_ns = min(_MAX_SLACK_NS, int(_SLACK_SHARE * 1e9 / config.cycle_hz))
        self._slack_left_ns = 0
        """Slack left in this cycle. A late answer uses up the slack of the later answers. A cycle is therefore late by at most
        one slack.
        """
        self._transport: Transport | None = None
        self._free_at_ns = 0
        self._overdue: set[int] = set()
        """Slaves that did not answer their last request. Their answer may still come."""
        longest = max(1, min(_TEST_LENGTHS, config.modbus.block_registers - 1))
        self._tests = defaultdict[int, Iterator[tuple[int, int]]](partial(_tests, longest))
        """For each slave: registers to read in two requests before the next request to an overdue slave, less than a block has."""
        self.errors = 0
        """Missing and damaged answers since the start."""

    @staticmethod
    def _written(register: int, data: bytes) -> bytes:
        return struct.pack(">HHB", register, len(data) // 2, len(data)) + data

    def close(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        if self._transport:
            self._transport.close()
            self._transport = None

    def _broadcast(self, register: int, value: int) -> None:
        frame = encode(BROADCAST, WRITE, self._written(register, struct.pack(">H", value)))
        self._wait_until_free()
        self._require_transport().send(frame)
        self._free_at_ns = self._require_transport().now_ns() + int(len(frame) * self._byte_ns) + self._silence_ns

    def _transact(self, slave: int, function: int, data: bytes, size: int) -> ModbusAnswer:
        """Send a request and wait for an answer of ``size`` bytes or an exception until the time limit.

        An answer does not identify its request. Before the next request to a slave that has not answered, a few registers are read twice, each
        time another pair of numbers. Answers keep their order: when both answers have come, every earlier one has passed.
        """
        if slave in self._overdue:
            for count in next(self._tests[slave]):
                where = struct.pack(">HH", self._config.modbus.block_start, count)
                test = self._exchange(slave, READ, where, 5 + 2 * count)
                if test.data is None and not test.exception:
                    return test
            self._overdue.remove(slave)
        answer = self._exchange(slave, function, data, size)
        if answer.data is None and not answer.exception:
            self._overdue.add(slave)
        return answer

    def _exchange(self, slave: int, function: int, data: bytes, size: int) -> ModbusAnswer:
        transport = self._require_transport()
        request = encode(slave, function, data)
        self._wait_until_free()
        # Read the clock before sending: if this thread is suspended while sending, a later time would make an answer
        # look too early.
        sent_ns = transport.now_ns()
        transport.send(request)
        asked_ns = int(len(request) * self._byte_ns) + self._silence_ns + self._delay_ns
        earliest_ns = sent_ns + asked_ns + int(size * self._byte_ns)
        deadline_ns = earliest_ns + max(self._slack_left_ns, _MIN_SLACK_NS)
        first_ns = sent_ns + int(_EARLIEST_SHARE * (asked_ns + EXCEPTION_BYTES * self._byte_ns))
        received = b""
        found: bytes | None = None
        while found is None and (chunk := transport.receive(earliest_ns, deadline_ns)):
            received += chunk
            found = find_answer(received, slave, function, size)
            if found is not None and transport.now_ns() < first_ns:
                # This answer belongs to an earlier request.
                received, found = b"", None
        now_ns = transport.now_ns()
        self._slack_left_ns -= max(0, now_ns - earliest_ns)
        self._free_at_ns = now_ns + self._silence_ns
        if found is None:
            self.errors += 1
            return ModbusAnswer(now_ns, None, bool(received))
        if found[0] & EXCEPTION:
            self.errors += 1
            return ModbusAnswer(now_ns, None, False, exception=found[1])
        # The answer's time is when its bytes passed, however late the computer delivers them.
        return ModbusAnswer(min(now_ns, earliest_ns), found[1:], False)

    def _wait_until_free(self) -> None:
        """Wait until the silence after the last frame is over."""
        transport = self._require_transport()
        while transport.now_ns() < self._free_at_ns:
            transport.receive(self._free_at_ns, self._free_at_ns)

    def _require_transport(self) -> Transport:
        if self._transport is None:
            raise BusError(texts.PORT_NOT_OPEN(port=self._config.port))
        return self._transport
