"""Simulates an X-series servo: its control table, and the effects of its values on the drive (ROBOTIS e-Manual).

Not simulated: Protocol 1.0, and the dual mode of two servos. Feed-forward gains act only on a moving profile, and need the simple plant.
"""

import struct
from collections.abc import Iterable
from typing import Final

from kata.simulator import control_table as ct
from kata.simulator import protocol
from kata.simulator import register_access as access
from kata.simulator.drive import COUNTS_A_RAD, Drive, DriveReport
from kata.simulator.parameters import COUNTS_A_TURN, NM_AN_AMPERE, RESISTANCE_OHM, SUPPLY_V
from kata.simulator.servo_motion import RAD_S_A_UNIT, ServoMotion

ZERO_COUNT: Final = 2048
AMPERE_A_UNIT: Final = 0.00269
_MODEL: Final = 1120
"""Model number of an XM540-W270."""

_GOAL: Final = struct.Struct("<i")
_PRESENT: Final = struct.Struct("<hhii")
"""Registers of PWM, current, velocity and position."""
_WATCHDOG_STEP_S: Final = 0.02
BOOT_NS: Final = 300_000_000
"""Time after a start in which a servo does not answer. The manual states no time."""

_GOAL_POSITION_BYTES: Final = range(116, 120)
_OUTPUT, _PULLED_UP = 1, 2
"""Modes of an external port. A port in another mode reads 0, because only contacts to ground are wired."""
_COORDINATES: Final = frozenset((ct.DRIVE_MODE, ct.OPERATING_MODE, *range(20, 24)))
_LIMITS: Final = frozenset((ct.TEMPERATURE_LIMIT, *range(32, 36)))
_TRIPPED: Final = 0xFF
_SINGLE_TURN_OFFSET: Final = 1_024
"""A Homing Offset larger than this is ignored in position control mode."""
_IN_POSITION_COUNTS: Final = 20
"""Largest distance that counts as "in position". The manual states no limit."""


class _Inspected:
    """Values of a servo that are read without a request on the bus."""

    table: bytearray
    _volt: float
    _temperature_c: int

    def stored(self, address: int, size: int) -> bytes:
        """Return the contents of registers, without a request on the bus."""
        return bytes(self.table[address : address + size])

    def store(self, address: int, data: bytes) -> None:
        """Change the contents of registers, without a request on the bus."""
        self.table[address : address + len(data)] = data

    @property
    def environment(self) -> tuple[float, int]:
        """The supply's voltage in V, and the servo's temperature in degrees Celsius."""
        return self._volt, self._temperature_c

    def _word(self, address: int) -> int:
        return int.from_bytes(self.table[address : address + 2], "little")

    @property
    def _shut_down(self) -> bool:
        return self.table[ct.HARDWARE_ERROR] & self.table[ct.SHUTDOWN] != 0


class Servo(_Inspected):
    """One servo on the bus. The table stores written values. Values that the drive changes are updated when they are read."""

    def __init__(self, drive: Drive, baud: int) -> None:
        """Create a servo whose id is the motor's number.

        :raises ValueError: when the servo does not support the baud rate.
        """
        self.drive = drive
        self.registered: tuple[int, bytes] | None = None
        """Address and data of a registered write that waits for an Action."""
        self.boot_until_ns = 0
        """The servo does not answer before this time."""
        self.zero = ZERO_COUNT
        """The encoder's count at angle 0, from its mounting and the turns since power-up."""
        self.mounted_sign = 1  # -1: mounted so that it counts down while the angle increases.
        self.gain_share = 1.0  # Share of the nominal torque for the same gain, because motors and gears differ.
        self.plugged_in = True  # False: disconnected from the bus and from power.
        self._model = _MODEL
        self._has_ports = True
        self.table = ct.factory_table(_MODEL)
        self._backup: bytes | None = None
        self._volt, self._temperature_c, self._nm_a_unit = 0.0, 32, 0.0
        self._motion = ServoMotion(drive, self.table)
        if baud not in ct.BAUD_CODES:
            raise ValueError(f"the servos do not support {baud} baud")
        self._baud_code = ct.BAUD_CODES[baud]
        self.exchange(drive.motor)

    @property
    def id(self) -> int:
        """The servo's id on the bus."""
        return self.table[ct.ID]

    @property
    def alert(self) -> int:
        """Alert bit of the error byte of the servo's answers."""
        return protocol.ALERT if self.table[ct.HARDWARE_ERROR] else 0

    @property
    def return_delay_s(self) -> float:
        """Return delay in register 9, in seconds."""
        return self.table[ct.RETURN_DELAY] * 2e-6

    # -- the table --------------------------------------------------------------------------------------------------

    def read(self, address: int, length: int, now_ns: int) -> tuple[int, bytes]:
        """Return error byte and data of a read."""
        end = address + length
        if not access.is_readable(address, end, has_ports=self._has_ports):
            return protocol.ACCESS_ERROR, b""
        if access.is_indirect(address, end):
            places = access.places(self.table, address, end)
            self._update_table(places.begin, places.end, now_ns)
            return 0, places.take(self.table)
        self._update_table(address, end, now_ns)
        return 0, bytes(self.table[address:end])

    def write(self, address: int, data: bytes, *, ram_only: bool = False) -> int:
        """Write all given registers or none of them. Return the error byte. ``ram_only``: refuse EEPROM, as with the secondary id."""
        if address + len(data) > ct.END or not data:
            return protocol.ACCESS_ERROR
        parts = list(access.written_parts(self.table, address, data))
        if parts[0][0] < ct.EEPROM_END and (ram_only or self.drive.torque_on):
            return protocol.ACCESS_ERROR
        self._update_goal()
        if error := self._error_of(parts):
            return error
        for start, part in parts:
            touched = range(start, start + len(part))
            before = self.table[touched.start : touched.stop]
            self.table[touched.start : touched.stop] = part
            self._apply(touched, before)
        return 0

    def _error_of(self, parts: Iterable[tuple[int, bytes]]) -> int:
        tripped = self.drive.tripped
        for start, part in parts:
            if not self._has_ports and access.touches_ports(start, start + len(part)):
                return protocol.ACCESS_ERROR
            if error := access.write_error(self.table, start, part, tripped=tripped):
                return error
        return 0

    # -- instructions -------------------------------------------------------------------------------------------------

    def register(self, address: int, data: bytes) -> int:
        """Store a write for an Action. Return the error byte."""
        if error := self._error_of(access.written_parts(self.table, address, data)):
            return error
        self.registered = (address, data)
        self.table[ct.REGISTERED] = 1
        return 0

    def act(self) -> int:
        """Execute the registered write. Return the error byte."""
        registered, self.registered = self.registered, None
        self.table[ct.REGISTERED] = 0
        return self.write(*registered) if registered else protocol.INSTRUCTION_ERROR

    def reboot(self, now_ns: int | None = None) -> None:
        """Switch torque off, reset RAM to its defaults or its backup, and clear the hardware error. ``now_ns``: begin of the boot time."""
        if now_ns is not None:
            self.boot_until_ns = now_ns + BOOT_NS
        self.table[ct.EEPROM_END :] = ct.ram_of(self.table, self._backup)
        self._power_up()

    def reset(self, option: int, now_ns: int) -> int:
        """Reset to factory values and reboot. Option 1 keeps the id, option 2 id and baud rate. Return the error byte."""
        if option not in (0xFF, 1, 2):
            return protocol.DATA_RANGE_ERROR
        drive_id, baud = self.table[ct.ID], self.table[ct.BAUD]
        self.table[:] = ct.factory_table(self._model)
        if option != 0xFF:
            self.table[ct.ID] = drive_id
        if option == 2:
            self.table[ct.BAUD] = baud
        self.reboot(now_ns)
        return 0

    def clear(self) -> int:
        """Reset the turns of the present position. Return the error byte. A moving servo refuses."""
        report = self.drive.report
        position = self._counts(report.angle)
        self._update_moving(round(report.speed / RAD_S_A_UNIT), position, self._counts(self.drive.goal))
        if self.table[ct.MOVING]:
            return protocol.RESULT_FAIL
        self._forget_turns()
        return 0

    def back_up(self, option: int, now_ns: int) -> int:
        """Store the table (option 1), or restore its EEPROM and reboot (option 2). Return the error byte."""
        if self.drive.torque_on or option not in (1, 2) or (option == 2 and self._backup is None):
            return protocol.RESULT_FAIL
        if option == 1 or self._backup is None:
            self._backup = bytes(self.table)
            self.table[ct.BACKUP_READY] = 1
            return 0
        self.table[: ct.EEPROM_END] = self._backup[: ct.EEPROM_END]
        self.reboot(now_ns)
        return 0

    # -- from outside ---------------------------------------------------------------------------------------------------

    def mount(self, zero: int, sign: int = 1) -> None:
        """Mount the encoder before power-up so that its count is ``zero`` at angle 0. ``sign``: -1 if it counts in the
        opposite direction.
        """
        self.zero, self.mounted_sign = zero, sign
        self._power_up()

    def exchange(self, drive_id: int, model: int | None = None) -> None:
        """Replace the drive with another drive that has default registers, except id and baud rate."""
        self._model = _MODEL if model is None else model
        kind = ct.MODELS.get(self._model, ct.OTHER_MODEL)
        self._has_ports = kind.has_ports
        self._volt, self._nm_a_unit = kind.volt, AMPERE_A_UNIT * kind.nm_a
        self.table[:] = ct.factory_table(self._model)
        self.table[ct.ID] = drive_id
        self.table[ct.BAUD] = self._baud_code
        self._backup = None
        self.reboot()

    def fail(self, code: int) -> None:
        """Set the hardware error; 0 means none. Errors that register 63 selects switch torque off."""
        self.table[ct.HARDWARE_ERROR] = code
        if self._shut_down:
            self.drive.switch(on=False)

    def expose(self, volt: float | None = None, temperature_c: int | None = None) -> None:
        """Change the supply's voltage and the servo's temperature."""
        self._volt = self._volt if volt is None else volt
        self._temperature_c = self._temperature_c if temperature_c is None else temperature_c
        self._check_limits()

    def _check_limits(self) -> None:
        """Add the errors of voltage and temperature. Only a restart clears them."""
        in_range = self._word(ct.MIN_VOLTAGE) <= round(10 * self._volt) <= self._word(ct.MAX_VOLTAGE)
        error = 0 if in_range else ct.VOLTAGE_ERROR
        error |= ct.OVERHEATING_ERROR if self._temperature_c > self.table[ct.TEMPERATURE_LIMIT] else 0
        if error:
            self.fail(self.table[ct.HARDWARE_ERROR] | error)

    # -- effects of the values -----------------------------------------------------------------------------------------------

    @property
    def _sign(self) -> int:
        return -self.mounted_sign if self.table[ct.DRIVE_MODE] & ct.REVERSE else self.mounted_sign

    @property
    def _offset(self) -> int:
        offset: int = _GOAL.unpack_from(self.table, ct.HOMING_OFFSET)[0]
        ignored = self.table[ct.OPERATING_MODE] == ct.POSITION and abs(offset) > _SINGLE_TURN_OFFSET
        return 0 if ignored else offset

    def _counts(self, angle: float) -> int:
        """Return the position that the servo reports for an angle of its shaft in radians."""
        return self._sign * (self.zero + round(angle * COUNTS_A_RAD)) + self._offset

    def _angle(self, counts: int) -> float:
        return (self._sign * (counts - self._offset) - self.zero) / COUNTS_A_RAD

    def _forget_turns(self) -> None:
        """Reset the position, without the Homing Offset, to the range of one turn: 0 to 4095."""
        self.zero -= self._sign * ((self._counts(self.drive.angle) - self._offset) // COUNTS_A_TURN * COUNTS_A_TURN)

    def _power_up(self) -> None:
        """Switch torque off and reset the turns, because after power-up the encoder knows its position only within one turn."""
        self.registered = None
        self._motion.forget_goals()
        self.drive.switch(on=False)
        self._apply(range(ct.EEPROM_END, ct.GOAL_CURRENT), b"")
        self._forget_turns()
        self._check_limits()
        if self.table[ct.STARTUP] & ct.TORQUE_AT_STARTUP:
            self.drive.switch(on=not self._shut_down)

    def _apply(self, touched: range, before: bytes | bytearray) -> None:
        """Apply written registers to the drive. ``before``: their previous bytes."""
        table, drive = self.table, self.drive
        drive.feed_watchdog()
        if touched == _GOAL_POSITION_BYTES and not table[ct.DRIVE_MODE] & ct.TORQUE_ON_BY_GOAL:
            self._tune()
            self._aim()
            return
        if ct.OPERATING_MODE in touched and before and before[ct.OPERATING_MODE - touched.start] != table[11]:
            _reset_goals(table)
            self._motion.forget_goals()
        self._tune()
        if not _COORDINATES.isdisjoint(touched) and table[ct.OPERATING_MODE] == ct.POSITION:
            self._forget_turns()
        if not _LIMITS.isdisjoint(touched):
            self._check_limits()
        if ct.BUS_WATCHDOG in touched:
            if drive.tripped:
                self._motion.forget_profile()
            drive.watchdog_s = table[ct.BUS_WATCHDOG] * _WATCHDOG_STEP_S
            drive.tripped = False
        if ct.TORQUE_ENABLE in touched:
            self._switch(table[ct.TORQUE_ENABLE] != 0)
        elif table[ct.DRIVE_MODE] & ct.TORQUE_ON_BY_GOAL and not ct.GOAL_BYTES.isdisjoint(touched):
            self._switch(on=True)
        if touched.start < _GOAL_POSITION_BYTES.stop and touched.stop > _GOAL_POSITION_BYTES.start:
            self._aim()
        self._motion.drive_without_goal(touched, self._sign, self._nm_a_unit)

    def _aim(self) -> None:
        self._motion.aim(self._angle(_GOAL.unpack_from(self.table, ct.GOAL_POSITION)[0]))

    def _switch(self, on: bool) -> None:
        if on and not self.drive.torque_on and self.table[ct.OPERATING_MODE] == ct.POSITION:
            self._forget_turns()
        self.drive.switch(on and not self._shut_down)

    def _tune(self) -> None:
        self._motion.tune(self.gain_share, self._nm_a_unit)

    # -- values that the drive changes ------------------------------------------------------------------------------------

    def _update_table(self, begin: int, end: int, now_ns: int) -> None:
        """Update the registers in this range that the drive changes."""
        table, drive = self.table, self.drive
        table[ct.TORQUE_ENABLE] = drive.torque_on
        if drive.tripped:
            table[ct.BUS_WATCHDOG] = _TRIPPED
            self._motion.forget_profile()
        if begin < ct.TRAJECTORY and end > ct.GOAL_POSITION:
            # Both of the following use the same report.
            report, sign = drive.report, self._sign
            velocity, position = round(report.speed / RAD_S_A_UNIT), self._counts(report.angle)
            if begin < ct.PRESENT_CURRENT:
                struct.pack_into("<H", table, ct.REALTIME_TICK, now_ns // 1_000_000 & 0x7FFF)
                self._update_moving(velocity, position, self._update_goal())
            if end > ct.PRESENT_PWM:
                pwm = sign * (_pwm(report) if drive.torque_on else 0)
                current = sign * round(report.torque_nm / self._nm_a_unit)
                _PRESENT.pack_into(table, ct.PRESENT_PWM, pwm, current, sign * velocity, position)
        if begin < ct.BACKUP_READY and end > ct.TRAJECTORY:
            counts, velocity = self._counts(drive.smoothed_goal), self._sign * self._motion.trajectory_velocity
            struct.pack_into(
                "<iiHB", table, ct.TRAJECTORY, velocity, counts, round(10 * self._volt), self._temperature_c
            )
        if end > ct.PORT_DATA and self._has_ports:
            for port in (1, 2, 3):
                mode = table[ct.PORT_MODE + port]
                if mode != _OUTPUT:
                    high = mode == _PULLED_UP and not drive.contacts.get(port, False)
                    struct.pack_into("<H", table, ct.PORT_DATA + 2 * port, high)

    def _update_goal(self) -> int:
        """Update the goal's register. Return the goal in counts."""
        counts = self._counts(self.drive.goal)
        _GOAL.pack_into(self.table, ct.GOAL_POSITION, counts)
        return counts

    def _update_moving(self, velocity: int, position: int, goal: int) -> None:
        """Update the registers that show a movement. ``velocity``: of the shaft, in the register's unit."""
        (threshold,) = struct.unpack_from("<I", self.table, ct.MOVING_THRESHOLD)
        self.table[ct.MOVING] = abs(velocity) > threshold
        self.table[ct.MOVING + 1] = self._motion.status(in_position=abs(goal - position) <= _IN_POSITION_COUNTS)


def _reset_goals(table: bytearray) -> None:
    """Reset gains, goals and profile. A servo resets them when its operating mode changes."""
    ram = ct.ram_of(table)
    for span in (range(76, 80), range(80, 86), range(88, 92), range(100, 104), range(108, 116)):
        table[span.start : span.stop] = ram[span.start - ct.EEPROM_END : span.stop - ct.EEPROM_END]


def _pwm(report: DriveReport) -> int:
    """Return the PWM for torque and speed, in units of 0.113 %."""
    volt = RESISTANCE_OHM * report.torque_nm / NM_AN_AMPERE + NM_AN_AMPERE * report.speed
    return round(max(-885, min(885, 885 * volt / SUPPLY_V)))
