"""Driver for Modbus RTU drives. Register maps differ between vendors, so the map is in the station's configuration
(:class:`ModbusMap`).

Each cycle reads one block of registers of each drive, then the inputs, so that the emergency stop is the newest value. With
function 23 the same request also writes the newest setpoint. The setpoint then arrives one cycle after it was computed. The
path's lead compensates this delay, and the bus allows a higher cycle rate. Torque off is a broadcast.

The registers that the configuration determines are read back in a slow rotation, at most one extra read a cycle, because a
drive that loses power loses them.
"""

import struct
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Final

from kata.device import texts
from kata.device.bus.interface import (
    BusError,
    BusSample,
    DriveHealth,
    DriveSample,
    DriveStatus,
    InputSample,
    input_sample,
)
from kata.device.bus.modbus.bandwidth import cycle_time_ns
from kata.device.bus.modbus.requests import READ, WRITE, ModbusAnswer, ModbusRequests
from kata.device.bus.plugin import Driver
from kata.device.bus.poll_backoff import PollBackoff
from kata.device.bus.serial_transport import Transport
from kata.device.bus.verification import Verification
from kata.device.config import NO_REGISTER, Axis, StationConfig

_READ_INPUTS: Final = 0x02
_BOTH: Final = 0x17
_WRITTEN_BYTES: Final = 8
_GOAL_TRIES: Final = 3
"""A goal is written so often before torque is switched on; without an acknowledgement the port is closed."""


class ModbusBus(ModbusRequests):
    """The :class:`~kata.device.bus.interface.Bus` of five drives that speak Modbus RTU."""

    def __init__(self, config: StationConfig, open_transport: Callable[[str, int], Transport]) -> None:
        """Prepare the driver without opening the port. ``open_transport`` opens a port at a baud rate."""
        super().__init__(config, open_transport)
        self._map = config.modbus
        self._block = range(self._map.block_start, self._map.block_start + self._map.block_registers)
        """Registers that are read every cycle. They are computed once, because every decoded value needs them."""
        self._ids = [axis.id for axis in config.axes]
        self._backoff = PollBackoff(self._ids, self._config)
        self._registers = [tuple(self._configured(axis)) for axis in config.axes]
        self._spans = self._map.verified_spans
        self._verification = Verification(len(self._ids), 1 + len(self._spans), config.cycle_hz)
        self._armed_ns: int | None = None
        """Time at which the watchdogs were armed; None while torque is off."""
        self._health_limits: list[tuple[float | None, float | None, float | None]] = [(None, None, None)] * len(
            self._ids
        )
        """Lowest voltage, highest voltage and highest temperature of each axis, as read from the drive."""
        self._health_turn = 0
        """Axis whose voltage and temperature are decoded in this cycle."""
        self._goals: dict[int, bytes] = {}
        """Goal that function 23 writes with the next read, by slave."""

    def open(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._transport = self._open_transport(self._config.port, self._config.baud)
        self._free_at_ns = 0
        self._backoff = PollBackoff(self._ids, self._config)
        self._goals = {}
        self._overdue = set()
        self._armed_ns = None
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
        drives: list[DriveSample | None] = []
        statuses: list[DriveStatus] = []
        corrupt: set[int] = set()
        timed_out: set[int] = set()
        health: tuple[DriveHealth, ...] = ()
        self._health_turn = (self._health_turn + 1) % len(self._ids)
        for n, axis in enumerate(self._config.axes):
            answer = self._read_drive(axis) if self._backoff.should_poll(axis.id) else None
            if answer and answer.data is not None:
                drives.append(self._drive_sample(axis, answer.t_ns, answer.data))
                self._verification.found(n, 0, ())
                self._verification.heard(n, answered=True)
                statuses.append(self._drive_status(n, answer.t_ns, answer.data))
                if n == self._health_turn:
                    health = self._drive_health(n, answer.t_ns, answer.data)
            else:
                drives.append(None)
                if answer:
                    (corrupt if answer.corrupt else timed_out).add(n)
                self._verification.heard(n, answered=False)
        if due := self._verification.next_read():
            self._verify(*due)
        inputs = self._read_inputs()
        return BusSample(tuple(drives), inputs, tuple(statuses), frozenset(corrupt), frozenset(timed_out), health)

    def read_inputs(self) -> InputSample | None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._slack_left_ns = self._slack_ns // 2
        return self._read_inputs()

    def write_setpoints(self, angles_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.interface.Bus`."""
        self._goals = {
            axis.id: self._position(axis, angle) for axis, angle in zip(self._config.axes, angles_deg, strict=True)
        }
        if not self._map.function_23:
            self._write_goals()

    def torque_on(self, hold_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.interface.Bus`. A tripped watchdog is cleared, because its fault was acknowledged.

        Every drive must acknowledge its goal. One that still has an older goal would turn to it.
        """
        if self._map.clear != NO_REGISTER:
            self._broadcast(self._map.clear, 1)
        for motor, (axis, angle) in enumerate(zip(self._config.axes, hold_deg, strict=True), start=1):
            self._set_goal(motor, axis, angle)
        self._goals = {}
        self._broadcast(self._map.torque_enable, 1)
        if self._map.watchdog_ms != NO_REGISTER:
            self._broadcast(self._map.watchdog_ms, self._config.bus_watchdog_ms)
        self._armed_ns = self._require_transport().now_ns()

    def torque_off(self) -> None:
        """See :class:`~kata.device.bus.interface.Bus`. A pending setpoint is discarded."""
        self._goals = {}
        self._armed_ns = None
        self._broadcast(self._map.torque_enable, 0)

    # -- requests -------------------------------------------------------------------------------------------------

    def _read_drive(self, axis: Axis) -> ModbusAnswer:
        goal = self._goals.pop(axis.id, None)
        where = struct.pack(">HH", self._block.start, len(self._block))
        size = 5 + 2 * len(self._block)
        if goal is None:
            answer = self._transact(axis.id, READ, where, size)
        else:
            answer = self._transact(axis.id, _BOTH, where + self._written(self._map.goal_position, goal), size)
        self._backoff.answered([axis.id], [axis.id] if answer.data is not None else [])
        return answer

    def _read_inputs(self) -> InputSample | None:
        inputs = self._config.inputs
        if not self._backoff.should_poll(inputs.drive_id):
            return None
        first = min(inputs.ports)
        count = max(inputs.ports) - first + 1
        # Inputs are numbered from 1, their addresses from 0.
        answer = self._transact(
            inputs.drive_id, _READ_INPUTS, struct.pack(">HH", first - 1, count), 5 + (count + 7) // 8
        )
        if answer.data is None:
            return None
        bits = int.from_bytes(answer.data[1:], "little")
        return input_sample(answer.t_ns, inputs, {port: bool(bits >> (port - first) & 1) for port in inputs.ports})

    def _drive_sample(self, axis: Axis, t_ns: int, data: bytes) -> DriveSample:
        registers = self._map
        position = self._long(data, registers.position) - (axis.zero_count or 0)
        return DriveSample(
            t_ns=t_ns,
            position_deg=axis.direction * position / registers.position_per_deg,
            speed_deg_s=axis.direction * self._word(data, registers.speed) / registers.speed_per_deg_s,
            torque_nm=axis.direction * self._word(data, registers.torque) / registers.torque_per_nm,
        )

    def _drive_status(self, axis: int, t_ns: int, data: bytes) -> DriveStatus:
        status = self._word(data, self._map.status)
        return DriveStatus(
            t_ns=t_ns,
            axis=axis,
            torque_on=bool(status >> self._map.status_torque_bit & 1),
            hardware_error=self._word(data, self._map.error) & 0xFFFF,
            watchdog_tripped=bool(status >> self._map.status_watchdog_bit & 1),
            verified=self._verification.verified(axis),
            mismatch=self._verification.mismatch(axis),
        )

    def _drive_health(self, axis: int, t_ns: int, data: bytes) -> tuple[DriveHealth, ...]:
        """Return voltage and temperature if the map names their registers, else nothing."""
        registers = self._map
        volt = self._scaled(data, registers.supply_voltage, registers.voltage_per_v)
        temperature_c = self._scaled(data, registers.temperature, registers.temperature_per_c)
        if volt is None and temperature_c is None:
            return ()
        return (DriveHealth(t_ns, axis, volt, temperature_c, *self._health_limits[axis]),)

    def _scaled(self, data: bytes, register: int, per_unit: float) -> float | None:
        return None if register == NO_REGISTER else self._word(data, register) / per_unit

    def _note_limits(self, axis: int, span: range, data: bytes) -> None:
        """Decode the drive's own limits from a span that was read back."""

        def limit(register: int, per_unit: float) -> float:
            at = 2 * (register - span.start)
            return int.from_bytes(data[at : at + 2], "big", signed=True) / per_unit

        registers = self._map
        low_v, high_v, temperature_c = self._health_limits[axis]
        if registers.voltage_limits in span:
            low_v = limit(registers.voltage_limits, registers.voltage_per_v)
            high_v = limit(registers.voltage_limits + 1, registers.voltage_per_v)
        if registers.temperature_limit in span:
            temperature_c = limit(registers.temperature_limit, registers.temperature_per_c)
        self._health_limits[axis] = (low_v, high_v, temperature_c)

    # -- verification -----------------------------------------------------------------------------------------------

    def _configured(self, axis: Axis) -> Iterator[tuple[str, int, bytes]]:
        """Yield name, first register and contents of every register that must have a fixed value."""
        registers = self._map
        if registers.response_delay_us != NO_REGISTER:
            yield "response delay", registers.response_delay_us, struct.pack(">H", self._config.return_delay_us)
        if registers.torque_limit != NO_REGISTER:
            limit = round(axis.max_torque_nm * registers.torque_per_nm)
            yield "torque limit", registers.torque_limit, struct.pack(">H", limit)
        if registers.position_limits != NO_REGISTER:
            tolerance = self._config.limit_tolerance_deg
            ends = [self._position(axis, axis.min_deg - tolerance), self._position(axis, axis.max_deg + tolerance)]
            low, high = ends if axis.direction > 0 else reversed(ends)
            yield "position limits", registers.position_limits, low + high

    def _verify(self, axis: int, block: int) -> None:
        """Read one span of one drive's registers and compare it with the configuration."""
        span = self._spans[block - 1]
        if not self._backoff.should_poll(self._ids[axis]):
            return
        armed_ns = self._armed_ns
        answer = self._read_span(self._ids[axis], span)
        if answer.data is None:
            return
        data = answer.data[1:]
        self._note_limits(axis, span, data)
        mismatches = [
            name
            for name, first, wanted in self._registers[axis]
            if first in span and data[(at := 2 * (first - span.start)) : at + len(wanted)] != wanted
        ]
        watchdog_at = 2 * (self._map.watchdog_ms - span.start)
        if armed_ns is not None and self._map.watchdog_ms in span:
            armed = int.from_bytes(data[watchdog_at : watchdog_at + 2], "big")
            mismatches += [] if armed == self._config.bus_watchdog_ms else ["watchdog"]
        self._verification.found(axis, block, mismatches)

    def _read_span(self, slave: int, span: range) -> ModbusAnswer:
        return self._transact(slave, READ, struct.pack(">HH", span.start, len(span)), 5 + 2 * len(span))

    # -- configuration ------------------------------------------------------------------------------------------------

    def _configure(self, motor: int, axis: Axis, registers: Sequence[tuple[str, int, bytes]]) -> None:
        status = self._read_back(motor, axis.id, range(self._map.status, self._map.status + 1))
        if int.from_bytes(status, "big") >> self._map.status_torque_bit & 1:
            raise BusError(texts.DRIVE_HAS_TORQUE(motor=motor, drive_id=axis.id))
        if self._map.watchdog_ms != NO_REGISTER:
            self._set(motor, axis.id, self._map.watchdog_ms, struct.pack(">H", 0))
        for name, first, data in registers:
            self._set(motor, axis.id, first, data)
            if self._read_back(motor, axis.id, range(first, first + len(data) // 2)) != data:
                raise BusError(texts.DRIVE_SETTING_REFUSED(motor=motor, drive_id=axis.id, setting=name))

    def _set_goal(self, motor: int, axis: Axis, angle_deg: float) -> None:
        goal = self._position(axis, angle_deg)
        for tries_left in reversed(range(_GOAL_TRIES)):
            try:
                self._set(motor, axis.id, self._map.goal_position, goal)
                return
            except BusError:
                if not tries_left:
                    raise

    def _read_back(self, motor: int, slave: int, span: range) -> bytes:
        self._slack_left_ns = self._slack_ns
        return self._contents(motor, slave, self._read_span(slave, span))[1:]

    def _set(self, motor: int, slave: int, register: int, data: bytes) -> None:
        self._slack_left_ns = self._slack_ns
        answer = self._transact(slave, WRITE, self._written(register, data), _WRITTEN_BYTES)
        if answer.exception:
            raise BusError(
                texts.DRIVE_REGISTER_EXCEPTION(
                    motor=motor, drive_id=slave, register=register, exception=answer.exception
                )
            )
        self._contents(motor, slave, answer)

    @staticmethod
    def _contents(motor: int, slave: int, answer: ModbusAnswer) -> bytes:
        if answer.data is None:
            problem = texts.DRIVE_ANSWERS_DAMAGED if answer.corrupt else texts.DRIVE_DOES_NOT_ANSWER
            raise BusError(problem(motor=motor, drive_id=slave))
        return answer.data

    # -- registers and frames -------------------------------------------------------------------------------------

    def _write_goals(self) -> None:
        goals, self._goals = self._goals, {}
        self._slack_left_ns = self._slack_ns
        for slave, goal in goals.items():
            if self._backoff.should_poll(slave):
                self._transact(slave, WRITE, self._written(self._map.goal_position, goal), _WRITTEN_BYTES)

    def _position(self, axis: Axis, angle_deg: float) -> bytes:
        value = round(axis.direction * angle_deg * self._map.position_per_deg) + (axis.zero_count or 0)
        return struct.pack(">i", value)

    def _word(self, data: bytes, register: int) -> int:
        at = 1 + 2 * (register - self._block.start)
        return int.from_bytes(data[at : at + 2], "big", signed=True)

    def _long(self, data: bytes, register: int) -> int:
        at = 1 + 2 * (register - self._block.start)
        return int.from_bytes(data[at : at + 4], "big", signed=True)


def _setpoint_delay_s(config: StationConfig) -> float:
    """Return the duration of one cycle with function 23, because the next cycle's request carries the setpoint; else 0."""
    return 1.0 / config.cycle_hz if config.modbus.function_23 else 0.0


DRIVER: Final = Driver(make_bus=ModbusBus, cycle_time_ns=cycle_time_ns, setpoint_delay_s=_setpoint_delay_s)
"""The driver's ranges and rules are in :mod:`kata.device.config_rules`."""
