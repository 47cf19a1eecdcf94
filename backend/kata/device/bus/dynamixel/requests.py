"""Requests to Dynamixel drives: sends a request and collects its answers within a time limit."""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from kata.device import texts
from kata.device.bus.dynamixel.bandwidth import cycle_time_ns
from kata.device.bus.dynamixel.packets import BROADCAST, OVERHEAD, FastParser, StatusParser, encode, encode_cached
from kata.device.bus.dynamixel.registers import Register
from kata.device.bus.interface import BusError
from kata.device.bus.poll_backoff import PollBackoff
from kata.device.bus.serial_transport import Transport
from kata.device.bus.timing import BITS_A_BYTE
from kata.device.config import StationConfig

_MAX_SLACK_NS: Final = 8_000_000
"""Maximum time for adapter, driver and scheduler in one cycle, in addition to the transmission time. The slack is the rest of
the cycle after transmission, less this reserve for the rest of the loop's work:
"""
_RESERVE_NS: Final = 1_500_000
_MIN_SLACK_NS: Final = 500_000
_SLACK_SHARE: Final = 0.4
"""The slack is at least this share of the cycle, but this minimum never exceeds the following time:"""
_SHORT_SLACK_NS: Final = 4_000_000
_LATENCY_MARGIN_NS: Final = 1_000_000
_LATENCY_DECAY: Final = 64
"""Number of answers in which the influence of one measured latency falls to 1/e."""
_EARLIEST_SHARE: Final = 0.8
"""Share of the transmission time. An answer that arrives earlier belongs to an earlier request."""
ALERT: Final = 0x80
"""Bit of the error byte: the drive reports a hardware error in register 70. The answer itself is valid."""
SYNC_WRITE: Final = 0x83
_PING: Final = 0x01
_READ: Final = 0x02
_WRITE: Final = 0x03


OnReply = Callable[[int, int, int, bytes], None]
"""Callback that receives drive id, time, error byte and data of an answer."""


@dataclass
class Replies:
    """The answers to one request."""

    of: dict[int, tuple[int, int, bytes]] = field(default_factory=dict)
    """Time, error byte and data by drive id."""
    corrupt: bool = False
    """True if bytes arrived that are not a valid answer."""


class DynamixelRequests:
    """Sends requests to the drives and collects their answers, within the time of their bytes and a slack."""

    def __init__(self, config: StationConfig, open_transport: Callable[[str, int], Transport]) -> None:
        """Prepare the requests without opening the port. ``open_transport`` opens a port at a baud rate."""
        self._config = config
        self._open_transport = open_transport
        self._byte_ns = BITS_A_BYTE * 1_000_000_000 // config.baud
        self._delay_ns = config.return_delay_us * 1000
        period_ns = 1_000_000_000 // config.cycle_hz
        share_ns = min(_SHORT_SLACK_NS, int(_SLACK_SHARE * period_ns))
        self._slack_ns = min(_MAX_SLACK_NS, max(share_ns, int(period_ns - cycle_time_ns(config)) - _RESERVE_NS))
        self._doubtful_slack_ns = share_ns
        self._poll_slack_ns = max(share_ns // 2, min(_MAX_SLACK_NS, period_ns // 2 - 2 * _RESERVE_NS))
        self.latency_ns = 0
        """Delay of answers after the earliest time at which their bytes can have passed: a slowly decaying maximum."""
        self._ids = [axis.id for axis in config.axes]
        self._slack_left_ns = 0
        """Slack left in this cycle. A late answer uses up the slack of the later answers. A cycle is therefore late by at most
        one slack.
        """
        self._transport: Transport | None = None
        self._backoff = PollBackoff(self._ids, self._config)
        self._busy_until_ns = 0
        self.errors = 0
        """Missing and damaged answers since the start."""

    def close(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        if self._transport:
            self._transport.close()
            self._transport = None

    def _register(self, motor: int, drive_id: int, register: Register) -> bytes:
        self._slack_left_ns = self._slack_ns
        read = self._read_registers(drive_id, register.address, len(register.data), ignore_backoff=True)
        if read is None:
            raise BusError(texts.DRIVE_DOES_NOT_ANSWER(motor=motor, drive_id=drive_id))
        return read[1]

    def _require_one_drive(self, motor: int, drive_id: int) -> None:
        """Require exactly one drive at the id. If two drives share the id, send no other request to it."""
        answers, damaged = self._ping(drive_id)
        if answers > 1:
            # One of the answers may belong to an earlier request. Two drives would again send two answers.
            answers, damaged = self._ping(drive_id)
        if answers > 1:
            raise BusError(texts.DRIVES_SHARE_ID(drive_id=drive_id, motor=motor))
        if not answers:
            problem = texts.DRIVE_ANSWERS_DAMAGED if damaged else texts.DRIVE_DOES_NOT_ANSWER
            raise BusError(problem(motor=motor, drive_id=drive_id))

    def _ping(self, drive_id: int) -> tuple[int, bool]:
        """Return the number of valid answers, and whether other bytes arrived."""
        transport = self._require_transport()
        out_ns = self._send(encode(drive_id, _PING))
        parser = StatusParser()
        deadline_ns = out_ns + self._span_ns([OVERHEAD + 3] * 2) + self._slack_ns
        answers = 0
        while data := transport.receive(out_ns, deadline_ns):
            answers += sum(1 for answered, _, _ in parser.feed(data) if answered == drive_id)
        return answers, parser.skipped + parser.pending > 0

    def _write(self, motor: int, drive_id: int, address: int, data: bytes) -> None:
        self._slack_left_ns = self._slack_ns
        request = encode(drive_id, _WRITE, struct.pack("<H", address) + data)
        status = self._transact(request, [drive_id], StatusParser(), 0).of
        if drive_id not in status:
            raise BusError(texts.DRIVE_DOES_NOT_ANSWER(motor=motor, drive_id=drive_id))
        error = status[drive_id][1] & ~ALERT
        if error:
            raise BusError(texts.DRIVE_REGISTER_REFUSED(motor=motor, drive_id=drive_id, register=address, error=error))

    def _sync_write(self, address: int, values: Sequence[bytes]) -> int:
        """Send a Sync Write. Return the earliest time at which its last byte is out."""
        data = b"".join(bytes([drive_id]) + value for drive_id, value in zip(self._ids, values, strict=True))
        return self._send(encode(BROADCAST, SYNC_WRITE, struct.pack("<HH", address, len(values[0])) + data))

    def _read_registers(
        self, drive_id: int, address: int, length: int, *, ignore_backoff: bool = False
    ) -> tuple[int, bytes] | None:
        """Return time and data; None without a valid answer, or if the backoff skips the drive (never with
        ``ignore_backoff``).
        """
        if not ignore_backoff and not self._backoff.should_poll(drive_id):
            return None
        request = encode_cached(drive_id, _READ, struct.pack("<HH", address, length))
        replies = self._transact(request, [drive_id], StatusParser(), length)
        return self._valid_replies(replies, [drive_id], length).get(drive_id)

    def _valid_replies(self, replies: Replies, asked: Sequence[int], length: int) -> dict[int, tuple[int, bytes]]:
        """Return time and data of each drive that answered with ``length`` bytes and no error."""
        sound = {
            drive_id: (t_ns, data)
            for drive_id, (t_ns, error, data) in replies.of.items()
            if not error & ~ALERT and len(data) == length
        }
        self.errors += len(asked) - len(sound)
        return sound

    def _transact(
        self,
        request: bytes,
        asked: Sequence[int],
        parser: StatusParser | FastParser,
        length: int,
        on_reply: OnReply | None = None,
    ) -> Replies:
        """Send a request and collect the answers with ``length`` bytes of data until all have arrived or the time limit passes.

        ``on_reply`` receives each answer when it arrives.
        """
        sizes = parser.sizes(len(asked), length)
        transport = self._require_transport()
        sent_ns = transport.now_ns()
        out_ns = self._send(request)
        earliest_ns = out_ns + self._span_ns(sizes)
        patience_ns = self.latency_ns + _LATENCY_MARGIN_NS if self.latency_ns > _MIN_SLACK_NS else _MIN_SLACK_NS
        deadline_ns = earliest_ns + max(self._slack_left_ns, patience_ns)
        answering = sum(1 for drive_id in asked if not self._backoff.missed(drive_id))
        # Do not wait the whole slack for a drive that missed its last poll. If all drives missed it, the computer was late: wait.
        one_answers = self._backoff.one_answers
        doubtful_ns = earliest_ns + max(self._doubtful_slack_ns, patience_ns)
        first_ns = sent_ns + int(_EARLIEST_SHARE * (out_ns + self._span_ns(sizes[:1]) - sent_ns))
        each_ns = self._delay_ns + sizes[-1] * self._byte_ns
        # Time at which the first answer's bytes have passed. The clock is read after sending, so this time is never too early.
        through_ns = max(out_ns, transport.now_ns() + len(request) * self._byte_ns) + self._span_ns(sizes[:1])
        replies, late_ns = Replies(), 0
        while len(replies.of) < len(asked):
            enough = one_answers and len(replies.of) >= answering
            data = transport.receive(earliest_ns, min(deadline_ns, doubtful_ns) if enough else deadline_ns)
            if not data:
                break
            t_ns = transport.now_ns()
            # An answer that is too early or has another length belongs to an earlier request.
            found = [
                reply
                for reply in parser.feed(data)
                if reply[0] in asked and (len(reply[2]) == length or reply[1] & ~ALERT)
            ]
            if t_ns < first_ns:
                continue
            # One chunk may contain several answers. Each left the wire earlier than the next answer by the time of the next
            # answer's bytes. No answer is later than its bytes could pass, however late the computer delivers it.
            for (drive_id, error, payload), after in zip(reversed(found), range(len(found)), strict=True):
                came_ns = min(t_ns - after * each_ns, through_ns + asked.index(drive_id) * each_ns)
                replies.of[drive_id] = (came_ns, error, payload)
                if on_reply:
                    on_reply(drive_id, came_ns, error, payload)
            if found:
                # Measured also if some drives did not answer, so that a late drive is not taken for silent next time.
                late_ns = max(0, t_ns - earliest_ns)
        self._slack_left_ns -= max(0, transport.now_ns() - earliest_ns)
        if replies.of:
            self.latency_ns = max(late_ns, self.latency_ns - self.latency_ns // _LATENCY_DECAY)
        replies.corrupt = len(replies.of) < len(asked) and parser.skipped + parser.pending > 0
        return replies

    def _send(self, packet: bytes) -> int:
        """Send a packet. Return the earliest time at which its last byte is out, after the packets before it."""
        transport = self._require_transport()
        # Read the clock before sending: if this thread is suspended while sending, a later time would make an answer
        # look too early.
        self._busy_until_ns = max(self._busy_until_ns, transport.now_ns()) + len(packet) * self._byte_ns
        transport.send(packet)
        return self._busy_until_ns

    def _span_ns(self, sizes: Sequence[int]) -> int:
        """Return the time that answers of these sizes take on the wire, with the drives' delay before each."""
        return sum(sizes) * self._byte_ns + len(sizes) * self._delay_ns

    def _require_transport(self) -> Transport:
        if self._transport is None:
            raise BusError(texts.PORT_NOT_OPEN(port=self._config.port))
        return self._transport
