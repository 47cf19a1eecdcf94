"""One servo: its control table (XH540-W270, robotis e-manual) and the position control inside it.

Scale factors turn the gains in the table into torque; they are chosen for the plant, as the real drives' gains are tuned
beforehand (Section 2.1 of the paper).
"""

import math
import struct
from typing import Final

from kata.simulator import protocol

COUNTS_A_TURN: Final = 4096
ZERO_COUNT: Final = 2048
_COUNT_A_RAD: Final = COUNTS_A_TURN / math.tau
_NM_A_UNIT: Final = 0.00269 * 2.0
"""Current unit of 2.69 mA, 2 Nm an ampere (10 Nm at 5 A)."""
_RAD_S_A_UNIT: Final = 0.229 * math.tau / 60

_P_NM_RAD: Final = 0.10
_I_NM_RAD_S: Final = 0.75
_D_NM_S_RAD: Final = 0.13
_GOAL_SPEED_S: Final = 0.008
"""The drive judges the goal's speed over about this long, for its D part."""
_WATCHDOG_STEP_S: Final = 0.02

ID, BAUD, RETURN_DELAY, OPERATING_MODE = 7, 8, 9, 11
CURRENT_LIMIT, PORT_MODE, TORQUE_ENABLE, STATUS_LEVEL = 38, 55, 64, 68
HARDWARE_ERROR, D_GAIN, I_GAIN, P_GAIN, BUS_WATCHDOG = 70, 80, 82, 84, 98
MAX_POSITION, MIN_POSITION = 48, 52
GOAL_CURRENT, GOAL_POSITION, PRESENT_CURRENT, PRESENT_VELOCITY, PRESENT_POSITION = 102, 116, 126, 128, 132
REALTIME_TICK, MOVING, MOVING_THRESHOLD, PORT_DATA, END = 120, 122, 24, 150, 158
_EEPROM_END: Final = 64
_GOALS: Final = frozenset((*range(100, 106), *range(116, 120)))
_TRIPPED: Final = 0xFF
_BAUDS: Final = {0: 9_600, 1: 57_600, 2: 115_200, 3: 1_000_000, 4: 2_000_000, 5: 3_000_000, 6: 4_000_000}

_DEFAULTS: Final = (
    (0, "<H", 1120),
    (6, "<B", 48),
    (BAUD, "<B", 3),
    (RETURN_DELAY, "<B", 250),
    (OPERATING_MODE, "<B", 3),
    (CURRENT_LIMIT, "<H", 2047),
    (MIN_POSITION, "<I", 0),
    (MAX_POSITION, "<I", 4095),
    (MOVING_THRESHOLD, "<I", 10),
    (63, "<B", 52),
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
"""Registers of one byte that take these values only."""
_MODES: Final = frozenset((0, 1, 3, 4, 5, 16))
_CURRENT_BASED_POSITION: Final = 5
_SINGLE_TURN: Final = 3
_MULTI_TURN_COUNTS: Final = 1_048_575
_READ_ONLY: Final = frozenset((*range(7), *range(69, 76), *range(120, PORT_DATA + 2)))


class Servo:
    """One drive on the bus. ``torque_nm`` is what it presently gives; ports are set by the apparatus."""

    def __init__(self, drive_id: int, strength: float = 1.0) -> None:
        """``strength`` below 1: a weaker and looser drive."""
        self.table = bytearray(END)
        for address, form, value in _DEFAULTS:
            struct.pack_into(form, self.table, address, value)
        self.table[ID] = drive_id
        self.torque_nm = 0.0
        self._strength = strength
        self._goal = 0.0
        self._goal_speed = 0.0
        self._integral_nm = 0.0
        self._gains = (0.0, 0.0, 0.0)
        self._limit_nm = 0.0
        self._silence_s = 0.0
        self.contacts: dict[int, bool] = {}
        """External port number to whether its contact is closed to ground."""

    @property
    def id(self) -> int:
        """Its address."""
        return self.table[ID]

    @property
    def torque_on(self) -> bool:
        """Register 64."""
        return self.table[TORQUE_ENABLE] != 0

    @property
    def tripped(self) -> bool:
        """Its bus watchdog has stopped it."""
        return self.table[BUS_WATCHDOG] == _TRIPPED

    @property
    def alert(self) -> int:
        """What a standing hardware error adds to the error byte of its answers."""
        return protocol.ALERT if self.table[HARDWARE_ERROR] else 0

    @property
    def baud(self) -> int:
        """What register 8 stands for."""
        return _BAUDS[self.table[BAUD]]

    @property
    def return_delay_s(self) -> float:
        """What register 9 stands for."""
        return self.table[RETURN_DELAY] * 2e-6

    def heard(self) -> None:
        """Any sound instruction on the bus feeds the watchdog."""
        self._silence_s = 0.0

    def read(self, address: int, length: int) -> tuple[int, bytes]:
        """Error byte and data."""
        if address + length > END:
            return protocol.DATA_RANGE_ERROR, b""
        for port in (1, 2, 3):
            pulled_up = self.table[PORT_MODE + port] == 2
            self.table[PORT_DATA + 2 * port] = 1 if pulled_up and not self.contacts.get(port, False) else 0
        return 0, bytes(self.table[address : address + length])

    def write(self, address: int, data: bytes, angle: float) -> int:
        """Error byte. ``angle`` is where the shaft is, in radians."""
        touched = range(address, address + len(data))
        if touched.stop > END or not data:
            return protocol.DATA_RANGE_ERROR
        if not _READ_ONLY.isdisjoint(touched):
            return protocol.ACCESS_ERROR
        if self.torque_on and address < _EEPROM_END:
            return protocol.ACCESS_ERROR
        if error := self._objection(touched, data):
            return error
        was_on = self.torque_on
        self.table[address : touched.stop] = data
        if self.torque_on and not was_on:
            self._integral_nm = 0.0
            self._set_goal(angle)
            self._goal = angle
            self._goal_speed = 0.0
        self._silence_s = 0.0
        self._understand()
        return 0

    def _objection(self, touched: range, data: bytes) -> int:
        """The error that this write would be answered with, 0 for none."""
        for address, value in zip(touched, data, strict=True):
            low, high = _RANGES.get(address, (0, 255))
            if not low <= value <= high:
                return protocol.DATA_RANGE_ERROR
        if BAUD in touched and data[BAUD - touched.start] not in _BAUDS:
            return protocol.DATA_RANGE_ERROR
        if OPERATING_MODE in touched and data[OPERATING_MODE - touched.start] not in _MODES:
            return protocol.DATA_RANGE_ERROR
        if self.table[BUS_WATCHDOG] == _TRIPPED:
            cleared = BUS_WATCHDOG in touched and data[BUS_WATCHDOG - touched.start] == 0
            if not cleared and not (_GOALS | {BUS_WATCHDOG}).isdisjoint(touched):
                return protocol.DATA_RANGE_ERROR
        after = self.table[:]
        after[touched.start : touched.stop] = data
        return protocol.DATA_LIMIT_ERROR if _beyond_limits(after, touched) else 0

    def reboot(self) -> None:
        """Torque off, RAM back to its defaults, hardware error forgotten."""
        kept = bytes(self.table[:_EEPROM_END])
        for address in range(_EEPROM_END, END):
            self.table[address] = 0
        for address, form, value in _DEFAULTS:
            struct.pack_into(form, self.table, address, value)
        self.table[:_EEPROM_END] = kept
        self._understand()

    def control(self, angle: float, speed: float, dt_s: float) -> None:
        """One step of the control inside the drive; sets :attr:`torque_nm`. Radians."""
        if not self.torque_on:
            self.torque_nm = 0.0
            return
        self._watch(dt_s, angle)
        measured = round(angle * _COUNT_A_RAD) / _COUNT_A_RAD
        goal = self._wanted
        share = dt_s / _GOAL_SPEED_S
        self._goal_speed += ((goal - self._goal) / dt_s - self._goal_speed) * share
        self._goal = goal
        p, i, d = self._gains
        error = goal - measured
        self._integral_nm += i * error * dt_s
        self._integral_nm = min(max(self._integral_nm, -self._limit_nm), self._limit_nm)
        torque = p * error + self._integral_nm + d * (self._goal_speed - speed)
        self.torque_nm = min(max(torque, -self._limit_nm), self._limit_nm)

    def show(self, angle: float, speed: float, now_ns: int) -> None:
        """Bring the present values in the table up to date."""
        unit_speed = round(speed / _RAD_S_A_UNIT)
        struct.pack_into("<H", self.table, REALTIME_TICK, now_ns // 1_000_000 & 0x7FFF)
        (threshold,) = struct.unpack_from("<I", self.table, MOVING_THRESHOLD)
        self.table[MOVING] = abs(unit_speed) > threshold
        struct.pack_into(
            "<hii",
            self.table,
            PRESENT_CURRENT,
            round(self.torque_nm / _NM_A_UNIT),
            unit_speed,
            ZERO_COUNT + round(angle * _COUNT_A_RAD),
        )

    def _understand(self) -> None:
        d, i, p = struct.unpack_from("<HHH", self.table, D_GAIN)
        scale = self._strength
        self._gains = (p * _P_NM_RAD * scale, i * _I_NM_RAD_S * scale, d * _D_NM_S_RAD * scale)
        limit = struct.unpack_from("<H", self.table, CURRENT_LIMIT)[0]
        if self.table[OPERATING_MODE] == _CURRENT_BASED_POSITION:
            limit = min(limit, abs(struct.unpack_from("<h", self.table, GOAL_CURRENT)[0]))
        self._limit_nm = limit * _NM_A_UNIT * scale
        (goal,) = struct.unpack_from("<i", self.table, GOAL_POSITION)
        self._wanted = (goal - ZERO_COUNT) / _COUNT_A_RAD

    def _set_goal(self, angle: float) -> None:
        struct.pack_into("<i", self.table, GOAL_POSITION, ZERO_COUNT + round(angle * _COUNT_A_RAD))

    def _watch(self, dt_s: float, angle: float) -> None:
        """The bus watchdog: silence for longer than set stops the drive where it is; torque stays on."""
        setting = self.table[BUS_WATCHDOG]
        if setting in (0, _TRIPPED):
            return
        self._silence_s += dt_s
        if self._silence_s > setting * _WATCHDOG_STEP_S:
            self.table[BUS_WATCHDOG] = _TRIPPED
            self._set_goal(angle)
            self._understand()


def _beyond_limits(table: bytearray, touched: range) -> bool:
    """Whether a goal among the touched registers is one that the drive's own limits forbid."""
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
