"""Driver for Dynamixel Protocol 2.0 with the control table of the XH540 (robotis e-manual).

Each cycle has three requests. A Sync Read reads current, velocity and position of all five drives (a Fast Sync Read if
the drives support it: one packet, a quarter fewer bytes). A Read reads the registers of one drive in turn. The last
Read reads the external ports, so that the emergency stop is the newest value. Setpoints and torque are sent as Sync
Writes, which no drive answers; the drives' registers show the resulting torque.

Every register that the configuration determines is verified (:mod:`kata.device.bus.registers`). The registers in the
status block are verified with each status. The others are read in a slow rotation that sometimes replaces a status, so
that no cycle becomes longer.

An answer does not identify its request. The driver therefore asks the drives for one more byte in every other cycle,
and asks the inputs for up to thirteen more bytes in rotation. An answer that arrives whole cycles late then has the
wrong length.
"""

import logging
import struct
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import cycle
from typing import Final

from fastcrc import crc16

from kata.device import texts
from kata.device.bus.poll_backoff import PollBackoff
from kata.device.bus.port import BusError, BusSample, DriveSample, DriveStatus, InputSample, input_sample
from kata.device.bus.registers import (
    AMPERE_PER_UNIT,
    BUS_WATCHDOG,
    DEG_PER_COUNT,
    EEPROM_BLOCKS,
    GOAL_POSITION,
    NM_PER_AMPERE,
    PORT_DATA,
    PORTS_BLOCK,
    PRESENT,
    STATUS_BLOCK,
    TORQUE_ENABLE,
    Register,
    configured_registers,
    nearest_turn,
    zero_count,
)
from kata.device.bus.serial_transport import Transport
from kata.device.bus.verification import Verification
from kata.device.ceiling import BITS_A_BYTE
from kata.device.config import Axis, StationConfig

log = logging.getLogger(__name__)

_HEADER: Final = b"\xff\xff\xfd\x00"
_PING: Final = 0x01
_READ: Final = 0x02
_WRITE: Final = 0x03
_STATUS: Final = 0x55
_SYNC_READ: Final = 0x82
_SYNC_WRITE: Final = 0x83
_FAST_SYNC_READ: Final = 0x8A
_BROADCAST: Final = 0xFE
_OVERHEAD: Final = 11
"""Bytes of a status packet without data."""
_MAX_SLACK_NS: Final = 4_000_000
"""Time for adapter, driver and scheduler, in addition to the transmission time; limited to this share of a cycle:"""
_MIN_SLACK_NS: Final = 500_000
_SLACK_SHARE: Final = 0.4
_PLAIN_READ_CYCLES: Final = 100
"""After a damaged Fast Sync Read, plain Sync Reads are used for this many cycles: one damaged part invalidates all
parts after it.
"""
_INPUT_ANSWER_LENGTHS: Final = 14
_EARLIEST_SHARE: Final = 0.8
"""Share of the transmission time. An answer that arrives earlier belongs to an earlier request."""

_STATUS_BYTES: Final = STATUS_BLOCK.stop - STATUS_BLOCK.start
_HARDWARE_ERROR_AT: Final = 70 - TORQUE_ENABLE
_WATCHDOG_AT: Final = BUS_WATCHDOG - TORQUE_ENABLE
_WATCHDOG_STEP_MS: Final = 20
_WATCHDOG_TRIPPED: Final = 0xFF
_ALERT: Final = 0x80
"""Bit of the error byte: the drive reports a hardware error in register 70. The answer itself is valid."""
_DEG_S_A_UNIT: Final = 0.229 * 6
_NO_TORQUE: Final = Register("torque enable", TORQUE_ENABLE, b"\0")
_ARMING_LIMIT_NS: Final = 5_000_000
"""The write that arms the watchdogs takes effect within this time; an earlier status may still show an unarmed
watchdog.
"""

_PRESENT_FORMAT: Final = struct.Struct("<hii")
_DRIVE_LENGTHS: Final = (_PRESENT_FORMAT.size, _PRESENT_FORMAT.size + 1)
_GOALS_TO: Final = struct.pack("<HH", GOAL_POSITION, 4)
"""Address and length of the goals in a Sync Write."""


def encode(drive_id: int, instruction: int, parameters: bytes = b"") -> bytes:
    """Return one instruction packet, stuffed and with its CRC: polynomial 0x8005, initial value 0, not reflected
    ("UMTS").
    """
    body = bytes([instruction]) + parameters
    body = body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    packet = _HEADER + bytes([drive_id]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16.umts(packet).to_bytes(2, "little")


_encode_cached: Final = lru_cache(maxsize=256)(encode)
"""For read requests, which repeat."""


class StatusParser:
    """Parses received bytes into complete, valid status packets."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.skipped = 0
        """Bytes of noise and of packets with a wrong CRC. An echo of our own instructions is not counted."""

    def feed(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        """Yield ``(drive id, error byte, data)`` of each valid packet; drop invalid bytes."""
        buffer = self._buffer
        buffer += data
        while True:
            start = buffer.find(_HEADER)
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
            if packet[7] == _STATUS and end >= _OVERHEAD:
                yield packet[4], packet[8], packet[9:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")

    @staticmethod
    def sizes(answers: int, length: int) -> list[int]:
        """Return the size on the wire of each of ``answers`` answers with ``length`` bytes of data."""
        return [_OVERHEAD + length] * answers

    @property
    def pending(self) -> int:
        """Bytes that may be the beginning of a packet."""
        return len(self._buffer)

    def _skip(self, count: int) -> None:
        del self._buffer[:count]
        self.skipped += count


class FastParser:
    """Parses the one packet of a Fast Sync Read: each drive adds error, id, data and a CRC of everything before."""

    def __init__(self, ids: Sequence[int], length: int) -> None:
        self._ids = ids
        self._length = length
        self._start = _HEADER + bytes([_BROADCAST]) + struct.pack("<H", 1 + len(ids) * (length + 4)) + bytes([_STATUS])
        self._buffer = bytearray()
        self._done = 0
        self._crc = 0
        """CRC up to the last part. Starting again for each part would take longest for the last part, when the loop
        waits for it.
        """
        self.skipped = 0

    def feed(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        """Yield ``(drive id, error byte, data)`` in the requested order; nothing after an invalid part."""
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
        """Return the size on the wire of each of ``answers`` parts with ``length`` bytes of data; the first includes
        the header.
        """
        return [8 + length + 4] + [length + 4] * (answers - 1)

    @property
    def pending(self) -> int:
        """Bytes that may be the beginning of the packet or of its next part. Valid parts are not counted: after them a
        drive is silent.
        """
        if self._done == len(self._ids):
            return 0
        sound = len(self._start) + self._done * (self._length + 4) if self._done else 0
        return max(0, len(self._buffer) - sound)


_OnReply = Callable[[int, int, int, bytes], None]
"""Receives drive id, time, error byte and data of an answer."""


@dataclass
class _Replies:
    """The answers to one request."""

    of: dict[int, tuple[int, int, bytes]] = field(default_factory=dict)
    """Time, error byte and data by drive id."""
    corrupt: bool = False
    """Bytes arrived that are not a valid answer."""


class DynamixelBus:
    """The :class:`~kata.device.bus.port.Bus` of five drives that speak Protocol 2.0."""

    def __init__(self, config: StationConfig, open_transport: Callable[[str, int], Transport]) -> None:
        """Prepare the driver without opening the port. ``open_transport`` opens a port at a baud rate."""
        self._config = config
        self._open_transport = open_transport
        self._byte_ns = BITS_A_BYTE * 1_000_000_000 // config.baud
        self._delay_ns = config.return_delay_us * 1000
        self._slack_ns = min(_MAX_SLACK_NS, int(_SLACK_SHARE * 1e9 / config.cycle_hz))
        self._ids = [axis.id for axis in config.axes]
        self._slack_left_ns = 0
        """Slack left in this cycle. A late answer uses the slack of the later ones, so that a cycle is late by one
        slack at most.
        """
        self._axes = {axis.id: axis for axis in config.axes}
        self._zeros = {axis.id: zero_count(axis) for axis in config.axes}
        """By drive id: the position that the drive reports at motor angle 0, whole turns included."""
        self._registers = [configured_registers(config, axis) for axis in config.axes]
        self._ports = (self._ids.index(config.inputs.drive_id), PORTS_BLOCK)
        """Drive and block that hold the modes of the input ports."""
        self._verification = Verification(len(self._ids), 1 + len(EEPROM_BLOCKS), config.cycle_hz, urgent=self._ports)
        self._armed_ns: int | None = None
        """When the bus watchdogs were armed; None while torque is off."""
        self._goals = struct.Struct("<" + "Bi" * len(config.axes))
        """Id and goal of each drive."""
        self._transport: Transport | None = None
        self._backoff = PollBackoff(self._ids, self._config)
        self._next_status = cycle(range(len(config.axes)))
        self._fast: bool | None = None
        """True if the drives support Fast Sync Read; None until it has been tried."""
        self._plain_cycles = 0
        self._extra_bytes = 0
        """Extra bytes requested in this cycle: 0 or 1."""
        # More lengths than the cycles in which an input is valid, and none that this drive's other answers have.
        lengths = [
            n for n in range(self._input_bytes, self._input_bytes + _INPUT_ANSWER_LENGTHS) if n not in _DRIVE_LENGTHS
        ]
        self._input_prefixes = cycle([n - self._input_bytes for n in lengths])
        self._busy_until_ns = 0
        self.errors = 0
        """Missing and damaged answers since the start."""

    def open(self) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        self._transport = self._open_transport(self._config.port, self._config.baud)
        self._backoff = PollBackoff(self._ids, self._config)
        self._busy_until_ns = 0
        self._armed_ns = None
        self._fast = None
        for n in range(len(self._ids)):
            self._verification.forget(n)

    def configure(self, axes: Collection[int]) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        for n in sorted(axes):
            self._verification.forget(n)
            self._configure(n + 1, self._config.axes[n], self._registers[n])

    def read(self) -> BusSample:
        """See :class:`~kata.device.bus.port.Bus`."""
        self._backoff.begin_cycle()
        self._extra_bytes = 1 - self._extra_bytes
        drives, corrupt, timed_out = self.read_drives()
        for n, drive in enumerate(drives):
            self._verification.heard(n, answered=drive is not None)
        if due := self._verification.next_read():
            self._verify(*due)
            statuses: tuple[DriveStatus, ...] = ()
        else:
            status = self._read_status(next(self._next_status))
            statuses = (status,) if status else ()
        return BusSample(drives, self._read_inputs(), statuses, corrupt, timed_out)

    def read_drives(self) -> tuple[tuple[DriveSample | None, ...], frozenset[int], frozenset[int]]:
        """Read position, speed and torque of all five drives. Return them with the axes whose answer was corrupt and
        those that timed out.
        """
        self._slack_left_ns = self._slack_ns
        asked = self._backoff.poll_order()
        fast = bool(self._fast) and not self._plain_cycles
        self._plain_cycles = max(0, self._plain_cycles - 1)
        found: dict[int, DriveSample] = {}
        replies = self._sync_read(asked, fast, lambda *answer: self._decode_drive(found, *answer))
        if fast and replies.corrupt:
            self._plain_cycles = _PLAIN_READ_CYCLES
        if self._fast is None and len(found) == len(self._ids):
            self._try_fast()
        self.errors += len(asked) - len(found)
        self._backoff.answered(asked, found.keys())
        drives = tuple([found.get(drive_id) for drive_id in self._ids])
        missing = frozenset([self._ids.index(drive_id) for drive_id in asked if drive_id not in found])
        return (drives, missing, frozenset()) if replies.corrupt else (drives, frozenset(), missing)

    def _try_fast(self) -> None:
        """Try Fast Sync Read once after opening, when every drive answers."""
        self._fast = bool(self._sync_read(self._ids, fast=True).of)
        if not self._fast:
            log.info("the drives do not support Fast Sync Read; using Sync Read")

    def read_inputs(self) -> InputSample | None:
        """See :class:`~kata.device.bus.port.Bus`."""
        self._slack_left_ns = self._slack_ns // 2
        return self._read_inputs()

    def write_setpoints(self, angles_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        goals: list[int] = []
        for (drive_id, axis), angle_deg in zip(self._axes.items(), angles_deg, strict=True):
            goals += drive_id, round(self._zeros[drive_id] + axis.direction * angle_deg / DEG_PER_COUNT)
        self._send(encode(_BROADCAST, _SYNC_WRITE, _GOALS_TO + self._goals.pack(*goals)))

    def torque_on(self, hold_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.port.Bus`. A tripped watchdog is cleared, because its fault was acknowledged."""
        self._sync_write(BUS_WATCHDOG, [b"\0"] * len(self._ids))
        self.write_setpoints(hold_deg)
        self._sync_write(TORQUE_ENABLE, [b"\1"] * len(self._ids))
        self._armed_ns = self._sync_write(BUS_WATCHDOG, [bytes([self._watchdog])] * len(self._ids))

    def torque_off(self) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        self._armed_ns = None
        self._sync_write(TORQUE_ENABLE, [b"\0"] * len(self._ids))

    @property
    def _watchdog(self) -> int:
        return self._config.bus_watchdog_ms // _WATCHDOG_STEP_MS

    def close(self) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        if self._transport:
            self._transport.close()
            self._transport = None

    # -- requests -------------------------------------------------------------------------------------------------

    def _sync_read(self, asked: Sequence[int], fast: bool, on_reply: _OnReply | None = None) -> _Replies:
        if not asked:
            return _Replies()
        size = _PRESENT_FORMAT.size + self._extra_bytes
        instruction = _FAST_SYNC_READ if fast else _SYNC_READ
        request = _encode_cached(_BROADCAST, instruction, struct.pack("<HH", PRESENT, size) + bytes(asked))
        return self._transact(request, asked, FastParser(asked, size) if fast else StatusParser(), size, on_reply)

    def _read_inputs(self) -> InputSample | None:
        """Return the state of the contacts. None also if the ports are not verified as inputs: their values mean
        nothing then.
        """
        inputs = self._config.inputs
        if not self._verification.block_matches(*self._ports):
            return None
        first = min(inputs.ports)
        length = self._input_bytes
        before = next(self._input_prefixes)
        read = self._read_registers(inputs.drive_id, PORT_DATA + 2 * first - before, before + length)
        if read is None:
            return None
        t_ns, data = read[0], read[1][before:]
        return input_sample(t_ns, inputs, {port: data[2 * (port - first)] == 0 for port in inputs.ports})

    @property
    def _input_bytes(self) -> int:
        ports = self._config.inputs.ports
        return 2 * (max(ports) - min(ports)) + 2

    def _decode_drive(self, found: dict[int, DriveSample], drive_id: int, t_ns: int, error: int, data: bytes) -> None:
        """Decode an answer as soon as it arrives: the next drive's answer is still on the wire."""
        if error & ~_ALERT:
            return
        axis = self._axes[drive_id]
        current, velocity, position = _PRESENT_FORMAT.unpack_from(data)
        if self._armed_ns is None:
            # A drive that lost power may have lost whole turns. With torque on the turn stays.
            self._zeros[drive_id] = zero_count(axis) - nearest_turn(axis, position)
        found[drive_id] = DriveSample(
            t_ns=t_ns,
            position_deg=axis.direction * (position - self._zeros[drive_id]) * DEG_PER_COUNT,
            speed_deg_s=axis.direction * velocity * _DEG_S_A_UNIT,
            torque_nm=axis.direction * current * AMPERE_PER_UNIT * NM_PER_AMPERE,
            alert=error & _ALERT != 0,
        )

    def _read_status(self, axis: int) -> DriveStatus | None:
        read = self._read_registers(self._ids[axis], TORQUE_ENABLE, _STATUS_BYTES)
        if read is None:
            return None
        t_ns, data = read
        self._compare(axis, 0, STATUS_BLOCK, data, self._watchdog_mismatch(t_ns, data))
        return DriveStatus(
            t_ns=t_ns,
            axis=axis,
            torque_on=data[0] != 0,
            hardware_error=data[_HARDWARE_ERROR_AT],
            watchdog_tripped=data[_WATCHDOG_AT] == _WATCHDOG_TRIPPED,
            verified=self._verification.verified(axis),
            mismatch=self._verification.mismatch(axis),
        )

    # -- verification -----------------------------------------------------------------------------------------------

    def _verify(self, axis: int, block: int) -> None:
        """Read one block of one drive's EEPROM and compare it with the configuration."""
        addresses = EEPROM_BLOCKS[block - 1]
        read = self._read_registers(self._ids[axis], addresses.start, len(addresses))
        if read:
            self._compare(axis, block, addresses, read[1])

    def _compare(self, axis: int, block: int, addresses: range, data: bytes, mismatch: str = "") -> None:
        for register in self._registers[axis]:
            at = register.address - addresses.start
            if register.address in addresses and data[at : at + len(register.data)] != register.data:
                mismatch = mismatch or register.name
        self._verification.found(axis, block, mismatch)

    def _watchdog_mismatch(self, t_ns: int, data: bytes) -> str:
        """Return the watchdog's name if a drive with torque has not armed it: no drive confirms the write that arms it."""
        armed = self._armed_ns is not None and t_ns > self._armed_ns + _ARMING_LIMIT_NS
        if not armed or not data[0] or data[_WATCHDOG_AT] in (self._watchdog, _WATCHDOG_TRIPPED):
            return ""
        return "bus watchdog"

    # -- configuration ------------------------------------------------------------------------------------------------

    def _configure(self, motor: int, axis: Axis, registers: Sequence[Register]) -> None:
        self._require_one_drive(motor, axis.id)
        model, *others = registers
        self._check_model(motor, axis, model)
        if self._register(motor, axis.id, _NO_TORQUE) != _NO_TORQUE.data:
            raise BusError(texts.DRIVE_HAS_TORQUE(motor=motor, drive_id=axis.id))
        self._write(motor, axis.id, BUS_WATCHDOG, b"\0")
        for register in others:
            # EEPROM is written only where it differs: its cells wear.
            if register.address >= TORQUE_ENABLE or self._register(motor, axis.id, register) != register.data:
                self._write(motor, axis.id, register.address, register.data)
            if self._register(motor, axis.id, register) != register.data:
                raise BusError(texts.DRIVE_SETTING_REFUSED(motor=motor, drive_id=axis.id, setting=register.name))

    def _check_model(self, motor: int, axis: Axis, model: Register) -> None:
        data = self._register(motor, axis.id, model)
        if data != model.data:
            number = int.from_bytes(data, "little")
            raise BusError(texts.DRIVE_OTHER_MODEL(motor=motor, drive_id=axis.id, model=number, wanted=axis.model))

    def _register(self, motor: int, drive_id: int, register: Register) -> bytes:
        self._slack_left_ns = self._slack_ns
        read = self._read_registers(drive_id, register.address, len(register.data), ignore_backoff=True)
        if read is None:
            raise BusError(texts.DRIVE_DOES_NOT_ANSWER(motor=motor, drive_id=drive_id))
        return read[1]

    def _require_one_drive(self, motor: int, drive_id: int) -> None:
        """Require exactly one drive at the id. At an id that two drives share, no other request is sent."""
        answers, damaged = self._ping(drive_id)
        if answers > 1:
            # One answer may belong to an earlier request. Two drives answer twice again.
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
        deadline_ns = out_ns + self._span_ns([_OVERHEAD + 3] * 2) + self._slack_ns
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
        error = status[drive_id][1] & ~_ALERT
        if error:
            raise BusError(texts.DRIVE_REGISTER_REFUSED(motor=motor, drive_id=drive_id, register=address, error=error))

    # -- packets --------------------------------------------------------------------------------------------------

    def _sync_write(self, address: int, values: Sequence[bytes]) -> int:
        """Send a Sync Write. Return the earliest time at which its last byte is out."""
        data = b"".join(bytes([drive_id]) + value for drive_id, value in zip(self._ids, values, strict=True))
        return self._send(encode(_BROADCAST, _SYNC_WRITE, struct.pack("<HH", address, len(values[0])) + data))

    def _read_registers(
        self, drive_id: int, address: int, length: int, *, ignore_backoff: bool = False
    ) -> tuple[int, bytes] | None:
        """Return time and data; None without a valid answer, or if the backoff skips the drive (never with
        ``ignore_backoff``).
        """
        if not ignore_backoff and not self._backoff.should_poll(drive_id):
            return None
        request = _encode_cached(drive_id, _READ, struct.pack("<HH", address, length))
        replies = self._transact(request, [drive_id], StatusParser(), length)
        return self._valid_replies(replies, [drive_id], length).get(drive_id)

    def _valid_replies(self, replies: _Replies, asked: Sequence[int], length: int) -> dict[int, tuple[int, bytes]]:
        """Return time and data of each drive that answered with ``length`` bytes and no error."""
        sound = {
            drive_id: (t_ns, data)
            for drive_id, (t_ns, error, data) in replies.of.items()
            if not error & ~_ALERT and len(data) == length
        }
        self.errors += len(asked) - len(sound)
        return sound

    def _transact(
        self,
        request: bytes,
        asked: Sequence[int],
        parser: StatusParser | FastParser,
        length: int,
        on_reply: _OnReply | None = None,
    ) -> _Replies:
        """Send a request and collect the answers with ``length`` bytes of data until all have arrived or the time is
        over.

        ``on_reply`` gets each answer when it arrives.
        """
        sizes = parser.sizes(len(asked), length)
        transport = self._require_transport()
        sent_ns = transport.now_ns()
        out_ns = self._send(request)
        earliest_ns = out_ns + self._span_ns(sizes)
        deadline_ns = earliest_ns + max(self._slack_left_ns, _MIN_SLACK_NS)
        first_ns = sent_ns + int(_EARLIEST_SHARE * (out_ns + self._span_ns(sizes[:1]) - sent_ns))
        each_ns = self._delay_ns + sizes[-1] * self._byte_ns
        # When the first answer's bytes have passed. The clock is read after sending, so this is never too early.
        through_ns = max(out_ns, transport.now_ns() + len(request) * self._byte_ns) + self._span_ns(sizes[:1])
        replies = _Replies()
        while len(replies.of) < len(asked):
            data = transport.receive(earliest_ns, deadline_ns)
            if not data:
                break
            t_ns = transport.now_ns()
            # Too early, or of another length: the answer to an earlier request.
            found = [
                one for one in parser.feed(data) if one[0] in asked and (len(one[2]) == length or one[1] & ~_ALERT)
            ]
            if t_ns < first_ns:
                continue
            # One chunk may contain several answers. Each left the wire before the next by the length of the next. No
            # answer left later than its bytes passed, however late the computer delivers it.
            for (drive_id, error, payload), after in zip(reversed(found), range(len(found)), strict=True):
                came_ns = min(t_ns - after * each_ns, through_ns + asked.index(drive_id) * each_ns)
                replies.of[drive_id] = (came_ns, error, payload)
                if on_reply:
                    on_reply(drive_id, came_ns, error, payload)
        self._slack_left_ns -= max(0, transport.now_ns() - earliest_ns)
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
