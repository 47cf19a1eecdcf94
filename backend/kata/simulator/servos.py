"""The control table of a servo (XH540-W270, ROBOTIS e-manual).

Scale factors convert the gains in the table to torque. They make the registers' steps fine enough for the gains in :mod:`~kata.simulator.parameters`.
"""

import math
import struct
from typing import Final

from kata.simulator import protocol
from kata.simulator.drive import COUNTS_A_RAD, Drive
from kata.simulator.parameters import COUNTS_A_TURN, NM_AN_AMPERE

ZERO_COUNT: Final = 2048
_NM_A_UNIT: Final = 0.00269 * NM_AN_AMPERE
"""Current unit of 2.69 mA."""
_RAD_S_A_UNIT: Final = 0.229 * math.tau / 60

P_NM_RAD: Final = 0.10
I_NM_RAD_S: Final = 0.50
D_NM_S_RAD: Final = 0.01
"""Value of one unit in the registers of the gains."""
_WATCHDOG_STEP_S: Final = 0.02

MODEL, ID, BAUD, RETURN_DELAY, OPERATING_MODE = 0, 7, 8, 9, 11
CURRENT_LIMIT, PORT_MODE, TORQUE_ENABLE, STATUS_LEVEL = 38, 55, 64, 68
HARDWARE_ERROR, D_GAIN, I_GAIN, P_GAIN, BUS_WATCHDOG = 70, 80, 82, 84, 98
MAX_POSITION, MIN_POSITION = 48, 52
GOAL_CURRENT, GOAL_POSITION, PRESENT_CURRENT, PRESENT_VELOCITY, PRESENT_POSITION = 102, 116, 126, 128, 132
_PRESENT_END: Final = PRESENT_POSITION + 4
SHUTDOWN, REALTIME_TICK, MOVING, MOVING_THRESHOLD, PORT_DATA, END = 63, 120, 122, 24, 150, 158
_EEPROM_END: Final = 64
_GOALS: Final = frozenset((*range(100, 106), *range(116, 120)))
_GOAL_POSITION_BYTES: Final = frozenset(range(116, 120))
_TRIPPED: Final = 0xFF
_BAUDS: Final = {0: 9_600, 1: 57_600, 2: 115_200, 3: 1_000_000, 4: 2_000_000, 5: 3_000_000, 6: 4_000_000}

_DEFAULTS: Final = (
    (0, "<H", 1120),
    (6, "<B", 48),
    (BAUD, "<B", 3),
    (RETURN_DELAY, "<B", 250),
    (OPERATING_MODE, "<B", 3),
    (12, "<B", 255),
    (CURRENT_LIMIT, "<H", 2047),
    (MIN_POSITION, "<I", 0),
    (MAX_POSITION, "<I", 4095),
    (MOVING_THRESHOLD, "<I", 10),
    (SHUTDOWN, "<B", 52),
    (STATUS_LEVEL, "<B", 2),
    (GOAL_CURRENT, "<H", 2047),
    (D_GAIN, "<H", 0),
    (P_GAIN, "<H", 800),
    (144, "<H", 240),
    (146, "<B", 32),
)
_RANGES: Final = {
    ID: (0, 252),
    RETURN_DELAY: (0, 254),
    **dict.fromkeys(range(PORT_MODE + 1, PORT_MODE + 4), (0, 3)),
    TORQUE_ENABLE: (0, 1),
    STATUS_LEVEL: (0, 2),
    BUS_WATCHDOG: (0, 127),
}
"""Allowed values of one-byte registers."""
_MODES: Final = frozenset((0, 1, 3, 4, 5, 16))
_CURRENT_BASED_POSITION: Final = 5
_SINGLE_TURN: Final = 3
_MULTI_TURN_COUNTS: Final = 1_048_575
_READ_ONLY: Final = frozenset((*range(7), *range(69, 76), *range(120, PORT_DATA + 2)))


class Servo:
    """One drive on the bus. The table stores written values; values that the drive changes are updated when they are read."""

    def __init__(self, drive: Drive, baud: int) -> None:
        """Its id is the motor's number.

        :raises ValueError: when it does not support the baud rate.
        """
        self.drive = drive
        self.registered: tuple[int, bytes] | None = None
        """Address and data of a registered write that waits for an Action."""
        self.zero = ZERO_COUNT
        """The count at angle 0, from the mounting of the encoder and the turns since power-up."""
        self.table = bytearray(END)
        codes = [code for code, rate in _BAUDS.items() if rate == baud]
        if not codes:
            raise ValueError(f"the servos do not support {baud} baud")
        self._baud_code = codes[0]
        self.exchange(drive.motor)

    @property
    def id(self) -> int:
        """Its id on the bus."""
        return self.table[ID]

    @property
    def alert(self) -> int:
        """Alert bit of the error byte of its answers."""
        return protocol.ALERT if self.table[HARDWARE_ERROR] else 0

    @property
    def baud(self) -> int:
        """Baud rate in register 8."""
        return _BAUDS[self.table[BAUD]]

    @property
    def return_delay_s(self) -> float:
        """Return delay in register 9, seconds."""
        return self.table[RETURN_DELAY] * 2e-6

    def read(self, address: int, length: int, now_ns: int) -> tuple[int, bytes]:
        """Return error byte and data."""
        if address + length > END:
            return protocol.DATA_RANGE_ERROR, b""
        self._update_table(address, address + length, now_ns)
        return 0, bytes(self.table[address : address + length])

    def write(self, address: int, data: bytes) -> int:
        """Write registers; return the error byte."""
        touched = range(address, address + len(data))
        if touched.stop > END or not data:
            return protocol.DATA_RANGE_ERROR
        if not _READ_ONLY.isdisjoint(touched):
            return protocol.ACCESS_ERROR
        if self.drive.torque_on and address < _EEPROM_END:
            return protocol.ACCESS_ERROR
        self._update_goal()
        if error := self._write_error(touched, data):
            return error
        self.table[address : touched.stop] = data
        self._apply(touched)
        return 0

    def reboot(self) -> None:
        """Torque off, RAM back to its defaults, hardware error forgotten."""
        eeprom = bytes(self.table[:_EEPROM_END])
        self._fill_defaults()
        self.table[:_EEPROM_END] = eeprom
        self._power_up()

    def mount(self, zero: int) -> None:
        """Mount the encoder so that it reports ``zero`` at angle 0, before power-up."""
        self.zero = zero
        self._power_up()

    def exchange(self, drive_id: int, model: int | None = None) -> None:
        """Replace the drive by another with default registers, except id and baud rate."""
        self._fill_defaults()
        self.table[ID] = drive_id
        self.table[BAUD] = self._baud_code
        if model is not None:
            struct.pack_into("<H", self.table, MODEL, model)
        self._power_up()

    def _fill_defaults(self) -> None:
        self.table[:] = bytes(END)
        for address, form, value in _DEFAULTS:
            struct.pack_into(form, self.table, address, value)

    def _power_up(self) -> None:
        """Switch torque off; the encoder then only knows its position within a turn: 0 to 4095."""
        self.registered = None
        self._apply(range(_EEPROM_END, GOAL_CURRENT))
        self.zero -= (self.zero + round(self.drive.angle * COUNTS_A_RAD)) // COUNTS_A_TURN * COUNTS_A_TURN

    def fail(self, code: int) -> None:
        """Set the hardware error, 0 for none. Errors in register 63 switch torque off."""
        self.table[HARDWARE_ERROR] = code
        if self._shut_down:
            self.drive.switch(on=False)

    @property
    def _shut_down(self) -> bool:
        return self.table[HARDWARE_ERROR] & self.table[SHUTDOWN] != 0

    def _write_error(self, touched: range, data: bytes) -> int:
        """Return the error of a write, 0 for none."""
        for address, value in zip(touched, data, strict=True):
            low, high = _RANGES.get(address, (0, 255))
            if not low <= value <= high:
                return protocol.DATA_RANGE_ERROR
        if BAUD in touched and data[BAUD - touched.start] not in _BAUDS:
            return protocol.DATA_RANGE_ERROR
        if OPERATING_MODE in touched and data[OPERATING_MODE - touched.start] not in _MODES:
            return protocol.DATA_RANGE_ERROR
        if self.drive.tripped:
            cleared = BUS_WATCHDOG in touched and data[BUS_WATCHDOG - touched.start] == 0
            if not cleared and not (_GOALS | {BUS_WATCHDOG}).isdisjoint(touched):
                return protocol.DATA_RANGE_ERROR
        after = self.table[:]
        after[touched.start : touched.stop] = data
        return protocol.DATA_LIMIT_ERROR if _beyond_limits(after, touched) else 0

    def _apply(self, touched: range) -> None:
        """Apply written registers to the drive."""
        table, drive = self.table, self.drive
        d, i, p = struct.unpack_from("<HHH", table, D_GAIN)
        limit = struct.unpack_from("<H", table, CURRENT_LIMIT)[0]
        if table[OPERATING_MODE] == _CURRENT_BASED_POSITION:
            limit = min(limit, abs(struct.unpack_from("<h", table, GOAL_CURRENT)[0]))
        drive.tune(p * P_NM_RAD, i * I_NM_RAD_S, d * D_NM_S_RAD, limit * _NM_A_UNIT)
        drive.feed_watchdog()
        if BUS_WATCHDOG in touched:
            drive.watchdog_s = table[BUS_WATCHDOG] * _WATCHDOG_STEP_S
            drive.tripped = False
        if not _GOAL_POSITION_BYTES.isdisjoint(touched):
            (goal,) = struct.unpack_from("<i", table, GOAL_POSITION)
            drive.set_goal((goal - self.zero) / COUNTS_A_RAD)
        if TORQUE_ENABLE in touched:
            drive.switch(table[TORQUE_ENABLE] != 0 and not self._shut_down)

    def _update_table(self, begin: int, end: int, now_ns: int) -> None:
        """Update those of these registers that the drive changes."""
        table, drive = self.table, self.drive
        table[TORQUE_ENABLE] = drive.torque_on
        if drive.tripped:
            table[BUS_WATCHDOG] = _TRIPPED
        if begin < PRESENT_CURRENT and end > GOAL_POSITION:
            self._update_goal()
            struct.pack_into("<H", table, REALTIME_TICK, now_ns // 1_000_000 & 0x7FFF)
            (threshold,) = struct.unpack_from("<I", table, MOVING_THRESHOLD)
            table[MOVING] = abs(round(drive.report.speed / _RAD_S_A_UNIT)) > threshold
        if begin < _PRESENT_END and end > PRESENT_CURRENT:
            report = drive.report
            struct.pack_into(
                "<hii",
                table,
                PRESENT_CURRENT,
                round(report.torque_nm / _NM_A_UNIT),
                round(report.speed / _RAD_S_A_UNIT),
                self.zero + round(report.angle * COUNTS_A_RAD),
            )
        if end > PORT_DATA:
            for port in (1, 2, 3):
                pulled_up = table[PORT_MODE + port] == 2
                table[PORT_DATA + 2 * port] = 1 if pulled_up and not drive.contacts.get(port, False) else 0

    def _update_goal(self) -> None:
        struct.pack_into("<i", self.table, GOAL_POSITION, self.zero + round(self.drive.goal * COUNTS_A_RAD))


def _beyond_limits(table: bytearray, touched: range) -> bool:
    """True if the drive's limits forbid a goal among these registers."""
    if GOAL_CURRENT in touched:
        (current,) = struct.unpack_from("<h", table, GOAL_CURRENT)
        (limit,) = struct.unpack_from("<H", table, CURRENT_LIMIT)
        if abs(current) > limit:
            return True
    if GOAL_POSITION in touched:
        low, high = -_MULTI_TURN_COUNTS, _MULTI_TURN_COUNTS
        if table[OPERATING_MODE] == _SINGLE_TURN:
            high, low = struct.unpack_from("<II", table, MAX_POSITION)
        (position,) = struct.unpack_from("<i", table, GOAL_POSITION)
        return not low <= position <= high
    return False
