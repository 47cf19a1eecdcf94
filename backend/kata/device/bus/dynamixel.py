"""Dynamixel Protocol 2.0, control table of the XH540 (robotis e-manual).

A cycle is three requests: a Read of the two external ports (emergency stop first), a Sync Read of current, velocity
and position of all five, and a Read of one drive's torque, error and watchdog registers in turn. Setpoints and torque
go out as Sync Writes, which no drive answers; what became of the torque, the drives' own registers tell.
"""

import struct
import time
from collections.abc import Iterator, Sequence
from itertools import cycle
from typing import Final

from kata.device.bus.port import BusError, DriveReading, DriveStatus, InputReading, Reading
from kata.device.bus.serial import SerialLine
from kata.device.config import Axis, StationConfig

_HEADER: Final = b"\xff\xff\xfd\x00"
_READ: Final = 0x02
_WRITE: Final = 0x03
_STATUS: Final = 0x55
_SYNC_READ: Final = 0x82
_SYNC_WRITE: Final = 0x83
_BROADCAST: Final = 0xFE
_OVERHEAD: Final = 11
"""Bytes of a status packet that carries no data."""

_RETURN_DELAY: Final = 9
_OPERATING_MODE: Final = 11
_PORT_MODE: Final = 55
"""Plus the port's number, 1 to 3."""
_TORQUE_ENABLE: Final = 64
_GAINS: Final = 80
"""D, I and P, two bytes each."""
_BUS_WATCHDOG: Final = 98
_GOAL_CURRENT: Final = 102
_GOAL_POSITION: Final = 116
_PRESENT: Final = 126
"""Current (2), velocity (4) and position (4)."""
_PORT_DATA: Final = 150
"""Plus twice the port's number."""

_CURRENT_BASED_POSITION: Final = 5
_DIGITAL_INPUT_PULL_UP: Final = 2
_STATUS_BYTES: Final = _BUS_WATCHDOG - _TORQUE_ENABLE + 1
_HARDWARE_ERROR_AT: Final = 70 - _TORQUE_ENABLE
_WATCHDOG_STEP_MS: Final = 20
_WATCHDOG_TRIPPED: Final = 0xFF

_DEG_A_COUNT: Final = 360 / 4096
_DEG_S_A_UNIT: Final = 0.229 * 6
_A_A_UNIT: Final = 0.00269
_NM_A_A: Final = 2.0
"""The motors' torque constant: 10 Nm at 5 A (apparatus facts)."""

_PRESENT_FORMAT: Final = struct.Struct("<hii")


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x8005 if crc & 0x8000 else crc << 1
        table.append(crc & 0xFFFF)
    return tuple(table)


_CRC_TABLE: Final = _crc_table()


def crc16(data: bytes) -> int:
    """CRC-16 of the protocol: polynomial 0x8005, initial value 0, not reflected."""
    crc = 0
    for byte in data:
        crc = ((crc << 8) & 0xFFFF) ^ _CRC_TABLE[(crc >> 8) ^ byte]
    return crc


def encode(drive_id: int, instruction: int, parameters: bytes = b"") -> bytes:
    """One instruction packet, stuffed and with its CRC."""
    body = bytes([instruction]) + parameters
    body = body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    packet = _HEADER + struct.pack("<BH", drive_id, len(body) + 2) + body
    return packet + struct.pack("<H", crc16(packet))


class StatusParser:
    """Takes bytes as they come and gives whole, sound status packets."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        """Yields ``(drive id, error byte, data)``; noise and packets with a wrong CRC are dropped."""
        buffer = self._buffer
        buffer += data
        while True:
            start = buffer.find(_HEADER)
            if start < 0:
                del buffer[: max(0, len(buffer) - 3)]
                return
            del buffer[:start]
            if len(buffer) < 7:
                return
            end = 7 + int.from_bytes(buffer[5:7], "little")
            if end > 1024:
                del buffer[:4]
                continue
            if len(buffer) < end:
                return
            packet = bytes(buffer[:end])
            if end < _OVERHEAD or crc16(packet[:-2]) != int.from_bytes(packet[-2:], "little"):
                del buffer[:4]
                continue
            del buffer[:end]
            if packet[7] == _STATUS:
                yield packet[4], packet[8], packet[9:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


class DynamixelBus:
    """The :class:`~kata.device.bus.port.Bus` of five drives that speak Protocol 2.0."""

    def __init__(self, config: StationConfig) -> None:
        """Nothing is opened yet."""
        self._config = config
        self._ids = [axis.id for axis in config.axes]
        self._line: SerialLine | None = None
        self._next_status = cycle(range(len(config.axes)))
        self.errors = 0
        """Replies that stayed away or came damaged, since the start."""

    def open(self) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        self._line = SerialLine(self._config.port, self._config.baud)
        self.torque_off()
        for motor, axis in enumerate(self._config.axes, start=1):
            self._set_up(motor, axis)
        inputs = self._config.inputs
        motor = self._ids.index(inputs.drive_id) + 1
        for port in (inputs.estop_port, inputs.pedal_port):
            self._keep(motor, inputs.drive_id, _PORT_MODE + port, bytes([_DIGITAL_INPUT_PULL_UP]))

    def read(self) -> Reading:
        """See :class:`~kata.device.bus.port.Bus`."""
        inputs = self._read_inputs()
        drives = self._read_drives()
        return Reading(drives, inputs, self._read_status(next(self._next_status)))

    def write_setpoints(self, angles_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        goals = [
            struct.pack("<i", round(axis.zero_count + axis.direction * angle / _DEG_A_COUNT))
            for axis, angle in zip(self._config.axes, angles_deg, strict=True)
        ]
        self._sync_write(_GOAL_POSITION, goals)

    def torque_on(self, hold_deg: Sequence[float]) -> None:
        """See :class:`~kata.device.bus.port.Bus`. A watchdog that has tripped is cleared: its fault was acknowledged."""
        self._sync_write(_BUS_WATCHDOG, [b"\0"] * len(self._ids))
        self.write_setpoints(hold_deg)
        self._sync_write(_TORQUE_ENABLE, [b"\1"] * len(self._ids))
        watchdog = bytes([self._config.bus_watchdog_ms // _WATCHDOG_STEP_MS])
        self._sync_write(_BUS_WATCHDOG, [watchdog] * len(self._ids))

    def torque_off(self) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        self._sync_write(_TORQUE_ENABLE, [b"\0"] * len(self._ids))

    def close(self) -> None:
        """See :class:`~kata.device.bus.port.Bus`."""
        if self._line:
            self._line.close()
            self._line = None

    # -- one request each -----------------------------------------------------------------------------------------

    def _read_inputs(self) -> InputReading | None:
        inputs = self._config.inputs
        first = min(inputs.estop_port, inputs.pedal_port)
        length = 2 * abs(inputs.estop_port - inputs.pedal_port) + 2
        data = self._read_registers(inputs.drive_id, _PORT_DATA + 2 * first, length)
        if data is None:
            return None
        return InputReading(
            t_ns=time.monotonic_ns(),
            estop_open=data[2 * (inputs.estop_port - first)] != 0,
            pedal_down=data[2 * (inputs.pedal_port - first)] == 0,
        )

    def _read_drives(self) -> tuple[DriveReading | None, ...]:
        request = encode(_BROADCAST, _SYNC_READ, struct.pack("<HH", _PRESENT, _PRESENT_FORMAT.size) + bytes(self._ids))
        replies = self._exchange(request, self._ids, _PRESENT_FORMAT.size)
        return tuple(self._drive_reading(axis, replies.get(axis.id)) for axis in self._config.axes)

    @staticmethod
    def _drive_reading(axis: Axis, reply: tuple[int, bytes] | None) -> DriveReading | None:
        if reply is None:
            return None
        t_ns, data = reply
        current, velocity, position = _PRESENT_FORMAT.unpack(data)
        return DriveReading(
            t_ns=t_ns,
            position_deg=axis.direction * (position - axis.zero_count) * _DEG_A_COUNT,
            speed_deg_s=axis.direction * velocity * _DEG_S_A_UNIT,
            torque_nm=axis.direction * current * _A_A_UNIT * _NM_A_A,
        )

    def _read_status(self, axis: int) -> DriveStatus | None:
        data = self._read_registers(self._ids[axis], _TORQUE_ENABLE, _STATUS_BYTES)
        if data is None:
            return None
        return DriveStatus(
            t_ns=time.monotonic_ns(),
            axis=axis,
            torque_on=data[0] != 0,
            hardware_error=data[_HARDWARE_ERROR_AT],
            watchdog_tripped=data[-1] == _WATCHDOG_TRIPPED,
        )

    # -- setting up -----------------------------------------------------------------------------------------------

    def _set_up(self, motor: int, axis: Axis) -> None:
        self._write(motor, axis.id, _TORQUE_ENABLE, b"\0")
        self._write(motor, axis.id, _BUS_WATCHDOG, b"\0")
        self._keep(motor, axis.id, _RETURN_DELAY, bytes([self._config.return_delay_us // 2]))
        self._keep(motor, axis.id, _OPERATING_MODE, bytes([_CURRENT_BASED_POSITION]))
        gains = struct.pack("<HHH", axis.position_d_gain, axis.position_i_gain, axis.position_p_gain)
        self._write(motor, axis.id, _GAINS, gains)
        current = round(axis.max_torque_nm / _NM_A_A / _A_A_UNIT)
        self._write(motor, axis.id, _GOAL_CURRENT, struct.pack("<h", current))

    def _keep(self, motor: int, drive_id: int, address: int, data: bytes) -> None:
        """Write a register that lives in EEPROM, but only when it differs: its cells wear."""
        present = self._read_registers(drive_id, address, len(data))
        if present is None:
            raise BusError(f"motor {motor} (id {drive_id}) does not answer")
        if present != data:
            self._write(motor, drive_id, address, data)

    def _write(self, motor: int, drive_id: int, address: int, data: bytes) -> None:
        request = encode(drive_id, _WRITE, struct.pack("<H", address) + data)
        status = self._transact(request, [drive_id], 0)
        if drive_id not in status:
            raise BusError(f"motor {motor} (id {drive_id}) does not answer")
        error = status[drive_id][1] & 0x7F
        if error:
            raise BusError(f"motor {motor} (id {drive_id}) refused register {address} (error {error})")

    # -- packets --------------------------------------------------------------------------------------------------

    def _sync_write(self, address: int, values: Sequence[bytes]) -> None:
        data = b"".join(bytes([drive_id]) + value for drive_id, value in zip(self._ids, values, strict=True))
        self._open_line().send(encode(_BROADCAST, _SYNC_WRITE, struct.pack("<HH", address, len(values[0])) + data))

    def _read_registers(self, drive_id: int, address: int, length: int) -> bytes | None:
        request = encode(drive_id, _READ, struct.pack("<HH", address, length))
        reply = self._exchange(request, [drive_id], length).get(drive_id)
        return reply[1] if reply else None

    def _exchange(self, request: bytes, ids: Sequence[int], length: int) -> dict[int, tuple[int, bytes]]:
        """Time and data of each drive that answered with ``length`` bytes and no error."""
        replies = self._transact(request, ids, length)
        sound = {
            drive_id: (t_ns, data)
            for drive_id, (t_ns, error, data) in replies.items()
            if not error & 0x7F and len(data) == length
        }
        self.errors += len(ids) - len(sound)
        return sound

    def _transact(self, request: bytes, ids: Sequence[int], length: int) -> dict[int, tuple[int, int, bytes]]:
        """Send, and collect each drive's status packet until all are here or the deadline worked out from bytes."""
        line = self._open_line()
        line.send(request)
        waits_ns = len(ids) * self._config.return_delay_us * 1000
        deadline = line.deadline_ns(len(request), len(ids) * (_OVERHEAD + length), waits_ns)
        parser = StatusParser()
        replies: dict[int, tuple[int, int, bytes]] = {}
        while len(replies) < len(ids):
            data = line.receive(deadline)
            t_ns = time.monotonic_ns()
            if not data:
                break
            for drive_id, error, payload in parser.feed(data):
                if drive_id in ids:
                    replies[drive_id] = (t_ns, error, payload)
        return replies

    def _open_line(self) -> SerialLine:
        if self._line is None:
            raise BusError(f"{self._config.port} is not open")
        return self._line
