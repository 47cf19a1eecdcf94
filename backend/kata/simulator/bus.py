"""How the five servos behave together on one line: who answers, in which order, and when.

Times follow the bytes: an instruction counts when its last byte has passed, an answer is there when its last byte has.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from kata.simulator import protocol
from kata.simulator.apparatus import Apparatus
from kata.simulator.protocol import Instruction
from kata.simulator.servos import STATUS_LEVEL, Servo

_BITS_A_BYTE: Final = 10
_ANSWERS_READS: Final = 1
_ANSWERS_ALL: Final = 2


@dataclass(frozen=True)
class Answer:
    """Bytes, and how long after the end of the instruction the last of them is out, in seconds."""

    data: bytes
    after_s: float


class ServoBus:
    """Carries instructions to the servos and their answers back."""

    def __init__(self, apparatus: Apparatus) -> None:
        self._apparatus = apparatus
        self._registered: dict[int, tuple[int, bytes]] = {}

    def byte_s(self, baud: int) -> float:
        """One byte's time on the wire."""
        return _BITS_A_BYTE / baud

    def carry_out(self, instruction: Instruction, baud: int, now_ns: int) -> list[Answer]:
        """What the drives that listen at this baud rate do and answer."""
        listening = {servo.id: servo for servo in self._apparatus.servos if servo.baud == baud}
        if not instruction.sound:
            addressed = listening.get(instruction.drive_id)
            if addressed is None:
                return []
            error = protocol.status(addressed.id, addressed.alert | protocol.CRC_ERROR)
            return list(self._in_turn([(addressed, error)], baud))
        self._apparatus.heard(now_ns)
        for servo in listening.values():
            servo.heard()
        match instruction.code:
            case protocol.SYNC_READ:
                answers = _packets(self._read_in_turn(listening, _same_for_all(instruction.parameters)))
            case protocol.FAST_SYNC_READ:
                answers = self._fast_sync_read(listening, instruction.parameters)
            case protocol.BULK_READ:
                answers = _packets(self._read_in_turn(listening, _one_each(instruction.parameters)))
            case protocol.SYNC_WRITE:
                self._sync_write(listening, instruction.parameters, now_ns)
                answers = []
            case protocol.BULK_WRITE:
                self._bulk_write(listening, instruction.parameters, now_ns)
                answers = []
            case _:
                answers = self._single(listening, instruction, now_ns)
        return list(self._in_turn(answers, baud))

    def _in_turn(self, answers: Sequence[tuple[Servo, bytes]], baud: int) -> Iterator[Answer]:
        after_s = 0.0
        for servo, data in answers:
            after_s += servo.return_delay_s + len(data) * self.byte_s(baud)
            yield Answer(data, after_s)

    def _single(self, listening: dict[int, Servo], instruction: Instruction, now_ns: int) -> list[tuple[Servo, bytes]]:
        """Instructions for one drive, or for all by the broadcast address, which only a ping has answered."""
        broadcast = instruction.drive_id == protocol.BROADCAST
        addressed = (
            list(listening.values()) if broadcast else [listening[i] for i in (instruction.drive_id,) if i in listening]
        )
        answers = []
        for servo in addressed:
            error, data = self._one(servo, instruction, now_ns)
            reads = instruction.code in (protocol.PING, protocol.READ)
            level = servo.table[STATUS_LEVEL]
            if instruction.code == protocol.PING or (
                not broadcast and (level == _ANSWERS_ALL or (reads and level == _ANSWERS_READS))
            ):
                answers.append((servo, protocol.status(servo.id, servo.alert | error, data)))
        return answers

    def _one(self, servo: Servo, instruction: Instruction, now_ns: int) -> tuple[int, bytes]:
        parameters = instruction.parameters
        match instruction.code:
            case protocol.PING:
                return 0, bytes(servo.table[0:2] + servo.table[6:7])
            case protocol.READ if len(parameters) == 4:
                return servo.read(_word(parameters, 0), _word(parameters, 2))
            case protocol.WRITE if len(parameters) > 2:
                return self._apparatus.write(servo, _word(parameters, 0), parameters[2:], now_ns), b""
            case protocol.REG_WRITE if len(parameters) > 2:
                self._registered[servo.id] = (_word(parameters, 0), parameters[2:])
                return 0, b""
            case protocol.ACTION:
                if servo.id in self._registered:
                    return self._apparatus.write(servo, *self._registered.pop(servo.id), now_ns), b""
                return 0, b""
            case protocol.REBOOT:
                self._apparatus.reboot(servo, now_ns)
                return 0, b""
            case protocol.READ | protocol.WRITE | protocol.REG_WRITE:
                return protocol.DATA_LENGTH_ERROR, b""
            case _:
                return protocol.INSTRUCTION_ERROR, b""

    def _read_in_turn(
        self, listening: dict[int, Servo], wanted: Sequence[tuple[int, int, int]]
    ) -> list[tuple[Servo, int, bytes]]:
        """Each named drive waits for the one named before it: a silent one silences all that follow."""
        answers = []
        for drive_id, address, length in wanted:
            servo = listening.get(drive_id)
            if servo is None or servo.table[STATUS_LEVEL] == 0:
                break
            error, data = servo.read(address, length)
            answers.append((servo, servo.alert | error, data))
        return answers

    def _fast_sync_read(self, listening: dict[int, Servo], parameters: bytes) -> list[tuple[Servo, bytes]]:
        wanted = _same_for_all(parameters)
        if not wanted:
            return []
        length = wanted[0][2]
        # What cannot be read is filled up: the packet's length is promised before the first drive has answered.
        answers = [(s, error, data.ljust(length, b"\0")) for s, error, data in self._read_in_turn(listening, wanted)]
        blocks = protocol.fast_blocks([(s.id, error, data) for s, error, data in answers], len(wanted), length)
        return [(servo, block) for (servo, _, _), block in zip(answers, blocks, strict=True)]

    def _sync_write(self, listening: dict[int, Servo], parameters: bytes, now_ns: int) -> None:
        if len(parameters) < 4:
            return
        address, length = _word(parameters, 0), _word(parameters, 2)
        for start in range(4, len(parameters) - length, length + 1):
            servo = listening.get(parameters[start])
            if servo is not None:
                self._apparatus.write(servo, address, parameters[start + 1 : start + 1 + length], now_ns)

    def _bulk_write(self, listening: dict[int, Servo], parameters: bytes, now_ns: int) -> None:
        start = 0
        while start + 5 <= len(parameters):
            length = _word(parameters, start + 3)
            data = parameters[start + 5 : start + 5 + length]
            servo = listening.get(parameters[start])
            if servo is not None and len(data) == length:
                self._apparatus.write(servo, _word(parameters, start + 1), data, now_ns)
            start += 5 + length


def _packets(answers: Sequence[tuple[Servo, int, bytes]]) -> list[tuple[Servo, bytes]]:
    return [(servo, protocol.status(servo.id, error, data)) for servo, error, data in answers]


def _same_for_all(parameters: bytes) -> list[tuple[int, int, int]]:
    """Drive id, address and length of each part of a Sync Read."""
    if len(parameters) < 5:
        return []
    return [(drive_id, _word(parameters, 0), _word(parameters, 2)) for drive_id in parameters[4:]]


def _one_each(parameters: bytes) -> list[tuple[int, int, int]]:
    """Drive id, address and length of each part of a Bulk Read."""
    starts = range(0, len(parameters) - 4, 5)
    return [(parameters[n], _word(parameters, n + 1), _word(parameters, n + 3)) for n in starts]


def _word(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 2], "little")
