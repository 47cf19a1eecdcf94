"""The five servos on one bus: which of them answer, in which order, and when.

An instruction is received, and an answer complete, with its last byte.
"""

from collections.abc import Iterator, Sequence
from typing import Final

from kata.simulator import protocol
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus_answer import BusAnswer, transmission_s
from kata.simulator.fault_injector import FaultInjector
from kata.simulator.protocol import Instruction
from kata.simulator.servos import END, PORT_DATA, STATUS_LEVEL, Servo

_LEVEL_READS: Final = 1
_LEVEL_ALL: Final = 2


class ServoBus:
    """Executes instructions at the servos and returns their answers. Its only clock is ``now_ns``."""

    def __init__(self, apparatus: SimulatedApparatus, baud: int = 1_000_000) -> None:
        """``baud``: the servos' rate at first.

        :raises ValueError: when the servos do not support it.
        """
        self._apparatus = apparatus
        self.servos = [Servo(drive, baud) for drive in apparatus.drives]
        self.faults = FaultInjector(apparatus, self.servos)

    def execute(self, instruction: Instruction, baud: int, now_ns: int) -> list[BusAnswer]:
        """Execute an instruction at the drives with this baud rate and return their answers."""
        self._apparatus.advance(now_ns)
        off = self.faults.off
        listening = {servo.id: servo for servo in self.servos if servo.baud == baud and servo.drive.motor not in off}
        if not instruction.valid:
            addressed = listening.get(instruction.drive_id)
            if addressed is None or not self.faults.answers(addressed.drive.motor):
                return []
            error = protocol.status(addressed.id, addressed.alert | protocol.CRC_ERROR)
            return list(self._timed([(addressed, error)], baud))
        self._apparatus.heard(now_ns)
        for servo in listening.values():
            servo.drive.feed_watchdog()
        match instruction.code:
            case protocol.SYNC_READ:
                answers = _packets(self._read_in_order(listening, _sync_read_parts(instruction.parameters), now_ns))
            case protocol.FAST_SYNC_READ:
                answers = self._fast_sync_read(listening, instruction.parameters, now_ns)
            case protocol.BULK_READ:
                answers = _packets(self._read_in_order(listening, _bulk_read_parts(instruction.parameters), now_ns))
            case protocol.SYNC_WRITE:
                self._sync_write(listening, instruction.parameters)
                answers = []
            case protocol.BULK_WRITE:
                self._bulk_write(listening, instruction.parameters)
                answers = []
            case _:
                answers = self._single(listening, instruction, now_ns)
        return list(self._timed(answers, baud))

    def _timed(self, answers: Sequence[tuple[Servo, bytes]], baud: int) -> Iterator[BusAnswer]:
        after_s = 0.0
        for servo, answer in answers:
            late_s, data = self.faults.corrupt(servo.drive.motor, answer)
            after_s += servo.return_delay_s + late_s + transmission_s(len(data), baud)
            yield BusAnswer(data, after_s)

    def _single(self, listening: dict[int, Servo], instruction: Instruction, now_ns: int) -> list[tuple[Servo, bytes]]:
        """Execute an instruction for one drive, or for all by the broadcast address, to which only a ping is answered."""
        broadcast = instruction.drive_id == protocol.BROADCAST
        addressed = (
            list(listening.values()) if broadcast else [listening[i] for i in (instruction.drive_id,) if i in listening]
        )
        answers = []
        for servo in addressed:
            error, data = self._execute_at(servo, instruction, now_ns)
            level = servo.table[STATUS_LEVEL]
            reads = instruction.code == protocol.READ
            wanted = not broadcast and (level == _LEVEL_ALL or (reads and level == _LEVEL_READS))
            if (instruction.code == protocol.PING or wanted) and self.faults.answers(
                servo.drive.motor, inputs=reads and _reads_inputs(servo, *_range(instruction.parameters))
            ):
                answers.append((servo, protocol.status(servo.id, servo.alert | error, data)))
        return answers

    def _execute_at(self, servo: Servo, instruction: Instruction, now_ns: int) -> tuple[int, bytes]:
        parameters = instruction.parameters
        match instruction.code:
            case protocol.PING:
                return 0, bytes(servo.table[0:2] + servo.table[6:7])
            case protocol.READ if len(parameters) == 4:
                return servo.read(_word(parameters, 0), _word(parameters, 2), now_ns)
            case protocol.WRITE if len(parameters) > 2:
                return servo.write(_word(parameters, 0), parameters[2:]), b""
            case protocol.REG_WRITE if len(parameters) > 2:
                servo.registered = (_word(parameters, 0), parameters[2:])
                return 0, b""
            case protocol.ACTION:
                registered, servo.registered = servo.registered, None
                return (servo.write(*registered) if registered else 0), b""
            case protocol.REBOOT:
                servo.reboot()
                return 0, b""
            case protocol.READ | protocol.WRITE | protocol.REG_WRITE:
                return protocol.DATA_LENGTH_ERROR, b""
            case _:
                return protocol.INSTRUCTION_ERROR, b""

    def _read_in_order(
        self, listening: dict[int, Servo], wanted: Sequence[tuple[int, int, int]], now_ns: int
    ) -> list[tuple[Servo, int, bytes]]:
        """Read the named drives in order. Each waits for the drive before it, so a silent drive silences all that follow."""
        answers = []
        for drive_id, address, length in wanted:
            servo = listening.get(drive_id)
            if servo is None or servo.table[STATUS_LEVEL] == 0:
                break
            if not self.faults.answers(servo.drive.motor, inputs=_reads_inputs(servo, address, length)):
                break
            error, data = servo.read(address, length, now_ns)
            answers.append((servo, servo.alert | error, data))
        return answers

    def _fast_sync_read(self, listening: dict[int, Servo], parameters: bytes, now_ns: int) -> list[tuple[Servo, bytes]]:
        wanted = _sync_read_parts(parameters)
        if not wanted or (length := wanted[0][2]) > END:
            return []  # The length field of the header cannot hold such a length.
        # Pad unreadable data: the header already contains the packet's length.
        answers = [
            (s, error, data.ljust(length, b"\0")) for s, error, data in self._read_in_order(listening, wanted, now_ns)
        ]
        blocks = protocol.fast_blocks([(s.id, error, data) for s, error, data in answers], len(wanted), length)
        return [(servo, block) for (servo, _, _), block in zip(answers, blocks, strict=True)]

    def _sync_write(self, listening: dict[int, Servo], parameters: bytes) -> None:
        if len(parameters) < 4:
            return
        address, length = _word(parameters, 0), _word(parameters, 2)
        for start in range(4, len(parameters) - length, length + 1):
            servo = listening.get(parameters[start])
            if servo is not None:
                servo.write(address, parameters[start + 1 : start + 1 + length])

    def _bulk_write(self, listening: dict[int, Servo], parameters: bytes) -> None:
        start = 0
        while start + 5 <= len(parameters):
            length = _word(parameters, start + 3)
            data = parameters[start + 5 : start + 5 + length]
            servo = listening.get(parameters[start])
            if servo is not None and len(data) == length:
                servo.write(_word(parameters, start + 1), data)
            start += 5 + length


def _packets(answers: Sequence[tuple[Servo, int, bytes]]) -> list[tuple[Servo, bytes]]:
    return [(servo, protocol.status(servo.id, error, data)) for servo, error, data in answers]


def _sync_read_parts(parameters: bytes) -> list[tuple[int, int, int]]:
    """Return drive id, address and length of each part of a Sync Read."""
    if len(parameters) < 5:
        return []
    return [(drive_id, _word(parameters, 0), _word(parameters, 2)) for drive_id in parameters[4:]]


def _bulk_read_parts(parameters: bytes) -> list[tuple[int, int, int]]:
    """Return drive id, address and length of each part of a Bulk Read."""
    starts = range(0, len(parameters) - 4, 5)
    return [(parameters[n], _word(parameters, n + 1), _word(parameters, n + 3)) for n in starts]


def _range(parameters: bytes) -> tuple[int, int]:
    """Return address and length of a Read."""
    return (_word(parameters, 0), _word(parameters, 2)) if len(parameters) == 4 else (0, 0)


def _reads_inputs(servo: Servo, address: int, length: int) -> bool:
    """True if these registers contain the contacts that are wired to this drive."""
    return bool(servo.drive.contacts) and address < END and address + length > PORT_DATA


def _word(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 2], "little")
