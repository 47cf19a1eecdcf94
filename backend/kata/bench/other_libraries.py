"""The same cycle, carried out by other people's libraries, each as its own documentation uses it and in its fastest way.

They are for development only, and imported when they are measured.
"""

import contextlib
import importlib.util
from typing import Any, Final

from kata.bench.bus_cycle import Goals
from kata.device.config import StationConfig

_GOAL: Final = 116
_GOAL_BYTES: Final = 4
_PRESENT: Final = 126
"""Current (2 bytes), velocity (4) and position (4)."""
_PRESENT_BYTES: Final = 10
_COUNTS_A_DEG: Final = 4096 / 360
_HALF_TURN: Final = 2048
_TIMEOUT_S: Final = 0.02
"""Where a library lets its user choose: two cycles of the control loop. Their own examples wait longer."""


def installed(module: str) -> bool:
    """Whether it is installed."""
    return importlib.util.find_spec(module) is not None


def _count(angle_deg: float) -> int:
    return _HALF_TURN + round(angle_deg * _COUNTS_A_DEG)


class DynamixelSdk:
    """ROBOTIS' own, with Group Sync Write and Group Sync Read."""

    def __init__(self, config: StationConfig, *, fast: bool) -> None:
        """``fast``: with Fast Sync Read."""
        import dynamixel_sdk as sdk

        self._port = sdk.PortHandler(config.port)
        if not self._port.setBaudRate(config.baud):
            raise OSError(f"dynamixel-sdk does not know {config.baud} baud")
        handler = sdk.PacketHandler(2.0)
        self._ids = [axis.id for axis in config.axes]
        self._write = sdk.GroupSyncWrite(self._port, handler, _GOAL, _GOAL_BYTES)
        self._read = sdk.GroupSyncRead(self._port, handler, _PRESENT, _PRESENT_BYTES)
        for drive_id in self._ids:
            self._write.addParam(drive_id, bytes(_GOAL_BYTES))
            self._read.addParam(drive_id)
        self._ask = self._read.fastSyncRead if fast else self._read.txRxPacket
        self._one_packet = fast
        self._success = sdk.COMM_SUCCESS
        self._goals = Goals(config)

    def cycle(self) -> int:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        for drive_id, angle_deg in zip(self._ids, self._goals.next_deg(), strict=True):
            self._write.changeParam(drive_id, _count(angle_deg).to_bytes(_GOAL_BYTES, "little", signed=True))
        self._write.txPacket()
        for drive_id in self._ids:
            # An answer of the cycle before is not to be taken for one of this.
            self._read.data_dict[drive_id] = []
        whole = self._ask() == self._success
        if whole:
            for drive_id in self._ids:
                self._read.getData(drive_id, 126, 2)
                self._read.getData(drive_id, 128, 4)
                self._read.getData(drive_id, 132, 4)
        return len(self._ids) if whole else sum(1 for data in self._read.data_dict.values() if data)

    def close(self) -> None:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._port.closePort()


class Rustypot:
    """Written in Rust; a Sync Read of all three values as one block, which is quicker than its one for each register."""

    def __init__(self, config: StationConfig) -> None:
        import rustypot

        # Of those with Protocol 2.0 the one whose registers are where an XH540 has them.
        self._controller: Any = rustypot.Xl430PyController(config.port, config.baud, _TIMEOUT_S)
        self._ids = [axis.id for axis in config.axes]
        self._goals = Goals(config)

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
        """See :class:`~kata.bench.bus_cycle.CycleRunner`. It closes its port when it is forgotten."""
        self._controller = None


class Pymodbus:
    """Function 23 for each drive and the two inputs, as our own driver does."""

    def __init__(self, config: StationConfig) -> None:
        from pymodbus import ModbusException
        from pymodbus.client import ModbusSerialClient

        self._config = config
        self._refused = ModbusException
        self._client: Any = ModbusSerialClient(config.port, baudrate=config.baud, timeout=_TIMEOUT_S, retries=0)
        if not self._client.connect():
            raise OSError(f"pymodbus cannot open {config.port}")
        self._goals = Goals(config)

    def cycle(self) -> int:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        registers, inputs = self._config.modbus, self._config.inputs
        sound = 0
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
                sound += not answer.isError()
            except self._refused:
                continue
        first = min(inputs.estop_port, inputs.pedal_port)
        count = abs(inputs.estop_port - inputs.pedal_port) + 1
        with contextlib.suppress(self._refused):
            self._client.read_discrete_inputs(first - 1, count=count, device_id=inputs.drive_id)
        return sound

    def close(self) -> None:
        """See :class:`~kata.bench.bus_cycle.CycleRunner`."""
        self._client.close()
