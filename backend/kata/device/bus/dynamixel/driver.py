"""Driver for Dynamixel Protocol 2.0 with the control table of the XH540 (robotis e-manual).

Each cycle has three requests. A Sync Read reads current, velocity and position of all five drives (a Fast Sync Read if
the drives support it: one packet, a quarter fewer bytes). A Read reads the registers of one drive in turn. The last
Read reads the external ports, so that the emergency stop is the newest value. Setpoints and torque are sent as Sync
Writes, which no drive answers; the drives' registers show the resulting torque.

Every register that the configuration determines is verified (:mod:`kata.device.bus.dynamixel.registers`). The registers in the
status block are verified with each status. The others are read in a slow rotation that sometimes replaces a status, so
that no cycle becomes longer.

An answer does not identify its request. The driver therefore asks the drives for one more byte in every other cycle,
and asks the inputs for up to thirteen more bytes in rotation. An answer that arrives whole cycles late then has the
wrong length.
"""

import logging
import struct
from collections.abc import Callable, Collection, Sequence
from itertools import cycle
from typing import Final

from kata.device import texts
from kata.device.bus.dynamixel.packets import BROADCAST, FastParser, StatusParser, encode, encode_cached
from kata.device.bus.dynamixel.registers import (
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
    port_mode,
    zero_count,
)
from kata.device.bus.dynamixel.requests import ALERT, SYNC_WRITE, DynamixelRequests, OnReply, Replies
from kata.device.bus.poll_backoff import PollBackoff
from kata.device.bus.port import BusError, BusSample, DriveSample, DriveStatus, InputSample, input_sample
from kata.device.bus.serial_transport import Transport
from kata.device.bus.verification import Verification
from kata.device.config import Axis, StationConfig

log = logging.getLogger(__name__)

_SYNC_READ: Final = 0x82
_FAST_SYNC_READ: Final = 0x8A
_PLAIN_READ_CYCLES: Final = 100
"""After a damaged Fast Sync Read, plain Sync Reads are used for this many cycles: one damaged part invalidates all
parts after it.
"""
_INPUT_ANSWER_LENGTHS: Final = 14

_STATUS_BYTES: Final = STATUS_BLOCK.stop - STATUS_BLOCK.start
_HARDWARE_ERROR_AT: Final = 70 - TORQUE_ENABLE
_WATCHDOG_AT: Final = BUS_WATCHDOG - TORQUE_ENABLE
_WATCHDOG_STEP_MS: Final = 20
_WATCHDOG_TRIPPED: Final = 0xFF
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


class DynamixelBus(DynamixelRequests):
    """The :class:`~kata.device.bus.port.Bus` of five drives that speak Protocol 2.0."""

    def __init__(self, config: StationConfig, open_transport: Callable[[str, int], Transport]) -> None:
        """Prepare the driver without opening the port. ``open_transport`` opens a port at a baud rate."""
        super().__init__(config, open_transport)
        self._axes = {axis.id: axis for axis in config.axes}
        self._zeros = {axis.id: zero_count(axis) for axis in config.axes}
        """By drive id: the position that the drive reports at motor angle 0, whole turns included."""
        self._registers = [configured_registers(config, axis) for axis in config.axes]
        self._ports = (self._ids.index(config.inputs.drive_id), PORTS_BLOCK)
        """Drive and block that hold the modes of the input ports."""
        self._port_modes = frozenset(port_mode(port) for port in config.inputs.ports)
        self._verification = Verification(len(self._ids), 1 + len(EEPROM_BLOCKS), config.cycle_hz, urgent=self._ports)
        self._armed_ns: int | None = None
        """When the bus watchdogs were armed; None while torque is off."""
        self._goals = struct.Struct("<" + "Bi" * len(config.axes))
        """Id and goal of each drive."""
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
        self._send(encode(BROADCAST, SYNC_WRITE, _GOALS_TO + self._goals.pack(*goals)))

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

    # -- requests -------------------------------------------------------------------------------------------------

    def _sync_read(self, asked: Sequence[int], fast: bool, on_reply: OnReply | None = None) -> Replies:
        if not asked:
            return Replies()
        size = _PRESENT_FORMAT.size + self._extra_bytes
        instruction = _FAST_SYNC_READ if fast else _SYNC_READ
        request = encode_cached(BROADCAST, instruction, struct.pack("<HH", PRESENT, size) + bytes(asked))
        return self._transact(request, asked, FastParser(asked, size) if fast else StatusParser(), size, on_reply)

    def _read_inputs(self) -> InputSample | None:
        """Return the state of the contacts. None also if the ports are not verified as inputs: their values mean
        nothing then. A mismatch of another register hides no pressed switch.
        """
        inputs = self._config.inputs
        if not self._verification.registers_match(*self._ports, self._port_modes):
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
        if error & ~ALERT:
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
            alert=error & ALERT != 0,
        )

    def _read_status(self, axis: int) -> DriveStatus | None:
        read = self._read_registers(self._ids[axis], TORQUE_ENABLE, _STATUS_BYTES)
        if read is None:
            return None
        t_ns, data = read
        self._compare(axis, 0, STATUS_BLOCK, data, *self._watchdog_mismatch(t_ns, data))
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

    def _compare(self, axis: int, block: int, addresses: range, data: bytes, *mismatches: str) -> None:
        differing = [
            register.name
            for register in self._registers[axis]
            if register.address in addresses
            and data[(at := register.address - addresses.start) : at + len(register.data)] != register.data
        ]
        self._verification.found(axis, block, [*mismatches, *differing])

    def _watchdog_mismatch(self, t_ns: int, data: bytes) -> tuple[str, ...]:
        """Return the watchdog's name if a drive with torque has not armed it: no drive confirms the write that arms it."""
        armed = self._armed_ns is not None and t_ns > self._armed_ns + _ARMING_LIMIT_NS
        if not armed or not data[0] or data[_WATCHDOG_AT] in (self._watchdog, _WATCHDOG_TRIPPED):
            return ()
        return ("bus watchdog",)

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
