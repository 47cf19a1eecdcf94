"""Simulated example drives for tests. Written from the protocol in README.md, not from the driver."""

import math
import struct
from collections import deque
from collections.abc import Iterator
from typing import Final

from fastcrc import crc16

from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus_answer import BusAnswer, transmission_s
from kata.simulator.drive import Drive
from kata.simulator.drives import SimulatedDrives
from kata.simulator.fault_injector import FaultInjector
from kata.simulator.parameters import DRIVES

REFUSED: Final = 1
_LIMIT_AT_POWER_UP: Final = 1_000
_READ_ONLY_FROM: Final = 10
_READS_CONTACTS: Final = 14


class ExampleDrive:
    """One drive: its registers, and their effects on the motor."""

    def __init__(self, drive: Drive) -> None:
        """Its id is the motor's number."""
        self.drive = drive
        self.id = drive.motor
        self.environment = (24.0, 30)
        self.reboot()

    def reboot(self) -> None:
        """Switch torque off and reset the drive to its power-up state."""
        self._limit, self._marker, self._error = _LIMIT_AT_POWER_UP, 0, 0
        self.drive.switch(on=False)
        self.drive.tripped = False
        self.drive.watchdog_s = 0.0
        self._tune()

    def exchange(self, drive_id: int, model: int | None = None) -> None:
        """Replace the drive by another at its power-up values."""
        self.id = drive_id
        self.reboot()

    def fail(self, code: int) -> None:
        """Set the error, 0 for none. An error switches torque off."""
        self._error = code
        if code:
            self.drive.switch(on=False)

    def expose(self, volt: float | None = None, temperature_c: int | None = None) -> None:
        """Do nothing: no register shows voltage and temperature."""

    def stored(self, address: int, size: int) -> bytes:
        """Return registers."""
        drive, report = self.drive, self.drive.report
        table = struct.pack(
            "<BBHBBiBBHBBihh",
            drive.torque_on,
            round(drive.watchdog_s / 0.02),
            self._limit,
            self._marker,
            0,
            round(math.degrees(drive.goal) * 100),
            drive.torque_on,
            drive.tripped,
            self._error,
            sum(1 << port - 1 for port, closed in drive.contacts.items() if closed),
            0,
            round(math.degrees(report.angle) * 100),
            round(math.degrees(report.speed) * 10),
            round(report.torque_nm * 100),
        )
        return table[address : address + size]

    def store(self, address: int, data: bytes) -> None:
        """Write registers."""
        drive = self.drive
        match address:
            case 0:
                drive.switch(on=data[0] == 1 and not self._error)
            case 1:
                drive.watchdog_s = data[0] * 0.02
                drive.tripped = drive.tripped and data[0] != 0
            case 2:
                self._limit = int.from_bytes(data, "little")
                self._tune()
            case 4:
                self._marker = data[0]
            case 6 if not drive.tripped:
                drive.set_goal(math.radians(int.from_bytes(data, "little", signed=True) / 100))

    def _tune(self) -> None:
        gains = DRIVES[self.drive.motor - 1]
        self.drive.tune(gains.p_nm_rad, gains.i_nm_rad_s, gains.d_nm_s_rad, self._limit / 100)


class ExampleLine:
    """The drives on the wire. A frame contains its length and is received with its last byte."""

    def __init__(self, apparatus: SimulatedApparatus, drives: list[ExampleDrive], faults: FaultInjector) -> None:
        """``faults``: change the answers on their way out."""
        self._apparatus = apparatus
        self._drives = drives
        self._faults = faults
        self._received = b""
        self._received_ns = 0
        self._busy_until_ns = 0
        self._incoming: deque[tuple[int, int, bytes]] = deque()

    @property
    def due_ns(self) -> int | None:
        """Time at which the drives have received the next frame, or None."""
        return self._incoming[0][0] if self._incoming else None

    def receive(self, data: bytes, now_ns: int, baud: int) -> None:
        """Receive bytes; their transmission begins after that of earlier bytes."""
        if now_ns - self._received_ns > 5_000_000:
            self._received = b""
        self._received_ns = now_ns
        self._received += data
        while len(self._received) >= 5 and len(self._received) >= (size := 7 + self._received[4]):
            frame, self._received = self._received[:size], self._received[size:]
            self._busy_until_ns = max(self._busy_until_ns, now_ns) + int(transmission_s(size, baud) * 1e9)
            self._incoming.append((self._busy_until_ns, baud, frame))

    def execute(self, now_ns: int) -> Iterator[tuple[int, BusAnswer]]:
        """Execute the frames received until now; yield the time of each and its answer."""
        while self._incoming and self._incoming[0][0] <= now_ns:
            at_ns, baud, frame = self._incoming.popleft()
            for answer in self._execute(frame, baud, at_ns):
                yield at_ns, answer

    def _execute(self, frame: bytes, baud: int, now_ns: int) -> Iterator[BusAnswer]:
        self._apparatus.advance(now_ns)
        if frame[0] != 0x5A or crc16.modbus(frame[:-2]) != int.from_bytes(frame[-2:], "little"):
            return
        self._apparatus.heard(now_ns)
        _, drive_id, number, instruction, _ = frame[:5]
        payload = frame[5:-2]
        hearing = [drive for drive in self._drives if not self._faults.has("off", drive.drive.motor)]
        for drive in hearing:
            drive.drive.feed_watchdog()
            if instruction == 3:
                _take_goal(drive, payload)
            elif drive_id in (0, drive.id):
                error, data = _execute_at(drive, instruction, payload)
                contacts = instruction == 1 and payload[0] <= _READS_CONTACTS < payload[0] + payload[1]
                reads_inputs = contacts and bool(drive.drive.contacts)
                if drive_id and self._faults.answers(drive.drive.motor, inputs=reads_inputs):
                    head = bytes([0xA5, drive.id, number, error, len(data)])
                    answer = head + data + struct.pack("<H", crc16.modbus(head + data))
                    late_s, answer = self._faults.corrupt(drive.drive.motor, answer)
                    yield BusAnswer(answer, late_s + transmission_s(len(answer), baud))


def _take_goal(drive: ExampleDrive, payload: bytes) -> None:
    for start in range(0, len(payload) - 4, 5):
        if payload[start] == drive.id:
            drive.store(6, payload[start + 1 : start + 5])


def _execute_at(drive: ExampleDrive, instruction: int, payload: bytes) -> tuple[int, bytes]:
    """Return error and data of the answer."""
    match instruction:
        case 1:
            return 0, drive.stored(payload[0], payload[1])
        case 2 if payload[0] < _READ_ONLY_FROM:
            drive.store(payload[0], payload[1:])
            return 0, b""
        case _:
            return REFUSED, b""


def example_drives(apparatus: SimulatedApparatus, baud: int) -> SimulatedDrives:
    """Return the five drives of an apparatus. They follow every baud rate."""
    drives = [ExampleDrive(drive) for drive in apparatus.drives]
    faults = FaultInjector(apparatus, drives)
    return SimulatedDrives(ExampleLine(apparatus, drives, faults), faults, drives)
