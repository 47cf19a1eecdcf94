"""How the five Modbus drives behave together on one line: who answers, and what."""

import struct
from collections.abc import Sequence
from typing import Final

from kata.simulator import modbus
from kata.simulator.answers import Answer, bytes_s
from kata.simulator.apparatus import Apparatus
from kata.simulator.modbus import ILLEGAL_FUNCTION, ILLEGAL_VALUE, RefusedError, Request
from kata.simulator.modbus_drive import ModbusDrive
from kata.simulator.script import Script

_MOST_INPUTS: Final = 2000
_MOST_READ: Final = 125
_MOST_WRITTEN: Final = 123
_MOST_WRITTEN_AND_READ: Final = 121
_BROADCASTS: Final = (modbus.WRITE_SINGLE_REGISTER, modbus.WRITE_MULTIPLE_REGISTERS)


class ModbusBus:
    """Carries requests to the drives and their answers back. Needs no wire and no clock but ``now_ns``."""

    def __init__(self, apparatus: Apparatus, baud: int = 1_000_000) -> None:
        """``baud`` is what the drives listen at."""
        self._apparatus = apparatus
        self._baud = baud
        self.drives = [ModbusDrive(drive) for drive in apparatus.drives]
        self.script = Script(apparatus, self.drives)

    def carry_out(self, request: Request, baud: int, now_ns: int) -> list[Answer]:
        """What the drives do and answer, if they listen at this baud rate."""
        self._apparatus.advance(now_ns)
        if baud != self._baud:
            return []
        listening = [one for one in self.drives if not self.script.has("off", one.drive.motor)]
        self._apparatus.heard(now_ns)
        for one in listening:
            one.drive.heard()
        if request.slave == modbus.BROADCAST:
            if request.function in _BROADCASTS:
                for one in listening:
                    _answer(one, request)
            return []
        return [
            self._in_time(one, _answer(one, request))
            for one in listening
            if one.slave == request.slave and self._answers(one, request)
        ]

    def _answers(self, one: ModbusDrive, request: Request) -> bool:
        inputs = request.function == modbus.READ_DISCRETE_INPUTS
        if self.script.answers(one.drive.motor, inputs=inputs):
            return True
        _answer(one, request)  # It does what it is told, and nobody hears of it.
        return False

    def _in_time(self, one: ModbusDrive, answer: bytes) -> Answer:
        late_s, data = self.script.spoil(one.drive.motor, answer)
        return Answer(data, one.response_delay_s + late_s + bytes_s(len(data), self._baud))


def _answer(one: ModbusDrive, request: Request) -> bytes:
    """The whole frame, also of a refusal."""
    slave, function = one.slave, request.function
    try:
        return modbus.frame(slave, function, _carried_out(one, function, request.data))
    except RefusedError as refused:
        return modbus.exception(slave, function, refused.code)


def _carried_out(one: ModbusDrive, function: int, data: bytes) -> bytes:
    match function:
        case modbus.READ_DISCRETE_INPUTS:
            address, count = _words(data, 2)
            _check(1 <= count <= _MOST_INPUTS)
            bits = sum(closed << n for n, closed in enumerate(one.inputs(address, count)))
            size = (count + 7) // 8
            return bytes([size]) + bits.to_bytes(size, "little")
        case modbus.READ_HOLDING_REGISTERS:
            address, count = _words(data, 2)
            _check(1 <= count <= _MOST_READ)
            return _registers(one.read(address, count))
        case modbus.WRITE_SINGLE_REGISTER:
            address, value = _words(data, 2)
            one.write(address, [value])
            return data
        case modbus.WRITE_MULTIPLE_REGISTERS:
            address, *values = _block(data, _MOST_WRITTEN)
            one.write(address, values)
            return data[:4]
        case modbus.READ_WRITE_MULTIPLE_REGISTERS:
            address, count = _words(data[:4], 2)
            _check(1 <= count <= _MOST_READ)
            one.read(address, count)  # Refused before anything is written.
            to_address, *values = _block(data[4:], _MOST_WRITTEN_AND_READ)
            one.write(to_address, values)
            return _registers(one.read(address, count))
        case _:
            raise RefusedError(ILLEGAL_FUNCTION)


def _check(condition: bool) -> None:
    if not condition:
        raise RefusedError(ILLEGAL_VALUE)


def _words(data: bytes, count: int) -> tuple[int, ...]:
    _check(len(data) == 2 * count)
    return struct.unpack(f">{count}H", data)


def _block(data: bytes, most: int) -> tuple[int, ...]:
    """Address and values out of address, quantity, byte count, values."""
    address, count = _words(data[:4], 2)
    _check(1 <= count <= most and data[4:5] == bytes([2 * count]))
    return (address, *_words(data[5:], count))


def _registers(values: Sequence[int]) -> bytes:
    return struct.pack(f">B{len(values)}H", 2 * len(values), *values)
