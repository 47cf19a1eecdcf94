"""A line whose drives answer every request and store every register: it records what a driver writes."""

import struct
from collections import defaultdict
from typing import Final

from fastcrc import crc16

from kata.device.bus.dynamixel import packets as dynamixel
from kata.device.bus.modbus import frames as modbus
from kata.device.config import StationConfig

_FIRMWARE: Final = 48
_PACKET_START: Final = b"\xff\xff\xfd\x00"


class AnsweringLine:
    """A :class:`~kata.device.bus.serial_transport.Transport` to drives that answer at once, with the station's ids and models."""

    def __init__(self, config: StationConfig) -> None:
        self._modbus = config.protocol == "modbus"
        self._ids = [axis.id for axis in config.axes]
        self._now_ns = 0
        self._answer = b""
        self.registers: dict[int, defaultdict[int, int]] = {drive_id: defaultdict(int) for drive_id in self._ids}
        """Registers by drive and address: bytes (Dynamixel) or words (Modbus)."""
        for axis in config.axes:
            if not self._modbus:
                self._store(axis.id, 0, struct.pack("<H4xB", axis.model, _FIRMWARE))

    def now_ns(self) -> int:
        return self._now_ns

    def send(self, data: bytes) -> None:
        self._answer += self._modbus_answer(data) if self._modbus else self._dynamixel_answer(data)

    def receive(self, earliest_ns: int, deadline_ns: int) -> bytes:
        answer, self._answer = self._answer, b""
        self._now_ns = max(self._now_ns, earliest_ns if answer else deadline_ns)
        return answer

    def close(self) -> None:
        pass

    def _store(self, drive_id: int, address: int, data: bytes) -> None:
        self.registers[drive_id].update(enumerate(data, start=address))

    def _read(self, drive_id: int, address: int, length: int) -> bytes:
        return bytes(self.registers[drive_id][n] for n in range(address, address + length))

    # -- Dynamixel Protocol 2.0 -------------------------------------------------------------------------------------

    def _dynamixel_answer(self, packet: bytes) -> bytes:
        assert packet.startswith(_PACKET_START)
        drive_id, instruction = packet[4], packet[7]
        parameters = packet[8:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
        address = int.from_bytes(parameters[:2], "little")
        if drive_id == 0xFE:
            return self._sync(instruction, address, parameters)
        data = b""
        if instruction == 0x01:
            data = self._read(drive_id, 0, 2) + b"\x00"
        elif instruction == 0x02:
            data = self._read(drive_id, address, int.from_bytes(parameters[2:4], "little"))
        elif instruction == 0x03:
            self._store(drive_id, address, parameters[2:])
        return _status(drive_id, data)

    def _sync(self, instruction: int, address: int, parameters: bytes) -> bytes:
        length = int.from_bytes(parameters[2:4], "little")
        if instruction == 0x82:
            return b"".join(_status(drive_id, self._read(drive_id, address, length)) for drive_id in parameters[4:])
        if instruction == 0x83:
            for start in range(4, len(parameters), length + 1):
                self._store(parameters[start], address, parameters[start + 1 : start + 1 + length])
        return b""

    # -- Modbus RTU -------------------------------------------------------------------------------------------------

    def _modbus_answer(self, frame: bytes) -> bytes:
        assert crc16.modbus(frame[:-2]) == int.from_bytes(frame[-2:], "little")
        slave, function, data = frame[0], frame[1], frame[2:-2]
        if function == 0x10:
            for drive_id in [slave] if slave else self._ids:
                self._store_words(drive_id, data)
            return modbus.encode(slave, function, data[:4]) if slave else b""
        address, count = struct.unpack(">HH", data[:4])
        if function == 0x02:
            size = (count + 7) // 8
            return modbus.encode(slave, function, bytes([size]) + bytes(size))
        if function == 0x17:
            self._store_words(slave, data[4:])
        words = (self.registers[slave][n] for n in range(address, address + count))
        return modbus.encode(slave, function, bytes([2 * count]) + b"".join(struct.pack(">H", word) for word in words))

    def _store_words(self, drive_id: int, written: bytes) -> None:
        address, count, size = struct.unpack(">HHB", written[:5])
        assert size == 2 * count == len(written) - 5
        self.registers[drive_id].update(enumerate(struct.unpack(f">{count}H", written[5:]), start=address))


def _status(drive_id: int, data: bytes) -> bytes:
    return dynamixel.encode(drive_id, 0x55, b"\x00" + data)
