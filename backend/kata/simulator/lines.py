"""When the drives have heard something: bytes take their time, and each protocol has its own end of a message."""

from collections import deque
from collections.abc import Iterator
from typing import Final, Protocol

from kata.simulator import modbus
from kata.simulator.answers import Answer, bytes_s
from kata.simulator.bus import ServoBus
from kata.simulator.modbus_bus import ModbusBus
from kata.simulator.protocol import Instruction, InstructionParser

_BYTE_GAP_NS: Final = 5_000_000
"""A packet whose next bytes stay away for longer is given up: its length was damaged, or its sender has gone."""


class Line(Protocol):
    """What the wire wants of a protocol. Times in ns; ``baud`` is what the sender has set, 0 when nobody knows it."""

    @property
    def due_ns(self) -> int | None:
        """When the drives will have heard what is on its way to them."""

    def hear(self, data: bytes, now_ns: int, baud: int) -> None:
        """Bytes begin to pass, after those that still do."""

    def carry_out(self, now_ns: int) -> Iterator[tuple[int, Answer]]:
        """What was heard until now is done; when it was heard, and what was answered."""


class DynamixelLine:
    """A packet says how long it is: it is heard when its last byte has passed."""

    def __init__(self, bus: ServoBus) -> None:
        self._bus = bus
        self._parser = InstructionParser()
        self._coming: deque[tuple[int, int, Instruction]] = deque()
        self._busy_until_ns = 0
        self._heard_ns = 0

    @property
    def due_ns(self) -> int | None:
        """See :class:`Line`."""
        return self._coming[0][0] if self._coming else None

    def hear(self, data: bytes, now_ns: int, baud: int) -> None:
        """See :class:`Line`."""
        if now_ns - self._heard_ns > _BYTE_GAP_NS:
            self._parser.forget()
        self._heard_ns = now_ns
        for instruction in self._parser.feed(data):
            self._busy_until_ns = max(self._busy_until_ns, now_ns) + _span_ns(instruction.size, baud)
            self._coming.append((self._busy_until_ns, baud, instruction))

    def carry_out(self, now_ns: int) -> Iterator[tuple[int, Answer]]:
        """See :class:`Line`."""
        while self._coming and self._coming[0][0] <= now_ns:
            at_ns, baud, instruction = self._coming.popleft()
            for answer in self._bus.carry_out(instruction, baud, at_ns):
                self._busy_until_ns = max(self._busy_until_ns, at_ns + int(answer.after_s * 1e9))
                yield at_ns, answer


class ModbusLine:
    """A frame ends with a silence: it is heard when that is over."""

    def __init__(self, bus: ModbusBus) -> None:
        self._bus = bus
        self._frame = bytearray()
        self._baud = 0
        self._passed_ns = 0
        self._coming: deque[tuple[int, int, bytes]] = deque()

    @property
    def due_ns(self) -> int | None:
        """See :class:`Line`."""
        if self._coming:
            return self._coming[0][0]
        return self._silent_ns if self._frame else None

    def hear(self, data: bytes, now_ns: int, baud: int) -> None:
        """See :class:`Line`."""
        self._end_frame(now_ns)
        self._passed_ns = max(self._passed_ns, now_ns) + _span_ns(len(data), baud)
        self._baud = baud
        if len(self._frame) <= modbus.LONGEST:  # Longer ones are lost anyway.
            self._frame += data

    def carry_out(self, now_ns: int) -> Iterator[tuple[int, Answer]]:
        """See :class:`Line`."""
        self._end_frame(now_ns)
        while self._coming:
            at_ns, baud, heard = self._coming.popleft()
            if request := modbus.parse(heard):
                for answer in self._bus.carry_out(request, baud, at_ns):
                    yield at_ns, answer

    @property
    def _silent_ns(self) -> int:
        return self._passed_ns + (int(modbus.silence_s(self._baud) * 1e9) if self._baud else 0)

    def _end_frame(self, now_ns: int) -> None:
        if self._frame and now_ns >= self._silent_ns:
            self._coming.append((self._silent_ns, self._baud, bytes(self._frame)))
            self._frame.clear()


def _span_ns(count: int, baud: int) -> int:
    return int(bytes_s(count, baud) * 1e9) if baud else 0
