"""Runs the bus cycle with other libraries, each as its documentation recommends and in its fastest mode.

The libraries are development dependencies and are imported when they are measured.
"""

import contextlib
import importlib.util
from typing import Any, Final

from kata.bench.bus_cycle import Goals
from kata.device.config import StationConfig

_GOAL: Final = 116
_GOAL_BYTES: Final = 4
_PRESENT: Final = 126
"""Address of current (2 bytes), velocity (4) and position (4)."""
_PRESENT_BYTES: Final = 10
_COUNTS_A_DEG: Final = 4096 / 360
_HALF_TURN: Final = 2048
_TIMEOUT_S: Final = 0.02
"""Time-out of libraries with a configurable time-out: two cycles of the control loop. Their own examples use longer time-outs."""


def installed(module: str) -> bool:
    """Return True if the module is installed."""
    return importlib.util.find_spec(module) is not None


def _count(angle_deg: float) -> int:
    return _HALF_TURN + round(angle_deg * _COUNTS_A_DEG)


class DynamixelSdk:
    """ROBOTIS' library with Group Sync Write and Group Sync Read."""

    def __init__(self, config: StationConfig, *, fast: bool) -> None:
        """Open the port. ``fast``: use Fast Sync Read."""
        import dynamixel_sdk as sdk

        self._port = sdk.PortHandler(config.port)
        if not self._port.setBaudRate(config.baud):
            raise OSError(f"dynamixel-sdk does not support {config.baud} baud")
        handler = sdk.PacketHandler(2.0)
        self._ids = [axis.id for axis in config.axes]
        self._write = sdk.GroupSyncWrite(self._port, handler, _GOAL, _GOAL_BYTES)
        self._read = sdk.GroupSyncRead(self._port, handler, _PRESENT, _PRESENT_BYTES)
        for drive_id in self._ids:
            self._write.addParam(drive_id, bytes(_GOAL_BYTES))
            self._read.addParam(drive_id)
        self._ask = self._read.fastSyncRead if fast else self._read.txRxPacket
        self._fast = fast
        self._success = sdk.COMM_SUCCESS
        self._goals = Goals(config)
        self.inputs_lost = 0

    def cycle(self) -> int:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        for drive_id, angle_deg in zip(self._ids, self._goals.next_deg(), strict=True):
            self._write.changeParam(drive_id, _count(angle_deg).to_bytes(_GOAL_BYTES, "little", signed=True))
        self._write.txPacket()
        for drive_id in self._ids:
            # Discard the answer of the last cycle.
            self._read.data_dict[drive_id] = []
        complete = self._ask() == self._success
        if complete:
            for drive_id in self._ids:
                self._read.getData(drive_id, 126, 2)
                self._read.getData(drive_id, 128, 4)
                self._read.getData(drive_id, 132, 4)
        return len(self._ids) if complete else sum(1 for data in self._read.data_dict.values() if data)

    def close(self) -> None:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._port.closePort()


class Rustypot:
    """rustypot, which is written in Rust. It reads all three values as one block, which is faster than one Sync Read for each register."""

    def __init__(self, config: StationConfig) -> None:
        import rustypot

        # This Protocol 2.0 controller has the register addresses of an XH540.
        self._controller: Any = rustypot.Xl430PyController(config.port, config.baud, _TIMEOUT_S)
        self._ids = [axis.id for axis in config.axes]
        self._goals = Goals(config)
        self.inputs_lost = 0

    def cycle(self) -> int:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._controller.sync_write_goal_position(self._ids, [_count(deg) for deg in self._goals.next_deg()])
        try:
            blocks = self._controller.sync_read_raw_data(self._ids, _PRESENT, _PRESENT_BYTES)
        except (OSError, RuntimeError, ValueError):
            return 0
        for block in blocks:
            data = bytes(block)
            int.from_bytes(data[0:2], "little", signed=True)
            int.from_bytes(data[2:6], "little", signed=True)
            int.from_bytes(data[6:10], "little", signed=True)
        return len(blocks)

    def close(self) -> None:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`. The controller closes its port when it is deleted."""
        self._controller = None


class Pymodbus:
    """pymodbus: function 23 for each drive, and the two inputs, like our own driver."""

    def __init__(self, config: StationConfig) -> None:
        from pymodbus import ModbusException
        from pymodbus.client import ModbusSerialClient

        self._config = config
        self._exception = ModbusException
        self._client: Any = ModbusSerialClient(config.port, baudrate=config.baud, timeout=_TIMEOUT_S, retries=0)
        if not self._client.connect():
            raise OSError(f"pymodbus cannot open {config.port}")
        self._goals = Goals(config)
        self.inputs_lost = 0

    def cycle(self) -> int:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        registers, inputs = self._config.modbus, self._config.inputs
        answers = 0
        for axis, angle_deg in zip(self._config.axes, self._goals.next_deg(), strict=True):
            goal = round(angle_deg * registers.position_per_deg) & 0xFFFFFFFF
            try:
                answer = self._client.readwrite_registers(
                    read_address=registers.block_start,
                    read_count=registers.block_registers,
                    write_address=registers.goal_position,
                    values=[goal >> 16, goal & 0xFFFF],
                    device_id=axis.id,
                )
                answers += not answer.isError()
            except self._exception:
                continue
        first = min(inputs.estop_port, inputs.pedal_port)
        count = abs(inputs.estop_port - inputs.pedal_port) + 1
        with contextlib.suppress(self._exception):
            self._client.read_discrete_inputs(first - 1, count=count, device_id=inputs.drive_id)
        return answers

    def close(self) -> None:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._client.close()
