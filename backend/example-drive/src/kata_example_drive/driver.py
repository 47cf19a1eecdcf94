"""The driver: one request for each drive and cycle, and what the package declares (``DRIVER``)."""

import struct
from collections.abc import Callable, Collection, Sequence
from typing import Final

import msgspec
from fastcrc import crc16

from kata.device import texts
from kata.device.bus.interface import BusError, BusSample, DriveSample, DriveStatus, InputSample, input_sample
from kata.device.bus.plugin import Driver
from kata.device.bus.poll_backoff import PollBackoff
from kata.device.bus.registry import driver_settings
from kata.device.bus.serial_transport import Transport
from kata.device.bus.timing import BITS_A_BYTE
from kata.device.bus.verification import Verification
from kata.device.config import Axis, StationConfig
from kata.device.config_rules import Range

_REQUEST, _ANSWER = 0x5A, 0xA5
_READ, _WRITE, _GOALS = 1, 2, 3
_OVERHEAD: Final = 7
_BROADCAST: Final = 0

_TORQUE_ENABLE, _WATCHDOG, _TORQUE_LIMIT, _MARKER = 0, 1, 2, 4
_REGISTERS: Final = struct.Struct("<BBHBxiBBHBxihh")
"""All registers, from torque enable to torque. They are read in one piece, so each answer verifies every setting."""
_WATCHDOG_STEP_MS: Final = 20
_COUNTS_PER_DEG: Final = 100
_MAX_SLACK_NS: Final = 4_000_000
_MIN_SLACK_NS: Final = 500_000
_SLACK_SHARE: Final = 0.2
"""Share of a cycle that it waits for late answers, at most. Every later answer has the minimum."""


class ExampleSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The table ``[driver]`` in a station's file."""

    torque_per_nm: float = 100.0
    """Units of the torque registers in one Nm."""


class _Registers(msgspec.Struct, frozen=True):
    """The registers of one drive, and when they were read."""

    t_ns: int
    torque_enable: int
    watchdog: int
    torque_limit: int
    marker: int
    goal: int
    torque_on: int
    tripped: int
    error: int
    contacts: int
    position: int
    speed: int
    torque: int


class ExampleBus:
    """The :class:`~kata.device.bus.interface.Bus` of five example drives."""

    def __init__(self, config: StationConfig, open_transport: Callable[[str, int], Transport]) -> None:
        """Prepare the driver without opening the port. ``open_transport`` opens a port at a baud rate."""
        self._config = config
        self._open_transport = open_transport
        self._settings: ExampleSettings = driver_settings(config)
        self._byte_ns = BITS_A_BYTE * 1_000_000_000 // config.baud
        self._slack_ns = min(_MAX_SLACK_NS, int(_SLACK_SHARE * 1e9 / config.cycle_hz))
        self._slack_left_ns = 0
        self._ids = [axis.id for axis in config.axes]
        self._backoff = PollBackoff(self._ids, config)
        self._verification = Verification(len(self._ids), 1, config.cycle_hz)
        self._transport: Transport | None = None
        self._busy_until_ns = 0
        self._number = 0
        """Number of the last request. An answer has the number of its request, so a late one is recognized."""
        self._armed = False
        """True if the bus watchdogs are armed."""
        self.errors = 0
        """Missing and damaged answers since the start."""

    def open(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._transport = self._open_transport(self._config.port, self._config.baud)
        self._backoff = PollBackoff(self._ids, self._config)
        self._busy_until_ns = 0
        self._armed = False
        for n in range(len(self._ids)):
            self._verification.forget(n)

    def close(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        if self._transport:
            self._transport.close()
            self._transport = None

    def configure(self, axes: Collection[int]) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        for n in sorted(axes):
            self._verification.forget(n)
            self._configure(n + 1, self._config.axes[n])

    def read(self) -> BusSample:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._backoff.begin_cycle()
        self._slack_left_ns = self._slack_ns
        drives: list[DriveSample | None] = [None] * len(self._ids)
        statuses: list[DriveStatus] = []
        corrupt: set[int] = set()
        timed_out: set[int] = set()
        inputs: InputSample | None = None
        for n, axis in enumerate(self._config.axes):
            if not self._backoff.should_poll(axis.id):
                continue
            found, damaged = self._read_drive(axis.id)
            self._backoff.answered([axis.id], [axis.id] if found else [])
            self._verification.heard(n, answered=found is not None)
            if found is None:
                (corrupt if damaged else timed_out).add(n)
                continue
            drives[n] = self._drive_sample(axis, found)
            statuses.append(self._drive_status(n, found))
            if axis.id == self._config.inputs.drive_id:
                inputs = self._input_sample(found)
        return BusSample(tuple(drives), inputs, tuple(statuses), frozenset(corrupt), frozenset(timed_out))

    def read_inputs(self) -> InputSample | None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._slack_left_ns = self._slack_ns // 2
        found, _ = self._read_drive(self._config.inputs.drive_id)
        return self._input_sample(found) if found else None

    def write_setpoints(self, angles_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        goals = b"".join(
            struct.pack("<Bi", axis.id, self._counts(axis, angle_deg))
            for axis, angle_deg in zip(self._config.axes, angles_deg, strict=True)
        )
        self._send(_BROADCAST, _GOALS, goals)

    def torque_on(self, hold_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._broadcast(_WATCHDOG, 0)
        self.write_setpoints(hold_deg)
        self._broadcast(_TORQUE_ENABLE, 1)
        self._broadcast(_WATCHDOG, self._watchdog)
        self._armed = True

    def torque_off(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._armed = False
        self._broadcast(_TORQUE_ENABLE, 0)

    # -- values -----------------------------------------------------------------------------------------------------

    @property
    def _watchdog(self) -> int:
        return self._config.bus_watchdog_ms // _WATCHDOG_STEP_MS

    def _torque_limit(self, axis: Axis) -> int:
        return round(axis.max_torque_nm * self._settings.torque_per_nm)

    def _counts(self, axis: Axis, angle_deg: float) -> int:
        return round(axis.direction * angle_deg * _COUNTS_PER_DEG) + (axis.zero_count or 0)

    def _drive_sample(self, axis: Axis, found: _Registers) -> DriveSample:
        return DriveSample(
            t_ns=found.t_ns,
            position_deg=axis.direction * (found.position - (axis.zero_count or 0)) / _COUNTS_PER_DEG,
            speed_deg_s=axis.direction * found.speed / 10,
            torque_nm=axis.direction * found.torque / self._settings.torque_per_nm,
        )

    def _drive_status(self, n: int, found: _Registers) -> DriveStatus:
        """Compare the settings and return the status."""
        right = {
            "torque limit": found.torque_limit == self._torque_limit(self._config.axes[n]),
            "marker": found.marker == 1,
            "watchdog": not (self._armed and found.torque_on) or found.watchdog == self._watchdog,
        }
        self._verification.found(n, 0, [name for name, is_right in right.items() if not is_right])
        return DriveStatus(
            t_ns=found.t_ns,
            axis=n,
            torque_on=found.torque_on != 0,
            hardware_error=found.error,
            watchdog_tripped=found.tripped != 0,
            verified=self._verification.verified(n),
            mismatch=self._verification.mismatch(n),
        )

    def _input_sample(self, found: _Registers) -> InputSample:
        inputs = self._config.inputs
        closed = {port: bool(found.contacts >> (port - 1) & 1) for port in inputs.ports}
        return input_sample(found.t_ns, inputs, closed)

    # -- configuration ----------------------------------------------------------------------------------------------

    def _configure(self, motor: int, axis: Axis) -> None:
        if self._require(motor, axis.id).torque_on:
            raise BusError(texts.DRIVE_HAS_TORQUE(motor=motor, drive_id=axis.id))
        limit = self._torque_limit(axis)
        # The marker is last: a drive that has it has the other settings.
        for address, data in ((_WATCHDOG, b"\0"), (_TORQUE_LIMIT, struct.pack("<H", limit)), (_MARKER, b"\1")):
            self._slack_left_ns = self._slack_ns
            self._transact(axis.id, _WRITE, bytes([address]) + data, 0)
        found = self._require(motor, axis.id)
        for name, is_right in (("torque limit", found.torque_limit == limit), ("marker", found.marker == 1)):
            if not is_right:
                raise BusError(texts.DRIVE_SETTING_REFUSED(motor=motor, drive_id=axis.id, setting=name))

    def _require(self, motor: int, drive_id: int) -> _Registers:
        """Read a drive that must answer."""
        self._slack_left_ns = self._slack_ns
        found, damaged = self._read_drive(drive_id)
        if found is None:
            problem = texts.DRIVE_ANSWERS_DAMAGED if damaged else texts.DRIVE_DOES_NOT_ANSWER
            raise BusError(problem(motor=motor, drive_id=drive_id))
        return found

    # -- requests ---------------------------------------------------------------------------------------------------

    def _read_drive(self, drive_id: int) -> tuple[_Registers | None, bool]:
        """Return the registers, and whether other bytes arrived instead."""
        t_ns, data, damaged = self._transact(drive_id, _READ, bytes([0, _REGISTERS.size]), _REGISTERS.size)
        return (None if data is None else _Registers(t_ns, *_REGISTERS.unpack(data))), damaged

    def _broadcast(self, address: int, value: int) -> None:
        self._send(_BROADCAST, _WRITE, bytes([address, value]))

    def _send(self, drive_id: int, instruction: int, payload: bytes) -> int:
        """Send a request. Return the earliest time at which its last byte is out."""
        transport = self._require_transport()
        self._number = (self._number + 1) % 256
        frame = bytes([_REQUEST, drive_id, self._number, instruction, len(payload)]) + payload
        # Read the clock before sending: this thread may be suspended while it sends.
        self._busy_until_ns = max(self._busy_until_ns, transport.now_ns()) + (len(payload) + _OVERHEAD) * self._byte_ns
        transport.send(frame + struct.pack("<H", crc16.modbus(frame)))
        return self._busy_until_ns

    def _transact(self, drive_id: int, instruction: int, payload: bytes, size: int) -> tuple[int, bytes | None, bool]:
        """Return time and payload of the answer, and whether other bytes arrived instead."""
        transport = self._require_transport()
        earliest_ns = self._send(drive_id, instruction, payload) + (_OVERHEAD + size) * self._byte_ns
        deadline_ns = earliest_ns + max(self._slack_left_ns, _MIN_SLACK_NS)
        head = bytes([_ANSWER, drive_id, self._number, 0, size])
        received = b""
        data = None
        while data is None and (chunk := transport.receive(earliest_ns, deadline_ns)):
            received += chunk
            data = _find(received, head, size)
        now_ns = transport.now_ns()
        self._slack_left_ns -= max(0, now_ns - earliest_ns)
        if data is None:
            self.errors += 1
            return now_ns, None, bool(received)
        # The drive answered when its bytes passed, however late the computer delivers them.
        return min(now_ns, earliest_ns), data, False

    def _require_transport(self) -> Transport:
        if self._transport is None:
            raise BusError(texts.PORT_NOT_OPEN(port=self._config.port))
        return self._transport


def _find(received: bytes, head: bytes, size: int) -> bytes | None:
    """Return the payload of the answer that begins with ``head``, after any noise or echo; None if there is none."""
    start = -1
    while (start := received.find(head, start + 1)) >= 0:
        frame = received[start : start + _OVERHEAD + size]
        if len(frame) == _OVERHEAD + size and crc16.modbus(frame[:-2]) == int.from_bytes(frame[-2:], "little"):
            return frame[len(head) : -2]
    return None


def _cycle_time_ns(config: StationConfig) -> float:
    """Return the time of the bytes of one cycle: a read of each drive, and the goals."""
    reads = len(config.axes) * (2 * _OVERHEAD + 2 + _REGISTERS.size)
    goals = _OVERHEAD + 5 * len(config.axes)
    return (reads + goals) * BITS_A_BYTE * 1e9 / config.baud


_IDS: Final = "the protocol has the ids 1 to 247, and 0 addresses every drive"

DRIVER: Final = Driver(
    make_bus=ExampleBus,
    cycle_time_ns=_cycle_time_ns,
    settings=ExampleSettings,
    ranges=(
        Range(
            field="baud",
            low=115_200,
            high=1_000_000,
            unit="bit/s",
            choices=(115_200, 1_000_000),
            reason="the drives know no other rates",
        ),
        Range(field="return_delay_us", low=0, high=0, unit="us", reason="the drives answer at once"),
        Range(field="inputs.drive_id", low=1, high=247, reason=_IDS),
        *(
            Range(field=f"inputs.{port}", low=1, high=8, reason="a drive has eight contacts")
            for port in ("estop_port", "estop_second_port", "pedal_port")
        ),
        Range(field="axes.id", low=1, high=247, reason=_IDS),
        Range(field="axes.model", low=1, high=65_535, reason="it is not used"),
        Range(
            field="axes.zero_count",
            low=-1_000_000_000,
            high=1_000_000_000,
            unit="counts",
            reason="every position of the range then fits 32 bits",
        ),
        Range(
            field="driver.torque_per_nm",
            low=50.0,
            high=1_000.0,
            unit="units a Nm",
            reason="coarser than 0.02 Nm hides the lowest resistance level; finer does not fit 16 bits",
        ),
    ),
)
