"""Finds the end of each message and its time, by the rules of each protocol."""

from collections import deque
from collections.abc import Iterator
from typing import Final, Protocol

from kata.simulator import modbus
from kata.simulator.bus import ServoBus
from kata.simulator.bus_answer import BusAnswer, transmission_s
from kata.simulator.modbus_bus import SimulatedModbusBus
from kata.simulator.protocol import Instruction, InstructionParser

_BYTE_GAP_NS: Final = 5_000_000
"""Longest gap within a packet. After a longer gap the packet is dropped, because its length was damaged or its sender is gone."""


class BusLine(Protocol):
    """A protocol as the simulated wire uses it. Times are in ns. ``baud``: the sender's rate, 0 if unknown."""

    @property
    def due_ns(self) -> int | None:
        """Time at which the drives have received the next message; None if no message is incoming."""

    def receive(self, data: bytes, now_ns: int, baud: int) -> None:
        """Receive bytes. Their transmission begins after that of earlier bytes."""

    def execute(self, now_ns: int) -> Iterator[tuple[int, BusAnswer]]:
        """Execute the messages received until now. Yield each answer with the time of its message."""


class DynamixelLine:
    """Dynamixel: a packet contains its length, and is received when its last byte arrives."""

    def __init__(self, bus: ServoBus) -> None:
        self._bus = bus
        self._parser = InstructionParser()
        self._incoming: deque[tuple[int, int, Instruction]] = deque()
        self._busy_until_ns = 0
        self._received_ns = 0

    @property
    def due_ns(self) -> int | None:
        """See :class:`BusLine`."""
        return self._incoming[0][0] if self._incoming else None

    def receive(self, data: bytes, now_ns: int, baud: int) -> None:
        """See :class:`BusLine`."""
        if now_ns - self._received_ns > _BYTE_GAP_NS:
            self._parser.reset()
        self._received_ns = now_ns
        for instruction in self._parser.feed(data):
            self._busy_until_ns = max(self._busy_until_ns, now_ns) + _transmission_ns(instruction.size, baud)
            self._incoming.append((self._busy_until_ns, baud, instruction))

    def execute(self, now_ns: int) -> Iterator[tuple[int, BusAnswer]]:
        """See :class:`BusLine`."""
        while self._incoming and self._incoming[0][0] <= now_ns:
            at_ns, baud, instruction = self._incoming.popleft()
            for answer in self._bus.execute(instruction, baud, at_ns):
                self._busy_until_ns = max(self._busy_until_ns, at_ns + int(answer.after_s * 1e9))
                yield at_ns, answer


class ModbusLine:
    """Modbus: a silence ends a frame. The frame is received at the end of the silence."""

    def __init__(self, bus: SimulatedModbusBus) -> None:
        self._bus = bus
        self._frame = bytearray()
        self._baud = 0
        self._sent_ns = 0
        self._silent_ns = 0
        """End of the silence after the frame."""
        self._incoming: deque[tuple[int, int, bytes]] = deque()

    @property
    def due_ns(self) -> int | None:
        """See :class:`BusLine`."""
        if self._incoming:
            return self._incoming[0][0]
        return self._silent_ns if self._frame else None

    def receive(self, data: bytes, now_ns: int, baud: int) -> None:
        """See :class:`BusLine`."""
        self._end_frame(now_ns)
        self._sent_ns = max(self._sent_ns, now_ns) + _transmission_ns(len(data), baud)
        self._silent_ns = self._sent_ns + (int(modbus.silence_s(baud) * 1e9) if baud else 0)
        self._baud = baud
        if len(self._frame) <= modbus.MAX_FRAME_BYTES:  # Longer frames are invalid.
            self._frame += data

    def execute(self, now_ns: int) -> Iterator[tuple[int, BusAnswer]]:
        """See :class:`BusLine`."""
        self._end_frame(now_ns)
        while self._incoming:
            at_ns, baud, received = self._incoming.popleft()
            if request := modbus.parse(received):
                for answer in self._bus.execute(request, baud, at_ns):
                    yield at_ns, answer

    def _end_frame(self, now_ns: int) -> None:
        if self._frame and now_ns >= self._silent_ns:
            self._incoming.append((self._silent_ns, self._baud, bytes(self._frame)))
            self._frame.clear()


def _transmission_ns(count: int, baud: int) -> int:
    return int(transmission_s(count, baud) * 1e9) if baud else 0
