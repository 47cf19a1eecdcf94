"""The simulated servo against the maker's manual: every register and every instruction of the X series' control table.

Written from the ROBOTIS e-Manual (X series, pages of the models, and Protocol 2.0), not from the simulator.
"""

import struct
from collections.abc import Sequence

import pytest

from kata.device.bus.dynamixel.packets import StatusParser
from kata.simulator.apparatus import SimulatedApparatus
from kata.simulator.bus import ServoBus
from kata.simulator.protocol import Instruction
from kata.simulator.servos import Servo

PING, READ, WRITE, REG_WRITE, ACTION, RESET, REBOOT, CLEAR, BACKUP = 1, 2, 3, 4, 5, 6, 8, 0x10, 0x20
SYNC_READ, BULK_READ, FAST_BULK_READ = 0x82, 0x92, 0x9A
RESULT_FAIL, INSTRUCTION, RANGE, LENGTH, LIMIT, ACCESS, ALERT = 1, 2, 4, 5, 6, 7, 0x80
BROADCAST = 0xFE
BACK_UP, RESTORE = b"\x01CTRL", b"\x02CTRL"
CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"
SOON_NS = 1_000_000_000
"""Longer than any servo needs to start."""


class Station:
    """Five servos on a line without time, and the packets of a host."""

    def __init__(self, model: int = 1120) -> None:
        self.apparatus = SimulatedApparatus(None, 0)
        self.bus = ServoBus(self.apparatus)
        self.t_ns = 0
        self.baud = 1_000_000
        for servo in self.bus.servos:
            servo.exchange(servo.drive.motor, model)

    @property
    def servo(self) -> Servo:
        """Servo 1."""
        return self.bus.servos[0]

    def send(self, code: int, parameters: bytes = b"", drive_id: int = 1) -> list[tuple[int, int, bytes]]:
        """Return id, error byte and data of each answer."""
        instruction = Instruction(drive_id, code, parameters, len(parameters) + 10, valid=True)
        parser = StatusParser()
        answers = self.bus.execute(instruction, self.baud, self.t_ns)
        return [found for answer in answers for found in parser.feed(answer.data)]

    def read(self, address: int, size: int, drive_id: int = 1) -> int:
        """Return a value, signed."""
        ((_, error, data),) = self.send(READ, struct.pack("<HH", address, size), drive_id)
        assert error & ~ALERT == 0
        return int.from_bytes(data, "little", signed=True)

    def write(self, address: int, size: int, value: int, drive_id: int = 1) -> int:
        """Write a value; return the error byte."""
        data = (value & (1 << 8 * size) - 1).to_bytes(size, "little")
        ((_, error, _),) = self.send(WRITE, struct.pack("<H", address) + data, drive_id)
        return error

    def wait(self, ns: int = SOON_NS) -> None:
        """Let time pass."""
        self.t_ns += ns
        self.apparatus.advance(self.t_ns)


# Address, size, name, initial value, lowest and highest value; None: read only, or the value depends on the drive.
EEPROM: list[tuple[int, int, str, int | None, tuple[int, int] | None]] = [
    (0, 2, "Model Number", 1120, None),
    (2, 4, "Model Information", None, None),
    (6, 1, "Firmware Version", None, None),
    (7, 1, "ID", 1, (0, 252)),
    (9, 1, "Return Delay Time", 250, (0, 254)),
    (10, 1, "Drive Mode", 0, (0, 15)),
    (12, 1, "Secondary ID", 255, (0, 255)),
    (13, 1, "Protocol Type", 2, (2, 2)),
    (20, 4, "Homing Offset", 0, (-1_044_479, 1_044_479)),
    (24, 4, "Moving Threshold", 10, (0, 1_023)),
    (31, 1, "Temperature Limit", 80, (0, 100)),
    (32, 2, "Max Voltage Limit", 160, (95, 160)),
    (34, 2, "Min Voltage Limit", 95, (95, 160)),
    (36, 2, "PWM Limit", 885, (0, 885)),
    (38, 2, "Current Limit", 2_047, (0, 2_047)),
    (44, 4, "Velocity Limit", 128, (0, 1_023)),
    (48, 4, "Max Position Limit", 4_095, (0, 4_095)),
    (52, 4, "Min Position Limit", 0, (0, 4_095)),
    (56, 1, "External Port Mode 1", 3, (0, 3)),
    (57, 1, "External Port Mode 2", 3, (0, 3)),
    (58, 1, "External Port Mode 3", 3, (0, 3)),
    (60, 1, "Startup Configuration", 0, (0, 3)),
    (63, 1, "Shutdown", 52, (0, 63)),
]
RAM: list[tuple[int, int, str, int | None, tuple[int, int] | None]] = [
    (64, 1, "Torque Enable", 0, (0, 1)),
    (65, 1, "LED", 0, (0, 1)),
    (68, 1, "Status Return Level", 2, (0, 2)),
    (69, 1, "Registered Instruction", 0, None),
    (70, 1, "Hardware Error Status", 0, None),
    (76, 2, "Velocity I Gain", 1_920, (0, 16_383)),
    (78, 2, "Velocity P Gain", 100, (0, 16_383)),
    (80, 2, "Position D Gain", 0, (0, 16_383)),
    (82, 2, "Position I Gain", 0, (0, 16_383)),
    (84, 2, "Position P Gain", 800, (0, 16_383)),
    (88, 2, "Feedforward 2nd Gain", 0, (0, 16_383)),
    (90, 2, "Feedforward 1st Gain", 0, (0, 16_383)),
    (98, 1, "Bus Watchdog", 0, (0, 127)),
    (100, 2, "Goal PWM", 885, (-885, 885)),
    (102, 2, "Goal Current", 2_047, (-2_047, 2_047)),
    (104, 4, "Goal Velocity", 0, (-128, 128)),
    (108, 4, "Profile Acceleration", 0, (0, 32_767)),
    (112, 4, "Profile Velocity", 0, (0, 32_767)),
    (116, 4, "Goal Position", None, (0, 4_095)),
    (120, 2, "Realtime Tick", None, None),
    (122, 1, "Moving", 0, None),
    (123, 1, "Moving Status", None, None),
    (124, 2, "Present PWM", 0, None),
    (126, 2, "Present Current", 0, None),
    (128, 4, "Present Velocity", None, None),
    (132, 4, "Present Position", None, None),
    (136, 4, "Velocity Trajectory", 0, None),
    (140, 4, "Position Trajectory", None, None),
    (144, 2, "Present Input Voltage", 120, None),
    (146, 1, "Present Temperature", None, None),
    (147, 1, "Backup Ready", 0, None),
    (168, 2, "Indirect Address 1", 224, (64, 661)),
    (222, 2, "Indirect Address 28", 251, (64, 661)),
    (224, 1, "Indirect Data 1", 0, (0, 255)),
    (578, 2, "Indirect Address 29", 634, (64, 661)),
    (632, 2, "Indirect Address 56", 661, (64, 661)),
    (661, 1, "Indirect Data 56", 0, (0, 255)),
]
GOALS = (100, 102, 104, 116)


@pytest.mark.parametrize(("address", "size", "name", "initial", "limits"), EEPROM + RAM)
def test_register(address: int, size: int, name: str, initial: int | None, limits: tuple[int, int] | None) -> None:
    """Factory value, access, length and range."""
    station = Station()
    if initial is not None:
        assert station.read(address, size) & (1 << 8 * size) - 1 == initial, name
    if limits is None:
        assert station.write(address, size, 1) == ACCESS
        return
    if size > 1:
        ((_, error, _),) = station.send(WRITE, struct.pack("<HB", address, 1))
        assert error == LENGTH
    low, high = limits
    outside = LIMIT if address in GOALS else RANGE
    if size * 8 > high.bit_length() + (low < 0):
        assert station.write(address, size, high + 1) == outside
    if low:
        assert station.write(address, size, low - 1) == outside
    for value in (low, high) if name != "Status Return Level" else (high,):
        # A limit that the present voltage or temperature exceeds is accepted and raises the alert.
        assert station.write(address, size, value, station.servo.id) & ~ALERT == 0
        assert station.read(address, size, station.servo.id) == _signed(value, size)


def _signed(value: int, size: int) -> int:
    return int.from_bytes((value & (1 << 8 * size) - 1).to_bytes(size, "little"), "little", signed=True)


@pytest.mark.parametrize(
    ("model", "volt", "voltage_limits", "current_limit", "velocity_limit"),
    [
        (1100, 120, (95, 160), 2_047, 167),
        (1120, 120, (95, 160), 2_047, 128),
        (1140, 240, (110, 300), 2_047, 128),
        (1020, 120, (95, 160), 1_193, 200),
    ],
)
def test_models_differ(
    model: int, volt: int, voltage_limits: tuple[int, int], current_limit: int, velocity_limit: int
) -> None:
    station = Station(model)
    assert (station.read(0, 2), station.read(144, 2)) == (model, volt)
    assert (station.read(34, 2), station.read(32, 2)) == voltage_limits
    assert (station.read(38, 2), station.read(44, 4)) == (current_limit, velocity_limit)
    assert station.write(38, 2, current_limit + 1) == RANGE
    assert station.read(70, 1) == 0


@pytest.mark.parametrize("port", [1, 2, 3])
def test_external_port_is_an_output_or_an_input(port: int) -> None:
    station = Station()
    data = 150 + 2 * port
    assert station.read(data, 2) == 0
    assert station.write(55 + port, 1, 1) == 0
    assert station.write(data, 2, 1) == 0
    assert station.read(data, 2) == 1
    assert station.write(55 + port, 1, 3) == 0
    assert station.read(data, 2) == 0
    station.write(55 + port, 1, 2)
    closed = station.servo.drive.contacts.get(port, False)
    assert station.read(data, 2) == (0 if closed else 1)


@pytest.mark.parametrize("model", [1020, 1030])
def test_xm430_has_no_external_ports(model: int) -> None:
    station = Station(model)
    for address, size in ((56, 1), (57, 1), (58, 1), (152, 2), (154, 2), (156, 2)):
        assert station.send(READ, struct.pack("<HH", address, size)) == [(1, ACCESS, b"")]
        assert station.write(address, size, 2) == ACCESS
        assert station.send(REG_WRITE, struct.pack("<HB", address, 2) + bytes(size - 1)) == [(1, ACCESS, b"")]
    # Undefined bytes between defined ones read 0.
    ((_, error, block),) = station.send(READ, struct.pack("<HH", 52, 9))
    assert (error, block[4:7]) == (0, bytes(3))


@pytest.mark.parametrize(("code", "rate"), [(0, 9_600), (1, 57_600), (2, 115_200), (3, 10**6), (7, 4_500_000)])
def test_baud_rate_counts_after_the_answer(code: int, rate: int) -> None:
    station = Station()
    assert station.write(8, 1, code) == 0
    station.baud = rate
    assert station.read(8, 1) == code
    assert station.write(8, 1, 8) == RANGE


@pytest.mark.parametrize("mode", [0, 1, 3, 4, 5, 16])
def test_operating_mode_resets_gains_goals_and_profile(mode: int) -> None:
    station = Station()
    assert station.write(11, 1, 4 if mode == 3 else 3) == 0
    for address, size, value in ((84, 2, 50), (80, 2, 60), (102, 2, 30), (112, 4, 20)):
        assert station.write(address, size, value) == 0
    assert station.write(11, 1, mode) == 0
    assert [station.read(address, 2) for address in (84, 80, 102, 112)] == [800, 0, 2_047, 0]
    assert station.write(11, 1, 2) == RANGE


def test_undefined_addresses_can_be_neither_read_nor_written() -> None:
    station = Station()
    for address in (14, 66, 160, 300, 700):
        ((_, error, _),) = station.send(READ, struct.pack("<HH", address, 1))
        assert error == ACCESS
        assert station.write(address, 1, 0) == ACCESS


def test_eeprom_is_locked_while_torque_is_on() -> None:
    station = Station()
    assert station.write(64, 1, 1) == 0
    for address, size, *_ in EEPROM:
        assert station.write(address, size, 0) == ACCESS
    assert station.write(84, 2, 10) == 0


# -- position ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [4, 5])
def test_half_turn_calibration_reads_the_middle(mode: int) -> None:
    """As calibrations of other projects do it: Homing Offset is half a turn less the present position."""
    station = Station()
    for drive_id in range(1, 6):
        assert station.write(11, 1, mode, drive_id) == 0
        assert station.write(20, 4, 2047 - station.read(132, 4, drive_id), drive_id) == 0
        assert station.read(132, 4, drive_id) == 2047


def test_homing_offset_moves_goals_too() -> None:
    station = Station()
    station.write(11, 1, 5)
    here = station.read(132, 4)
    station.write(20, 4, 500)
    station.write(64, 1, 1)
    assert station.write(116, 4, here + 500) == 0
    assert station.servo.drive.goal == pytest.approx(station.servo.drive.angle, abs=0.002)


def test_position_control_mode_ignores_a_large_homing_offset() -> None:
    station = Station()
    here = station.read(132, 4)
    station.write(20, 4, 1024)
    assert station.read(132, 4) == here + 1024
    station.write(20, 4, 1025)
    assert station.read(132, 4) == here


def test_reverse_mode_inverts_position_velocity_and_current() -> None:
    station = Station()
    station.write(11, 1, 4)
    here = station.read(132, 4)
    assert station.write(10, 1, 1) == 0
    assert station.read(132, 4) == -here
    station.write(20, 4, 7)
    assert station.read(132, 4) == -here + 7
    station.servo.drive.speed, station.servo.drive.torque_nm = 1.0, 2.0
    assert station.read(128, 4) < 0
    assert station.read(126, 2) < 0
    station.write(116, 4, -here + 7 + 100)
    assert station.servo.drive.goal < station.servo.drive.angle


def test_current_is_the_models() -> None:
    for model, nm_a in ((1120, 10.6 / 4.4), (1140, 9.2 / 2.4), (1100, 9.9 / 4.9), (1020, 4.1 / 2.3)):
        station = Station(model)
        station.servo.drive.torque_nm = 3.0
        assert station.read(126, 2) == round(3.0 / nm_a / 0.00269)


def test_exchanged_model_limits_its_own_torque_for_the_same_registers() -> None:
    station = Station(1020)
    before_nm = station.servo.drive.limit_nm
    station.servo.exchange(1, 1030)
    assert station.servo.drive.limit_nm == pytest.approx(before_nm * (3.0 / 2.3) / (4.1 / 2.3))


def test_turns_are_lost_at_power_up_and_in_mode_3() -> None:
    station = Station()
    raw = station.read(132, 4)
    for turns in (0, 3, -2):
        station.write(11, 1, 4)
        station.servo.zero = 2048 + 4096 * turns
        assert station.read(132, 4) == raw + 4096 * turns
        station.write(11, 1, 3)
        assert station.read(132, 4) == raw
        station.servo.zero += 4096
        station.write(64, 1, 1)
        assert station.read(132, 4) == raw
        station.write(64, 1, 0)
    station.write(11, 1, 4)
    station.write(20, 4, 5000)
    station.servo.zero += 4096
    station.send(REBOOT)
    station.wait()
    assert station.read(132, 4) == raw + 5000


def test_clear_resets_the_turns_of_a_servo_at_rest() -> None:
    station = Station()
    station.write(11, 1, 4)
    station.wait()
    raw = station.read(132, 4)
    station.servo.zero += 3 * 4096
    station.servo.drive.speed = 2.0
    assert station.send(CLEAR, CLEAR_TURNS) == [(1, RESULT_FAIL, b"")]
    station.servo.drive.speed = 0.0
    assert station.send(CLEAR, b"\x01\0\0\0\0") == [(1, RANGE, b"")]
    assert station.send(CLEAR, CLEAR_TURNS) == [(1, 0, b"")]
    assert station.read(132, 4) == raw


def test_moving_follows_its_threshold() -> None:
    station = Station()
    station.servo.drive.speed = 0.5  # 20.8 units of 0.229 rev/min
    assert station.read(122, 1) == 1
    assert station.write(24, 4, 21) == 0
    assert station.read(122, 1) == 0


def test_goals_have_the_limits_of_the_eeprom() -> None:
    station = Station()
    for limit, size, value in ((36, 2, 400), (38, 2, 500), (44, 4, 60), (48, 4, 3_000), (52, 4, 1_000)):
        assert station.write(limit, size, value) == 0
    for goal, size, value in ((100, 2, 400), (102, 2, 500), (104, 4, 60)):
        assert [station.write(goal, size, v) for v in (value, -value, value + 1, -value - 1)] == [0, 0, LIMIT, LIMIT]
    assert [station.write(116, 4, v) for v in (1_000, 3_000, 999, 3_001)] == [0, 0, LIMIT, LIMIT]
    for mode in (4, 5):
        station.write(11, 1, mode)
        assert [station.write(116, 4, v) for v in (-1_048_575, 1_048_575, 1_048_576)] == [0, 0, LIMIT]


def test_torque_on_by_goal_update() -> None:
    station = Station()
    station.write(11, 1, 5)
    here = station.read(132, 4)
    station.write(116, 4, here + 10)
    assert station.read(64, 1) == 0
    station.write(10, 1, 8)
    assert station.write(116, 4, here + 20) == 0
    assert (station.read(64, 1), station.read(116, 4)) == (1, here + 20)


# -- movement ------------------------------------------------------------------------------------------------------------


def moving(station: Station, size: int, address: int, motor: int, times_ms: Sequence[int]) -> list[int]:
    """Return a register of a motor at these times."""
    begin, found = station.t_ns, []
    for ms in times_ms:
        station.wait(begin + ms * 1_000_000 - station.t_ns)
        found.append(station.read(address, size, motor))
    return found


def free_motor(mode: int, motor: int = 4) -> tuple[Station, int]:
    """Return a station with motor 4 at its rest angle in an operating mode, and the motor's position."""
    station = Station()
    station.write(11, 1, mode, motor)
    return station, station.read(132, 4, motor)


def test_without_a_profile_the_trajectory_jumps() -> None:
    station, here = free_motor(4)
    station.write(64, 1, 1, 4)
    station.write(116, 4, here + 300, 4)
    assert moving(station, 4, 140, 4, [100]) == [here + 300]
    assert station.read(123, 1, 4) & 0x32 == 0


def test_velocity_profile_is_a_ramp() -> None:
    """Rectangular: 20 units of 0.229 rev/min are 313 counts per second."""
    station, here = free_motor(4)
    station.write(112, 4, 20, 4)
    station.write(64, 1, 1, 4)
    station.write(116, 4, here + 313, 4)
    station.wait(100_000_000)
    status = station.read(123, 1, 4)
    assert (status & 0x30, status & 0x02, station.read(136, 4, 4)) == (0x10, 0x02, 20)
    trajectory = moving(station, 4, 140, 4, [200, 400, 1_500])
    assert [count - here for count in trajectory] == pytest.approx([94 - 2, 156 - 2, 313], abs=4)
    assert station.read(132, 4, 4) == pytest.approx(here + 313, abs=12)
    assert station.read(123, 1, 4) & 0x32 == 0


@pytest.mark.parametrize(("goal", "shape"), [(60, 0x20), (2_000, 0x30)])
def test_acceleration_makes_a_triangle_or_a_trapezium(goal: int, shape: int) -> None:
    """2 units of 214.577 rev/min^2 are 488 counts/s^2: 313 counts per second are reached after 641 ms and 100 counts."""
    station, here = free_motor(4)
    station.send(WRITE, struct.pack("<HII", 108, 2, 20), 4)
    station.write(64, 1, 1, 4)
    station.write(116, 4, here + goal, 4)
    speeds = moving(station, 4, 136, 4, range(20, 680, 20))
    assert station.read(123, 1, 4) & 0x30 == shape
    assert speeds[10] == pytest.approx(20 * 220 / 641, abs=1.5)
    assert max(speeds) == (20 if shape == 0x30 else pytest.approx(11, abs=1))
    assert moving(station, 4, 140, 4, [9_000]) == [here + goal]


def test_profile_by_time_arrives_in_time() -> None:
    station, here = free_motor(4)
    station.write(10, 1, 4, 4)
    station.send(WRITE, struct.pack("<HII", 108, 200, 1_000), 4)
    station.write(64, 1, 1, 4)
    station.write(116, 4, here + 400, 4)
    trajectory = [count - here for count in moving(station, 4, 140, 4, [500, 900, 1_060])]
    # It brakes for the last 200 ms. A drive smooths its trajectory for some milliseconds.
    assert trajectory == pytest.approx([200, 387, 400], abs=6)


def test_velocity_mode_keeps_a_speed_in_both_directions() -> None:
    for sign, reverse in ((1, 0), (-1, 0), (1, 1)):
        station, _ = free_motor(1)
        station.write(10, 1, reverse, 4)
        here = station.read(132, 4, 4)
        station.write(64, 1, 1, 4)
        assert station.write(104, 4, sign * 20, 4) == 0
        begin, end = moving(station, 4, 132, 4, [500, 1_000])
        assert sign * (end - begin) == pytest.approx(156, abs=25)
        assert sign * (end - here) > 200
        station.write(104, 4, 0, 4)
        stopped, later = moving(station, 4, 132, 4, [800, 1_200])
        assert later == pytest.approx(stopped, abs=3)


@pytest.mark.parametrize(("mode", "goal", "weak", "strong"), [(0, 102, 2, 200), (16, 100, 4, 120)])
def test_modes_for_current_and_pwm_push(mode: int, goal: int, weak: int, strong: int) -> None:
    """Torque on alone moves nothing. A goal below the friction does not either; a larger one moves in its direction."""
    station, here = free_motor(mode)
    station.write(64, 1, 1, 4)
    assert moving(station, 4, 132, 4, [300]) == pytest.approx([here], abs=3)
    station.write(goal, 2, weak, 4)
    assert moving(station, 4, 132, 4, [300]) == pytest.approx([here], abs=6)
    station.write(goal, 2, -strong, 4)
    assert moving(station, 4, 132, 4, [400])[0] < here - 40
    assert station.read(126, 2, 4) < 0


def test_current_mode_reports_the_goal_current() -> None:
    station, _ = free_motor(0)
    station.write(64, 1, 1, 4)
    station.write(102, 2, 60, 4)
    station.wait(50_000_000)
    assert station.read(126, 2, 4) == 60


def test_pwm_limit_reduces_the_torque() -> None:
    station, _ = free_motor(5)
    before_nm = station.bus.servos[3].drive.limit_nm
    station.write(100, 2, 20, 4)
    limited_nm = station.bus.servos[3].drive.limit_nm
    assert limited_nm == pytest.approx(20 / 885 * 24 / 1.26 * 2, rel=0.01)
    assert limited_nm < before_nm


@pytest.mark.parametrize("mode", [0, 1, 16])
def test_goal_position_moves_nothing_in_other_modes(mode: int) -> None:
    station, here = free_motor(mode)
    station.write(64, 1, 1, 4)
    station.write(116, 4, here + 300, 4)
    assert moving(station, 4, 132, 4, [500]) == pytest.approx([here], abs=6)


@pytest.mark.parametrize("mode", [0, 1, 16])
def test_watchdog_stops_every_mode(mode: int) -> None:
    station, _ = free_motor(mode)
    station.write(64, 1, 1, 4)
    station.write(98, 1, 5, 4)
    station.write({0: 102, 1: 104, 16: 100}[mode], {0: 2, 1: 4, 16: 2}[mode], {0: -40, 1: -20, 16: -60}[mode], 4)
    station.wait(600_000_000)
    assert station.read(98, 1, 4) == -1
    stopped, later = moving(station, 4, 132, 4, [1_500, 2_000])
    assert later == pytest.approx(stopped, abs=6)


# -- identity and answers ---------------------------------------------------------------------------------------------------


def test_new_id_counts_after_the_answer() -> None:
    station = Station()
    assert station.send(WRITE, bytes([7, 0, 42])) == [(1, 0, b"")]
    assert station.send(PING) == []
    assert station.send(PING, drive_id=42) == [(42, 0, b"\x60\x04\x30")]


def test_secondary_id_reaches_ram_and_is_not_answered() -> None:
    """The example of the manual: five servos with the secondary id 5, then 100."""
    station = Station()
    for drive_id in range(1, 6):
        station.write(12, 1, 5, drive_id)
    assert station.send(WRITE, bytes([65, 0, 1]), 1) == [(1, 0, b"")]
    assert station.send(WRITE, bytes([65, 0, 1]), 5) == [(5, 0, b"")]
    assert [station.read(65, 1, drive_id) for drive_id in range(1, 6)] == [1] * 5
    for drive_id in range(1, 6):
        station.write(12, 1, 100, drive_id)
    assert station.send(WRITE, bytes([65, 0, 0]), 100) == []
    assert [station.read(65, 1, drive_id) for drive_id in range(1, 6)] == [0] * 5
    assert station.send(WRITE, bytes([31, 0, 70]), 100) == []
    assert station.read(31, 1) == 80


def test_status_return_level() -> None:
    station = Station()
    station.write(68, 1, 1)
    assert station.send(WRITE, bytes([65, 0, 1])) == []
    assert station.read(65, 1) == 1
    station.send(WRITE, bytes([68, 0, 0]))
    assert station.send(READ, bytes([65, 0, 1, 0])) == []
    assert len(station.send(PING)) == 1


@pytest.mark.parametrize("delay", [0, 250])
def test_return_delay(delay: int) -> None:
    station = Station()
    station.write(9, 1, delay)
    (answer,) = station.bus.execute(Instruction(1, PING, b"", 10, valid=True), station.baud, 0)
    assert answer.after_s == pytest.approx(2e-6 * delay + len(answer.data) * 10 / station.baud)


def test_registered_instruction_waits_for_an_action() -> None:
    station = Station()
    assert station.send(ACTION) == [(1, INSTRUCTION, b"")]
    assert station.send(REG_WRITE, bytes([65, 0, 2])) == [(1, RANGE, b"")]
    assert station.send(REG_WRITE, bytes([65, 0, 1])) == [(1, 0, b"")]
    assert (station.read(69, 1), station.read(65, 1)) == (1, 0)
    assert station.send(ACTION) == [(1, 0, b"")]
    assert (station.read(69, 1), station.read(65, 1)) == (0, 1)


def test_indirect_addresses() -> None:
    """The manual's two examples, a read-only target, and EEPROM, which cannot be a target."""
    station = Station()
    assert station.write(168, 2, 65) == 0
    assert station.write(224, 1, 1) == 0
    assert station.read(65, 1) == 1
    assert station.write(224, 1, 2) == RANGE
    station.write(11, 1, 4)
    assert station.send(WRITE, struct.pack("<H4H", 170, 116, 117, 118, 119)) == [(1, 0, b"")]
    assert station.write(225, 4, 1_024) == 0
    assert station.read(116, 4) == 1_024
    station.send(WRITE, struct.pack("<H4H", 578, 132, 133, 134, 135))
    assert station.read(634, 4) == station.read(132, 4)
    assert station.write(634, 4, 0) == ACCESS
    assert station.write(168, 2, 63) == RANGE
    assert station.write(168, 2, 662) == RANGE


def test_bulk_reads_have_an_address_for_each_servo() -> None:
    station = Station()
    wanted = struct.pack("<BHHBHH", 1, 144, 2, 2, 146, 1)
    assert station.send(BULK_READ, wanted, BROADCAST) == [(1, 0, b"\x78\x00"), (2, 0, b"\x20")]
    instruction = Instruction(BROADCAST, FAST_BULK_READ, wanted, 20, valid=True)
    answers = [answer.data for answer in station.bus.execute(instruction, station.baud, 0)]
    whole = b"".join(answers)
    assert int.from_bytes(whole[5:7], "little") + 7 == len(whole)
    assert (whole[9:12], whole[14:17]) == (b"\x01\x78\x00", b"\0\x02\x20")


def test_fast_sync_read_is_the_manuals_example() -> None:
    """Servos 3, 7 and 4 with present positions 166, 2079 and 1023."""
    station = Station()
    for servo, drive_id in zip(station.bus.servos, (3, 7, 4, 8, 9), strict=True):
        servo.table[7] = drive_id
    for servo, position in zip(station.bus.servos, (166, 2_079, 1_023), strict=False):
        servo.zero += position - station.read(132, 4, servo.id)
    instruction = Instruction(BROADCAST, 0x8A, struct.pack("<HH3B", 132, 4, 3, 7, 4), 17, valid=True)
    answers = [answer.data.hex(" ") for answer in station.bus.execute(instruction, station.baud, 0)]
    assert answers == [
        "ff ff fd 00 fe 19 00 55 00 03 a6 00 00 00 84 08",
        "00 07 1f 08 00 00 16 ca",
        "00 04 ff 03 00 00 d1 9e",
    ]


# -- errors, watchdog and start -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("shutdown", "torque"), [(52, 0), (0, 1)])
def test_shutdown_mask_decides_whether_an_error_cuts_torque(shutdown: int, torque: int) -> None:
    station = Station()
    station.write(63, 1, shutdown)
    station.write(64, 1, 1)
    station.servo.expose(temperature_c=81)
    assert station.send(READ, struct.pack("<HH", 70, 1)) == [(1, ALERT, b"\x04")]
    assert station.read(64, 1) == torque
    station.servo.expose(temperature_c=30)
    assert station.read(70, 1) == 4
    assert station.write(64, 1, 1) == ALERT
    assert station.read(64, 1) == torque
    station.send(REBOOT)
    station.wait()
    assert station.send(READ, struct.pack("<HH", 70, 1)) == [(1, 0, b"\0")]


def test_voltage_outside_its_limits_does_not_cut_torque() -> None:
    station = Station()
    station.write(64, 1, 1)
    station.servo.expose(volt=9.4)
    assert (station.read(144, 2), station.read(70, 1), station.read(64, 1)) == (94, 1, 1)
    station = Station()
    station.servo.expose(volt=16.1)
    assert station.read(70, 1) == 1


def test_bus_watchdog() -> None:
    station = Station()
    station.write(11, 1, 5)
    station.write(64, 1, 1)
    station.write(98, 1, 2)
    station.wait(60_000_000)
    assert (station.read(98, 1), station.read(64, 1)) == (-1, 1)
    for address, size in ((100, 2), (102, 2), (116, 4)):
        assert station.write(address, size, 0) == RANGE
    assert station.write(98, 1, 0) == 0
    assert station.write(116, 4, station.read(132, 4)) == 0


def test_bus_watchdog_resets_the_profile() -> None:
    station = Station()
    station.write(11, 1, 5)
    station.send(WRITE, struct.pack("<HII", 108, 3, 40))
    station.write(64, 1, 1)
    station.write(98, 1, 2)
    station.wait(60_000_000)
    assert station.write(98, 1, 0) == 0
    assert (station.read(108, 4), station.read(112, 4)) == (0, 0)


def test_realtime_tick_begins_again_at_32768_milliseconds() -> None:
    station = Station()
    for ms in (5, 1_000, 32_767, 32_768, 70_000):
        station.t_ns = ms * 1_000_000
        assert station.read(120, 2) & 0xFFFF == ms % 32_768


def test_starting_servo_answers_nothing() -> None:
    station = Station()
    station.write(84, 2, 1)
    assert station.send(REBOOT) == [(1, 0, b"")]
    assert station.send(PING) == []
    station.wait(100_000_000)
    assert station.send(PING) == []
    station.wait()
    assert len(station.send(PING)) == 1
    assert station.read(84, 2) == 800


@pytest.mark.parametrize(("option", "drive_id", "baud"), [(0xFF, 1, 1), (1, 9, 1), (2, 9, 2)])
def test_factory_reset(option: int, drive_id: int, baud: int) -> None:
    station = Station()
    station.write(31, 1, 70)
    station.write(7, 1, 9)
    station.write(8, 1, 2, 9)
    station.baud = 115_200
    station.send(WRITE, bytes([7, 0, 10]), 1)
    assert station.send(RESET, bytes([option]), 9) == [(9, 0, b"")]
    station.wait()
    station.baud = {1: 57_600, 2: 115_200}[baud]
    assert (station.read(7, 1, drive_id), station.read(8, 1, drive_id), station.read(31, 1, drive_id)) == (
        drive_id,
        baud,
        80,
    )


def test_full_factory_reset_is_not_for_all_servos() -> None:
    station = Station()
    assert station.send(RESET, b"\xff", BROADCAST) == []
    assert station.send(RESET, b"\x03") == [(1, RANGE, b"")]
    assert [station.read(7, 1, drive_id) for drive_id in range(1, 6)] == [1, 2, 3, 4, 5]


def test_control_table_backup() -> None:
    station = Station()
    assert station.send(BACKUP, RESTORE) == [(1, RESULT_FAIL, b"")]
    station.write(31, 1, 70)
    station.write(84, 2, 640)
    station.write(168, 2, 65)
    station.write(64, 1, 1)
    assert station.send(BACKUP, BACK_UP) == [(1, RESULT_FAIL, b"")]
    station.write(64, 1, 0)
    assert station.send(BACKUP, BACK_UP) == [(1, 0, b"")]
    assert station.read(147, 1) == 1
    station.write(31, 1, 60)
    assert station.send(BACKUP, RESTORE) == [(1, 0, b"")]
    assert station.send(PING) == []
    station.wait()
    assert (station.read(31, 1), station.read(84, 2), station.read(168, 2)) == (70, 800, 224)


def test_startup_configuration() -> None:
    """Bit 1 restores the backup's RAM, bit 0 switches torque on."""
    station = Station()
    station.write(84, 2, 640)
    station.write(168, 2, 65)
    station.send(BACKUP, BACK_UP)
    started = []
    for configuration in (0, 1, 2, 3):
        station.write(64, 1, 0)
        station.write(60, 1, configuration)
        station.send(REBOOT)
        station.wait()
        started.append((station.read(64, 1), station.read(84, 2), station.read(168, 2)))
    assert started == [(0, 800, 224), (1, 800, 224), (0, 640, 65), (1, 640, 65)]


@pytest.mark.parametrize("parameters", [b"", b"\x01", b"\x01\x02\x03\x04\x05\x06", bytes(20)])
@pytest.mark.parametrize("code", [*range(0x25), 0x55, *range(0x80, 0xA0)])
def test_no_instruction_crashes_it(code: int, parameters: bytes) -> None:
    station = Station()
    for drive_id in (1, BROADCAST):
        answers: Sequence[object] = station.send(code, parameters, drive_id)
        assert len(answers) <= 5
    station.wait()


def ramp_lag(first: int, second: int = 0, acceleration: int = 0, p: int = 800, d: int = 1_440) -> float:
    """Return by how many counts motor 1 lags behind a ramp of 20 units, with these feed-forward gains."""
    station = Station()
    station.write(11, 1, 4)
    station.send(WRITE, struct.pack("<HHHH", 80, d, 0, p))
    station.send(WRITE, struct.pack("<HHH", 88, second, first))
    station.send(WRITE, struct.pack("<HII", 108, acceleration, 20))
    here = station.read(132, 4)
    station.write(64, 1, 1)
    station.write(116, 4, here + 350)
    lags = []
    for _ in range(10 if acceleration else 20):
        station.wait(30_000_000)
        lags.append(station.read(140, 4) - station.read(132, 4))
    return sum(lags[-5:]) / 5


def test_first_feedforward_gain_acts_on_the_speed_of_the_trajectory() -> None:
    """The manual divides D by 16 and this gain by 4: a quarter of D compensates it."""
    none, half, whole = (ramp_lag(first) for first in (0, 180, 360))
    assert none > 50.0
    assert half == pytest.approx(none / 2, abs=4.0)
    assert abs(whole) < 5.0


def test_second_feedforward_gain_acts_on_the_acceleration_of_the_trajectory() -> None:
    none, some, more = (ramp_lag(0, second, acceleration=2, p=100, d=200) for second in (0, 8_000, 16_000))
    assert none > some + 3.0 > more + 6.0
    assert ramp_lag(0, 16_000) == pytest.approx(ramp_lag(0), abs=1.0), "a ramp has no acceleration"


def test_feedforward_gains_need_a_profile() -> None:
    """A goal without a profile is a step, whose trajectory has no speed."""
    angles = []
    for first in (0, 360):
        station, here = free_motor(4)
        station.write(90, 2, first, 4)
        station.write(64, 1, 1, 4)
        station.write(116, 4, here + 300, 4)
        angles.append(moving(station, 4, 132, 4, [40, 80, 160, 320]))
    assert angles[0] == angles[1]
