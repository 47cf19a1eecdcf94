"""Simulates the five servos on one bus: which of them answer, in which order, and when.

An instruction is received with its last byte, and an answer is complete with its last byte.
"""

from collections.abc import Iterator, Sequence
from typing import Final

from kata.simulator import protocol
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus_answer import BusAnswer, transmission_s
from kata.simulator.control_table import BAUD, BAUD_CODES, END, PORT_DATA, SECONDARY_ID, STATUS_LEVEL
from kata.simulator.fault_injector import FaultInjector
from kata.simulator.protocol import Instruction
from kata.simulator.register_access import is_indirect, places
from kata.simulator.servos import Servo

_LEVEL_READS: Final = 1
_LEVEL_ALL: Final = 2


class ServoBus:
    """Executes instructions at the servos and returns their answers. The caller passes the time as ``now_ns``."""

    def __init__(self, apparatus: SimulatedApparatus, baud: int = 1_000_000) -> None:
        """Create the servos. ``baud``: their initial rate.

        :raises ValueError: when the servos do not support it.
        """
        self._apparatus = apparatus
        self.servos = [Servo(drive, baud) for drive in apparatus.drives]
        self.faults = FaultInjector(apparatus, self.servos)

    def execute(self, instruction: Instruction, baud: int, now_ns: int) -> list[BusAnswer]:
        """Execute an instruction at the drives with this baud rate and return their answers."""
        self._apparatus.advance(now_ns)
        off, code = self.faults.off, BAUD_CODES.get(baud)
        hearing = [
            servo
            for servo in self.servos
            if servo.plugged_in
            and servo.table[BAUD] == code
            and servo.boot_until_ns <= now_ns
            and servo.drive.motor not in off
        ]
        listening = {servo.id: servo for servo in hearing}
        if not instruction.valid:
            addressed = listening.get(instruction.drive_id)
            if addressed is None or not self.faults.answers(addressed.drive.motor):
                return []
            error = protocol.status(addressed.id, addressed.alert | protocol.CRC_ERROR)
            return list(self._timed([(addressed, error)], baud))
        self._apparatus.heard(now_ns)
        for servo in hearing:
            servo.drive.feed_watchdog()
        match instruction.code:
            case protocol.SYNC_READ:
                answers = _packets(self._read_in_order(listening, _sync_read_parts(instruction.parameters), now_ns))
            case protocol.FAST_SYNC_READ:
                answers = self._fast_read(listening, _sync_read_parts(instruction.parameters), now_ns)
            case protocol.BULK_READ:
                answers = _packets(self._read_in_order(listening, _bulk_read_parts(instruction.parameters), now_ns))
            case protocol.FAST_BULK_READ:
                answers = self._fast_read(listening, _bulk_read_parts(instruction.parameters), now_ns)
            case protocol.SYNC_WRITE:
                self._sync_write(listening, instruction.parameters)
                answers = []
            case protocol.BULK_WRITE:
                self._bulk_write(listening, instruction.parameters)
                answers = []
            case _:
                answers = _collided(self._single(hearing, instruction, now_ns))
        return list(self._timed(answers, baud))

    def _timed(self, answers: Sequence[tuple[Servo, bytes]], baud: int) -> Iterator[BusAnswer]:
        after_s = 0.0
        for servo, answer in answers:
            late_s, data = self.faults.corrupt(servo.drive.motor, answer)
            after_s += servo.return_delay_s + late_s + transmission_s(len(data), baud)
            yield BusAnswer(data, after_s)

    def _single(self, hearing: Sequence[Servo], instruction: Instruction, now_ns: int) -> list[tuple[Servo, bytes]]:
        """Execute an instruction for one drive, or for all with the broadcast address. Drives answer a broadcast only if it is a ping."""
        asked = instruction.drive_id
        broadcast = asked == protocol.BROADCAST
        addressed = [servo for servo in hearing if broadcast or servo.id == asked]
        for servo in hearing:
            # An instruction to a secondary id reaches only RAM and is never answered.
            if servo.table[SECONDARY_ID] == asked and servo.id != asked and not broadcast:
                self._execute_at(servo, instruction, now_ns, ram_only=True)
        answers = []
        for servo in addressed:
            drive_id, alert, level = servo.id, servo.alert, servo.table[STATUS_LEVEL]
            error, data = self._execute_at(servo, instruction, now_ns)
            reads = instruction.code == protocol.READ
            wanted = not broadcast and (level == _LEVEL_ALL or (reads and level == _LEVEL_READS))
            if (instruction.code == protocol.PING or wanted) and self.faults.answers(
                servo.drive.motor, inputs=reads and _reads_inputs(servo, *_range(instruction.parameters))
            ):
                # A changed id applies from the next instruction.
                answers.append((servo, protocol.status(drive_id, alert | error, data)))
        return answers

    def _execute_at(
        self, servo: Servo, instruction: Instruction, now_ns: int, *, ram_only: bool = False
    ) -> tuple[int, bytes]:
        parameters = instruction.parameters
        match instruction.code:
            case protocol.PING:
                return 0, bytes(servo.table[0:2] + servo.table[6:7])
            case protocol.READ if len(parameters) == 4:
                return servo.read(_word(parameters, 0), _word(parameters, 2), now_ns)
            case protocol.WRITE if len(parameters) > 2:
                return servo.write(_word(parameters, 0), parameters[2:], ram_only=ram_only), b""
            case protocol.REG_WRITE if len(parameters) > 2:
                return servo.register(_word(parameters, 0), parameters[2:]), b""
            case protocol.READ | protocol.WRITE | protocol.REG_WRITE:
                return protocol.DATA_LENGTH_ERROR, b""
            case _ if ram_only:
                return protocol.INSTRUCTION_ERROR, b""
            case _:
                return _manage(servo, instruction, now_ns), b""

    def _read_in_order(
        self, listening: dict[int, Servo], wanted: Sequence[tuple[int, int, int]], now_ns: int
    ) -> list[tuple[Servo, int, bytes]]:
        """Read the named drives in order. Each waits for the drive before it, so a silent drive silences all drives after it."""
        answers = []
        for drive_id, address, length in wanted:
            servo = listening.get(drive_id)
            if servo is None or servo.table[STATUS_LEVEL] == 0:
                break
            if self.faults.any and not self.faults.answers(
                servo.drive.motor, inputs=_reads_inputs(servo, address, length)
            ):
                break
            error, data = servo.read(address, length, now_ns)
            answers.append((servo, servo.alert | error, data))
        return answers

    def _fast_read(
        self, listening: dict[int, Servo], wanted: Sequence[tuple[int, int, int]], now_ns: int
    ) -> list[tuple[Servo, bytes]]:
        lengths = [length for _, _, length in wanted]
        if not wanted or max(lengths) > END:
            return []  # The length field of the header cannot express such a length.
        # Pad unreadable data, because the header already contains the packet's length.
        answers = [
            (servo, error, data.ljust(length, b"\0"))
            for (servo, error, data), length in zip(
                self._read_in_order(listening, wanted, now_ns), lengths, strict=False
            )
        ]
        blocks = protocol.fast_blocks([(s.id, error, data) for s, error, data in answers], lengths)
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


def _collided(answers: Sequence[tuple[Servo, bytes]]) -> list[tuple[Servo, bytes]]:
    """Return the answers as they are on the wire. If drives share an id, a bit is 0 if any of them sends 0."""
    on_wire: dict[int, tuple[Servo, bytes]] = {}
    for servo, answer in answers:
        drive_id = answer[4]
        if drive_id in on_wire:
            first, other = on_wire[drive_id]
            answer = bytes(a & b for a, b in zip(answer, other, strict=False))
            servo = first
        on_wire[drive_id] = (servo, answer)
    return list(on_wire.values())


def _manage(servo: Servo, instruction: Instruction, now_ns: int) -> int:
    """Execute an instruction about the whole servo, such as a reboot. Return the error byte."""
    parameters = instruction.parameters
    match instruction.code:
        case protocol.ACTION:
            return servo.act()
        case protocol.REBOOT:
            servo.reboot(now_ns)
            return 0
        case protocol.FACTORY_RESET if parameters == b"\xff" and instruction.drive_id == protocol.BROADCAST:
            return protocol.INSTRUCTION_ERROR  # Otherwise all servos would have the same id.
        case protocol.FACTORY_RESET if len(parameters) == 1:
            return servo.reset(parameters[0], now_ns)
        case protocol.CLEAR if parameters == b"\x01" + protocol.CLEAR_KEY:
            return servo.clear()
        case protocol.BACKUP if parameters[1:] == protocol.BACKUP_KEY:
            return servo.back_up(parameters[0], now_ns)
        case protocol.FACTORY_RESET | protocol.CLEAR | protocol.BACKUP:
            return protocol.DATA_RANGE_ERROR
        case _:
            return protocol.INSTRUCTION_ERROR


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
    """Return True if these registers contain the contacts that are wired to this drive."""
    if not servo.drive.contacts or not 0 < length <= END - address:
        return False
    end = address + length
    span = places(servo.table, address, end).addresses if is_indirect(address, end) else range(address, end)
    return any(PORT_DATA + 2 <= place < PORT_DATA + 8 for place in span)


def _word(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 2], "little")
