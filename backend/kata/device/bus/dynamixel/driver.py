"""Driver for Dynamixel Protocol 2.0 with the control table of the X series (ROBOTIS e-Manual).

A cycle sends one request: a Fast Sync Read of a block of Indirect Data that contains the values of every drive and the inputs
(:mod:`kata.device.bus.dynamixel.cycle_block`). If the drives do not support it, a Sync Read replaces it. The drive with the
inputs answers first, so that no other drive can silence it. Setpoints and torque are sent as Sync Writes, which no drive
answers. The drives' registers show the resulting torque.

Opening a port writes nothing, and a drive that has restarted has no mapped block. Until the map of the block has been verified on
every drive that answers, a cycle reads the registers themselves with three requests: current, velocity and position of all
drives, the status of one drive in turn, and the ports.

Every register that the configuration determines is verified (:mod:`kata.device.bus.dynamixel.registers`). Registers in the
block are verified with each answer, the others in a slow rotation.

An answer does not identify its request. The driver therefore requests a different number of bytes in each cycle. An answer
that arrives whole cycles late then has the wrong length. When the registers themselves are read, four lengths and five orders of the drives
take turns: an answer of all drives is recognized up to twenty cycles late, that of a single drive up to four.
"""

import logging
import struct
from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import cycle
from typing import Final

from kata.device.bus.dynamixel.answers import DynamixelAnswers
from kata.device.bus.dynamixel.bandwidth import cycle_time_ns
from kata.device.bus.dynamixel.cycle_block import (
    INDIRECT_DATA,
    PRESENT_BYTES,
    CycleBlock,
    decode,
)
from kata.device.bus.dynamixel.packets import BROADCAST, FastParser, SyncParser, encode, encode_cached
from kata.device.bus.dynamixel.registers import (
    BLOCKS_WITH_STATUS,
    BUS_WATCHDOG,
    DEG_PER_COUNT,
    GOAL_POSITION,
    LENGTHS,
    PORT_DATA,
    PRESENT,
    ROTATION_BLOCKS,
    STATUS,
    STATUS_BLOCK,
    TORQUE_ENABLE,
)
from kata.device.bus.dynamixel.requests import ALERT, SYNC_WRITE, OnReply, Replies
from kata.device.bus.interface import BusSample, DriveHealth, DriveSample, DriveStatus, InputSample, input_sample
from kata.device.bus.plugin import Driver
from kata.device.bus.poll_backoff import PollBackoff
from kata.device.bus.serial_transport import Transport
from kata.device.config import StationConfig

log = logging.getLogger(__name__)

_SYNC_READ: Final = 0x82
_FAST_SYNC_READ: Final = 0x8A
_PLAIN_READ_CYCLES: Final = 100
"""Number of cycles with plain Sync Reads after a damaged Fast Sync Read, in which one damaged part invalidates all parts
after it.
"""
_INPUT_ANSWER_LENGTHS: Final = 17

_STATUS_BYTES: Final = STATUS_BLOCK.stop - STATUS_BLOCK.start

_DRIVE_LENGTHS: Final = range(PRESENT_BYTES, PRESENT_BYTES + 7)
"""Lengths of the answers with current, velocity and position, if the block is not read. The bytes after them are not used. An answer that is late
by as many reads has the same length. If another request took its first parts, its order does not tell it either.
"""
_GOALS_TO: Final = struct.pack("<HH", GOAL_POSITION, 4)
"""Address of the goal register and length of one goal, as encoded in a Sync Write."""


class DynamixelBus(DynamixelAnswers):
    """The :class:`~kata.device.bus.interface.Bus` of five drives that speak Protocol 2.0."""

    def __init__(self, config: StationConfig, open_transport: Callable[[str, int], Transport]) -> None:
        """Prepare the driver without opening the port. ``open_transport`` opens a port at a baud rate."""
        super().__init__(config, open_transport)
        self._goals = struct.Struct("<" + "Bi" * len(config.axes))
        """Format of the ids and goals of all drives."""
        self._next_status = cycle(range(len(config.axes)))
        self._fast: bool | None = None
        """True if the drives support Fast Sync Read; None until it has been tried."""
        self._plain_cycles = 0
        self._drive_reads = 0
        """Number of reads of the drives without their blocks. It determines length and order of the next one."""
        self._drives_turn = False
        """True if this cycle reads the drives. Used when a cycle has no time for three answers."""
        self._block_lengths = cycle(LENGTHS)
        # More lengths than the cycles for which an input stays valid. The lengths of this drive's other answers are excluded.
        input_lengths = [
            n for n in range(self._input_bytes, self._input_bytes + _INPUT_ANSWER_LENGTHS) if n not in _DRIVE_LENGTHS
        ]
        self._input_prefixes = cycle([n - self._input_bytes for n in input_lengths])

    def open(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._transport = self._open_transport(self._config.port, self._config.baud)
        self._backoff = PollBackoff(self._ids, self._config)
        self._busy_until_ns = 0
        self._armed_ns = None
        self._fast = None
        for n in range(len(self._ids)):
            self._verification.forget(n)

    def configure(self, axes: Collection[int]) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        for n in sorted(axes):
            self._verification.forget(n)
            self._configure(n + 1, self._config.axes[n], self._registers[n])

    def read(self) -> BusSample:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._backoff.begin_cycle()
        self._slack_left_ns = self._slack_ns
        asked = self._inputs_first(self._backoff.poll_order())
        if asked and all(self._is_mapped(self._ids.index(drive_id)) for drive_id in asked):
            return self._read_blocks(asked)
        return self._read_separately()

    # -- one request ------------------------------------------------------------------------------------------------

    def _inputs_first(self, asked: list[int]) -> list[int]:
        drive_id = self._config.inputs.drive_id
        if drive_id not in asked or self._backoff.missed(drive_id):
            return asked
        return [drive_id, *(other for other in asked if other != drive_id)]

    def _read_blocks(self, asked: list[int]) -> BusSample:
        """Read the block of each of these drives."""
        found: dict[int, DriveSample] = {}
        blocks: dict[int, CycleBlock] = {}
        statuses: dict[int, DriveStatus] = {}
        health: list[DriveHealth] = []

        def take(drive_id: int, t_ns: int, error: int, data: bytes) -> None:
            if error & ~ALERT:
                return
            blocks[drive_id] = block = decode(data)
            axis = self._ids.index(drive_id)
            if not block.marked:
                self._verification.forget(axis)
                return
            self._decode_drive(found, drive_id, t_ns, error, data)
            statuses[axis] = self._block_status(axis, t_ns, block, data)
            if reported := self._drive_health(axis, t_ns, data):
                health.append(reported)

        size = next(self._block_lengths)
        replies = self._read_drives(asked, INDIRECT_DATA, size, take)
        drives = self._record(asked, found, answered=blocks)
        inputs_id, inputs = self._config.inputs.drive_id, None
        if inputs_id in found:
            if self._inputs_are_verified:
                inputs = input_sample(found[inputs_id].t_ns, self._config.inputs, blocks[inputs_id].ports)
        elif inputs_id not in asked:
            inputs = self._read_inputs()
        if due := self._verification.next_read(replaces_status=False):
            self._verify(*due)
        read = tuple(statuses[n] for n in sorted(statuses))
        missing = self._missing(asked, blocks, corrupt=replies.corrupt)
        return BusSample(drives, inputs, read, *missing, tuple(health))

    # -- three requests ---------------------------------------------------------------------------------------------

    def _read_separately(self) -> BusSample:
        """Read drives, one status and the inputs. If three answers take longer than a cycle, drives and statuses are read in
        alternate cycles.
        """
        crowded = 3 * self.latency_ns > self._slack_ns
        self._drives_turn = not (crowded and self._drives_turn)
        drives: tuple[DriveSample | None, ...] = (None,) * len(self._ids)
        corrupt = timed_out = frozenset[int]()
        if self._drives_turn:
            drives, corrupt, timed_out = self.read_drives()
        statuses: tuple[DriveStatus, ...] = ()
        if not (crowded and self._drives_turn):
            if due := self._verification.next_read():
                self._verify(*due)
            else:
                status = self._read_status(self._next_status_axis())
                statuses = (status,) if status else ()
        return BusSample(drives, self._read_inputs(), statuses, corrupt, timed_out)

    def _next_status_axis(self) -> int:
        """Return the axis whose status is read next: an axis that has lost its marker if there is one, else each in turn."""
        lost = [n for n in range(len(self._ids)) if self._verification.is_unread(n, STATUS)]
        return lost[0] if lost else next(self._next_status)

    def read_drives(self) -> tuple[tuple[DriveSample | None, ...], frozenset[int], frozenset[int]]:
        """Read position, speed and torque of all five drives. Return them with the axes whose answer was corrupt and
        those that timed out.
        """
        self._slack_left_ns = self._slack_ns
        self._drive_reads += 1
        turns, n = divmod(self._drive_reads, len(_DRIVE_LENGTHS))
        asked, size = self._turned(self._backoff.poll_order(), turns), _DRIVE_LENGTHS[n]
        found: dict[int, DriveSample] = {}
        replies = self._read_drives(asked, PRESENT, size, lambda *answer: self._decode_drive(found, *answer))
        if self._fast is None and len(found) == len(self._ids):
            self._try_fast()
        drives = self._record(asked, found, answered=found)
        return drives, *self._missing(asked, found, corrupt=replies.corrupt)

    def _turned(self, asked: list[int], turns: int) -> list[int]:
        """Return the ids with the answering drives in another order."""
        answering = [drive_id for drive_id in asked if not self._backoff.missed(drive_id)]
        first = turns % max(1, len(answering))
        others = [drive_id for drive_id in asked if drive_id not in answering]
        return answering[first:] + answering[:first] + others

    def _missing(
        self, asked: Sequence[int], answered: Collection[int], *, corrupt: bool
    ) -> tuple[frozenset[int], frozenset[int]]:
        """Return two sets of axes that were asked and sent no valid answer: those with a corrupt answer, and those that timed
        out. One of them is empty.
        """
        missing = frozenset([self._ids.index(drive_id) for drive_id in asked if drive_id not in answered])
        return (missing, frozenset()) if corrupt else (frozenset(), missing)

    def _read_drives(self, asked: Sequence[int], address: int, size: int, on_reply: OnReply) -> Replies:
        """Read ``size`` bytes from ``address`` on from each of these drives."""
        fast = bool(self._fast) and not self._plain_cycles
        self._plain_cycles = max(0, self._plain_cycles - 1)
        replies = self._sync_read(asked, address, size, on_reply, fast=fast)
        if fast and replies.corrupt:
            self._plain_cycles = _PLAIN_READ_CYCLES
        return replies

    def _record(
        self, asked: list[int], found: Mapping[int, DriveSample], answered: Collection[int]
    ) -> tuple[DriveSample | None, ...]:
        """Record which drives answered; return the samples in axis order."""
        self.errors += sum(1 for drive_id in asked if drive_id not in answered)
        self._backoff.answered(asked, answered)
        drives = tuple([found.get(drive_id) for drive_id in self._ids])
        for n, drive in enumerate(drives):
            self._verification.heard(n, answered=drive is not None)
        return drives

    def _try_fast(self) -> None:
        """Test once after opening, when every drive answers, whether the drives support Fast Sync Read."""
        self._fast = bool(self._sync_read(self._ids, PRESENT, PRESENT_BYTES, None, fast=True).of)
        if not self._fast:
            log.info("the drives do not support Fast Sync Read; using Sync Read")

    def read_inputs(self) -> InputSample | None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._slack_left_ns = self._poll_slack_ns
        return self._read_inputs()

    def write_setpoints(self, angles_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        goals: list[int] = []
        for (drive_id, axis), angle_deg in zip(self._axes.items(), angles_deg, strict=True):
            goals += drive_id, round(self._zeros[drive_id] + axis.direction * angle_deg / DEG_PER_COUNT)
        self._send(encode(BROADCAST, SYNC_WRITE, _GOALS_TO + self._goals.pack(*goals)))

    def torque_on(self, hold_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.interface.Bus`. A tripped watchdog is cleared, because its fault was acknowledged."""
        self._sync_write(BUS_WATCHDOG, [b"\0"] * len(self._ids))
        self.write_setpoints(hold_deg)
        self._sync_write(TORQUE_ENABLE, [b"\1"] * len(self._ids))
        self._armed_ns = self._sync_write(BUS_WATCHDOG, [bytes([self._watchdog])] * len(self._ids))

    def torque_off(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._armed_ns = None
        self._sync_write(TORQUE_ENABLE, [b"\0"] * len(self._ids))

    # -- requests -------------------------------------------------------------------------------------------------

    def _sync_read(
        self, asked: Sequence[int], address: int, size: int, on_reply: OnReply | None, *, fast: bool
    ) -> Replies:
        if not asked:
            return Replies()
        instruction = _FAST_SYNC_READ if fast else _SYNC_READ
        request = encode_cached(BROADCAST, instruction, struct.pack("<HH", address, size) + bytes(asked))
        # The inputs' drive answers first in a block, and the other drives must be read although it is silent.
        known = not self._backoff.missed(asked[0]) or not self._backoff.one_answers
        first = asked[0] if address == PRESENT and known else None
        parser = FastParser(asked, size) if fast else SyncParser(first, size)
        return self._transact(request, asked, parser, size, on_reply)

    def _read_inputs(self) -> InputSample | None:
        """Return the state of the contacts; None without a valid answer or if the ports are not verified as inputs."""
        inputs = self._config.inputs
        if not self._inputs_are_verified:
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

    def _read_status(self, axis: int) -> DriveStatus | None:
        read = self._read_registers(self._ids[axis], TORQUE_ENABLE, _STATUS_BYTES)
        if read is None:
            return None
        return self._register_status(axis, *read)

    # -- verification -----------------------------------------------------------------------------------------------

    def _verify(self, axis: int, block: int) -> None:
        """Read one block of one drive's registers and compare it with the configuration."""
        addresses = ROTATION_BLOCKS[block - BLOCKS_WITH_STATUS]
        read = self._read_registers(self._ids[axis], addresses.start, len(addresses))
        if read:
            _, data = read
            self._note_limits(axis, block, data)
            self._compare(axis, block, lambda address: data[address - addresses.start :])


DRIVER: Final = Driver(make_bus=DynamixelBus, cycle_time_ns=cycle_time_ns)
"""The driver's ranges and rules are in :mod:`kata.device.config_rules`."""
