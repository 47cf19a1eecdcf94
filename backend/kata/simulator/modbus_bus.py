"""Simulates the five Modbus drives on one bus: which of them answer, and how."""

import struct
from collections.abc import Sequence
from typing import Final

from kata.simulator import modbus
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus_answer import BusAnswer, transmission_s
from kata.simulator.fault_injector import FaultInjector
from kata.simulator.modbus import ILLEGAL_FUNCTION, ILLEGAL_VALUE, ModbusRequest, RefusedError
from kata.simulator.modbus_drive import ModbusDrive

_MAX_INPUTS: Final = 2000
_MAX_READ: Final = 125
_MAX_WRITTEN: Final = 123
_MAX_WRITTEN_AND_READ: Final = 121
_BROADCASTS: Final = (modbus.WRITE_SINGLE_REGISTER, modbus.WRITE_MULTIPLE_REGISTERS)


class SimulatedModbusBus:
    """Executes requests at the drives and returns their answers. The caller passes the time as ``now_ns``."""

    def __init__(self, apparatus: SimulatedApparatus, baud: int = 1_000_000) -> None:
        """Create the drives. ``baud``: their rate."""
        self._apparatus = apparatus
        self._baud = baud
        self.drives = [ModbusDrive(drive) for drive in apparatus.drives]
        self.faults = FaultInjector(apparatus, self.drives)

    def execute(self, request: ModbusRequest, baud: int, now_ns: int) -> list[BusAnswer]:
        """Execute a request and return the answers. Drives do not react to another baud rate."""
        self._apparatus.advance(now_ns)
        if baud != self._baud:
            return []
        off = self.faults.off
        listening = [drive for drive in self.drives if drive.drive.motor not in off] if off else self.drives
        self._apparatus.heard(now_ns)
        for drive in listening:
            drive.drive.feed_watchdog()
        if request.slave == modbus.BROADCAST:
            if request.function in _BROADCASTS:
                for drive in listening:
                    _answer(drive, request)
            return []
        return [
            self._timed(drive, _answer(drive, request))
            for drive in listening
            if drive.slave == request.slave and self._answers(drive, request)
        ]

    def _answers(self, drive: ModbusDrive, request: ModbusRequest) -> bool:
        inputs = request.function == modbus.READ_DISCRETE_INPUTS
        if self.faults.answers(drive.drive.motor, inputs=inputs):
            return True
        _answer(drive, request)  # The drive executes the request without an answer.
        return False

    def _timed(self, drive: ModbusDrive, answer: bytes) -> BusAnswer:
        late_s, data = self.faults.corrupt(drive.drive.motor, answer)
        return BusAnswer(data, drive.response_delay_s + late_s + transmission_s(len(data), self._baud))


def _answer(drive: ModbusDrive, request: ModbusRequest) -> bytes:
    """Execute a request. Return the answer's frame, or an exception frame after a refusal."""
    slave, function = drive.slave, request.function
    try:
        return modbus.frame(slave, function, _execute(drive, function, request.data))
    except RefusedError as refused:
        return modbus.exception(slave, function, refused.code)


def _execute(drive: ModbusDrive, function: int, data: bytes) -> bytes:
    match function:
        case modbus.READ_DISCRETE_INPUTS:
            address, count = _words(data, 2)
            _check(1 <= count <= _MAX_INPUTS)
            bits = sum(closed << n for n, closed in enumerate(drive.inputs(address, count)))
            size = (count + 7) // 8
            return bytes([size]) + bits.to_bytes(size, "little")
        case modbus.READ_HOLDING_REGISTERS:
            address, count = _words(data, 2)
            _check(1 <= count <= _MAX_READ)
            return _registers(drive.read(address, count))
        case modbus.WRITE_SINGLE_REGISTER:
            address, value = _words(data, 2)
            drive.write(address, [value])
            return data
        case modbus.WRITE_MULTIPLE_REGISTERS:
            address, *values = _block(data, _MAX_WRITTEN)
            drive.write(address, values)
            return data[:4]
        case modbus.READ_WRITE_MULTIPLE_REGISTERS:
            address, count = _words(data[:4], 2)
            _check(1 <= count <= _MAX_READ)
            drive.read(address, count)  # Refuse the request before writing anything.
            to_address, *values = _block(data[4:], _MAX_WRITTEN_AND_READ)
            drive.write(to_address, values)
            return _registers(drive.read(address, count))
        case _:
            raise RefusedError(ILLEGAL_FUNCTION)


def _check(condition: bool) -> None:
    if not condition:
        raise RefusedError(ILLEGAL_VALUE)


def _words(data: bytes, count: int) -> tuple[int, ...]:
    _check(len(data) == 2 * count)
    return struct.unpack(f">{count}H", data)


def _block(data: bytes, most: int) -> tuple[int, ...]:
    """Return address and values. ``data`` contains address, quantity, byte count and values."""
    address, count = _words(data[:4], 2)
    _check(1 <= count <= most and data[4:5] == bytes([2 * count]))
    return (address, *_words(data[5:], count))


def _registers(values: Sequence[int]) -> bytes:
    return struct.pack(f">B{len(values)}H", 2 * len(values), *values)
