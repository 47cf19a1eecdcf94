"""The cycle state built from samples: ages, durations, and values that are not known."""

import math
from dataclasses import dataclass, field

import msgspec
import pytest

from kata.device.bus.interface import BusSample, DriveSample, DriveStatus, InputSample
from kata.device.config import Inputs, StationConfig
from kata.device.cycle_state import CycleState, CycleStateBuilder, LoopContext
from kata.device.ipc_messages import TorqueState
from tests.support.stepped import REST_DEG

MS = 1_000_000
START_NS = 1_000_000_000
ALONE = LoopContext(late_ms=0.0, service_age_ms=0.0, run_id_mismatches=0, journal_ok=True, limits_deg=(), rate_hz=100)
TURNING = 1
"""The axis that the tests change."""


@dataclass
class Watched:
    """A builder, and samples without any fault except what a test changes."""

    config: StationConfig = field(default_factory=StationConfig)

    def __post_init__(self) -> None:
        self.observer = CycleStateBuilder(self.config)

    def reading(self, at_ms: float, torque_on: bool = False) -> BusSample:
        t_ns = START_NS + int(at_ms * MS)
        return BusSample(
            drives=tuple(DriveSample(t_ns, angle, 0.0, 0.0) for angle in REST_DEG),
            inputs=InputSample(t_ns, estop_open=False, pedal_down=False),
            statuses=tuple(DriveStatus(t_ns, n, torque_on, 0, False) for n in range(5)),
        )

    def hear(self, at_ms: float, reading: BusSample | None) -> CycleState:
        return self.observer.build(START_NS + int(at_ms * MS), reading, ALONE)

    def drive(self, at_ms: float, **values: float) -> CycleState:
        """Give axis 1 an answer with these values."""
        reading = self.reading(at_ms)
        drives = list(reading.drives)
        said = drives[TURNING]
        assert said is not None
        drives[TURNING] = DriveSample(
            said.t_ns,
            values.get("position_deg", said.position_deg),
            values.get("speed_deg_s", 0.0),
            values.get("torque_nm", 0.0),
        )
        return self.hear(at_ms, msgspec.structs.replace(reading, drives=tuple(drives)))

    def pedal(self, at_ms: float, down: bool | None) -> bool | None:
        inputs = InputSample(START_NS + int(at_ms * MS), estop_open=False, pedal_down=down)
        return self.hear(at_ms, msgspec.structs.replace(self.reading(at_ms), inputs=inputs)).pedal_down

    def command(self, at_ms: float, setpoint_deg: float, torque_on: bool = True) -> None:
        """Command a setpoint for axis 1."""
        setpoints = (REST_DEG[0], setpoint_deg, *REST_DEG[2:])
        t_ns = START_NS + int(at_ms * MS)
        self.observer.record_command(t_ns, torque_on, setpoints, t_ns)


@pytest.fixture
def watched() -> Watched:
    return Watched()


# -- known and unknown ------------------------------------------------------------------------------------------------


def test_before_the_first_answer_everything_is_unknown(watched: Watched) -> None:
    state = watched.hear(0, BusSample((None,) * 5, None, ()))
    assert state.bus_ok
    assert not state.complete
    assert state.estop == "unknown"
    assert state.pedal_down is None
    assert all(math.isnan(angle) for angle in state.measured_deg)
    assert state.speed_deg_s == state.torque_nm == (0.0,) * 5
    assert state.drive_age_ms == (math.inf,) * 5
    # The port has just been opened: no drive's status is late yet.
    assert state.status_age_ms == (0.0,) * 5
    assert watched.hear(1000, BusSample((None,) * 5, None, ())).status_age_ms == (1000.0,) * 5
    assert watched.hear(1010, None).status_age_ms == (math.inf,) * 5
    assert state.corrupt == state.watchdog_tripped == (False,) * 5
    assert state.hardware_error == (0,) * 5
    assert state.torque_reported == (None,) * 5
    assert state.measured_t_ns is None
    assert not state.torque_on
    assert all(math.isnan(angle) for angle in state.setpoint_deg)


def test_after_every_answer_everything_is_known(watched: Watched) -> None:
    state = watched.hear(100, watched.reading(100))
    assert state.complete
    assert state.estop == "closed"
    assert state.measured_deg == REST_DEG
    assert state.drive_age_ms == state.status_age_ms == (0.0,) * 5
    assert state.torque_reported == (False,) * 5
    assert state.measured_t_ns == START_NS + 100 * MS
    for lasting in (state.following_ms, state.overtorque_ms, state.accelerating_ms, state.jump_deg, state.frozen_deg):
        assert lasting == (0.0,) * 5


def test_state_is_incomplete_while_anything_is_missing(watched: Watched) -> None:
    whole = watched.reading(100)
    without = [
        msgspec.structs.replace(whole, inputs=None),
        msgspec.structs.replace(whole, drives=(*whole.drives[:4], None)),
        msgspec.structs.replace(whole, statuses=whole.statuses[1:]),
        watched.reading(100, torque_on=True),
    ]
    for reading in without:
        assert not Watched().hear(100, reading).complete


def test_open_contact_is_read_as_open(watched: Watched) -> None:
    reading = watched.reading(0)
    pressed = msgspec.structs.replace(reading, inputs=InputSample(START_NS, estop_open=True, pedal_down=False))
    assert watched.hear(0, pressed).estop == "open"


@pytest.mark.parametrize(("cycle_hz", "cycles", "limit_ms"), [(100, 2, 20), (100, 10, 100), (50, 2, 40)])
def test_input_readings_are_valid_for_a_limited_number_of_cycles(cycle_hz: int, cycles: int, limit_ms: int) -> None:
    config = msgspec.structs.replace(
        StationConfig(), cycle_hz=cycle_hz, rate_hz=50, inputs=Inputs(max_age_cycles=cycles)
    )
    watched = Watched(config)
    watched.hear(0, watched.reading(0))
    at_the_limit = watched.hear(limit_ms, msgspec.structs.replace(watched.reading(limit_ms), inputs=None))
    assert (at_the_limit.estop, at_the_limit.pedal_down) == ("closed", False)
    beyond = watched.hear(limit_ms + 0.1, msgspec.structs.replace(watched.reading(limit_ms), inputs=None))
    assert (beyond.estop, beyond.pedal_down) == ("unknown", None)
    assert not beyond.complete


def test_each_reading_has_its_own_age(watched: Watched) -> None:
    watched.hear(0, watched.reading(0))
    later = msgspec.structs.replace(watched.reading(30), statuses=(), drives=(None, *watched.reading(30).drives[1:]))
    state = watched.hear(30, later)
    assert state.drive_age_ms == (30.0, 0.0, 0.0, 0.0, 0.0)
    assert state.status_age_ms == (30.0,) * 5
    assert state.measured_t_ns is None
    assert state.measured_deg == REST_DEG


def test_the_angles_came_when_the_last_of_them_came(watched: Watched) -> None:
    reading = watched.reading(0)
    drives = tuple(DriveSample(START_NS + n * MS, 0.0, 0.0, 0.0) for n in (1, 3, 2, 5, 4))
    assert watched.hear(10, msgspec.structs.replace(reading, drives=drives)).measured_t_ns == START_NS + 5 * MS


def test_answers_after_the_deadline_are_not_older_than_now(watched: Watched) -> None:
    assert watched.hear(0, watched.reading(2)).drive_age_ms == (0.0,) * 5


def test_drive_status_is_reported(watched: Watched) -> None:
    said = tuple(DriveStatus(START_NS, n, n == 1, n, n == 3) for n in range(5))
    state = watched.hear(0, msgspec.structs.replace(watched.reading(0), statuses=said))
    assert state.hardware_error == (0, 1, 2, 3, 4)
    assert state.watchdog_tripped == (False, False, False, True, False)
    assert state.torque_reported == (False, True, False, False, False)


def test_contacts_disagree_from_the_first_cycle_until_they_agree(watched: Watched) -> None:
    found = []
    for n, disagree in enumerate([False, True, True, False, True]):
        inputs = InputSample(START_NS + 10 * n * MS, estop_open=False, pedal_down=False, contacts_disagree=disagree)
        reading = msgspec.structs.replace(watched.reading(10 * n), inputs=inputs)
        found.append(watched.hear(10 * n, reading).contacts_disagree_ms)
    assert found == [0.0, 0.0, 10.0, 0.0, 0.0]


def test_a_missing_answer_breaks_the_chain_since_the_status(watched: Watched) -> None:
    def unbroken(at_ms: int, answered: bool, status_ms: int | None) -> bool:
        reading = watched.reading(at_ms)
        drives = list(reading.drives)
        if not answered:
            drives[TURNING] = None
        statuses = [] if status_ms is None else [watched.reading(status_ms).statuses[TURNING]]
        received = msgspec.structs.replace(reading, drives=tuple(drives), statuses=tuple(statuses))
        return watched.hear(at_ms, received).unbroken[TURNING]

    assert not unbroken(0, True, None)
    assert unbroken(10, True, 10)
    assert unbroken(20, True, None)
    assert not unbroken(30, False, None)
    # A status that is as old as the missing answer does not show what the drive had after it.
    assert not unbroken(40, True, 30)
    assert unbroken(50, True, 31)


def test_settings_stay_lost_until_the_drive_is_verified_again(watched: Watched) -> None:
    unverified = DriveStatus(START_NS, TURNING, False, 0, False, verified=False)
    wrong = msgspec.structs.replace(unverified, mismatch="torque_limit")
    again = msgspec.structs.replace(unverified, verified=True)
    said = [unverified, wrong, unverified, again, unverified]
    lost = [
        watched.hear(n, msgspec.structs.replace(watched.reading(n), statuses=(status,))).settings_lost
        for n, status in enumerate(said)
    ]
    assert [state[TURNING] for state in lost] == [False, True, True, False, False]
    assert not any(state[n] for state in lost for n in range(5) if n != TURNING)


@pytest.mark.parametrize(("age_ms", "torque"), [(1000, "off"), (1001, "unknown")])
def test_a_torque_report_counts_for_one_second(watched: Watched, age_ms: int, torque: TorqueState) -> None:
    watched.hear(0, watched.reading(0))
    state = watched.hear(age_ms, msgspec.structs.replace(watched.reading(age_ms), statuses=()))
    assert state.torque == (torque,) * 5


def test_drive_status_does_not_outlive_the_bus(watched: Watched) -> None:
    """The drives may have been switched off and on."""
    watched.hear(0, watched.reading(0))
    lost = watched.hear(10, None)
    assert not lost.bus_ok
    assert lost.status_age_ms == (math.inf,) * 5
    assert lost.drive_age_ms == (10.0,) * 5
    assert not watched.hear(20, msgspec.structs.replace(watched.reading(20), statuses=())).complete
    assert watched.hear(30, watched.reading(30)).complete


def test_invalid_and_missing_answers_are_counted_from_the_first_cycle(watched: Watched) -> None:
    reading = watched.reading(0)
    silent, unsound = (
        msgspec.structs.replace(reading, drives=(None, *reading.drives[1:]), **{kind: frozenset([0])})
        for kind in ("timed_out", "corrupt")
    )
    assert [watched.hear(0, said).corrupt[0] for said in (unsound, silent, silent)] == [True, True, False]


@pytest.mark.counted
def test_estop_poll_counts_like_a_reading_of_the_cycle(watched: Watched) -> None:
    watched.hear(0, watched.reading(0))
    unheard = msgspec.structs.replace(watched.reading(40), inputs=None)
    assert watched.hear(40, unheard).estop == "unknown"
    for opened, estop in ((False, "closed"), (True, "open")):
        watched.observer.record_polled_inputs(InputSample(START_NS + 35 * MS, estop_open=opened, pedal_down=False))
        assert watched.hear(40, unheard).estop == estop


def test_answers_stay_corrupt_until_silence_outnumbers_corrupt_answers(watched: Watched) -> None:
    good = watched.reading(0)
    unasked = msgspec.structs.replace(good, drives=(None, *good.drives[1:]))
    silent, unsound = (
        msgspec.structs.replace(unasked, timed_out=frozenset({0})),
        msgspec.structs.replace(unasked, corrupt=frozenset({0})),
    )
    assert not watched.hear(0, good).corrupt[0]
    assert watched.hear(0, unsound).corrupt == (True, False, False, False, False)
    assert watched.hear(0, unasked).corrupt[0]
    assert watched.hear(0, silent).corrupt[0]
    # Late to a busy computer, and then nothing more: the drive is switched off.
    assert not watched.hear(0, silent).corrupt[0]
    assert watched.hear(0, unsound).corrupt[0]
    assert not watched.hear(0, good).corrupt[0]


# -- the pedal --------------------------------------------------------------------------------------------------------


def test_a_contact_must_have_been_steady_for_twenty_milliseconds(watched: Watched) -> None:
    assert watched.pedal(0, False) is False
    assert watched.pedal(10, True) is False
    assert watched.pedal(29.9, True) is False
    assert watched.pedal(30, True) is True
    assert watched.pedal(40, False) is True
    assert watched.pedal(59.9, False) is True
    assert watched.pedal(60, False) is False


def test_bouncing_contact_restarts_its_time(watched: Watched) -> None:
    watched.pedal(0, False)
    watched.pedal(10, True)
    watched.pedal(20, False)
    assert watched.pedal(30, True) is False
    assert watched.pedal(49, True) is False
    assert watched.pedal(50, True) is True


def test_first_pedal_reading_counts_at_once_also_after_unknown(watched: Watched) -> None:
    assert watched.pedal(0, True) is True
    assert watched.pedal(10, None) is None
    assert watched.pedal(20, False) is False


def test_a_pedal_that_was_unknown_meanwhile_has_not_been_steady(watched: Watched) -> None:
    watched.pedal(0, False)
    watched.pedal(10, True)
    watched.pedal(20, None)
    watched.pedal(25, False)
    assert watched.pedal(35, True) is False
    assert watched.pedal(50, True) is False
    assert watched.pedal(55, True) is True


# -- torque -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("torque_on", [True, False])
def test_torque_feedback_is_checked_fifty_milliseconds_after_switching(watched: Watched, torque_on: bool) -> None:
    if not torque_on:
        watched.command(0, 109.0, torque_on=True)
    watched.command(100, 109.0, torque_on=torque_on)
    assert watched.hear(149.9, watched.reading(149.9)).torque_reported == (None,) * 5
    assert watched.hear(150, watched.reading(150)).torque_reported == (False,) * 5
    # Repeating a command is not switching.
    watched.command(200, 109.0, torque_on=torque_on)
    state = watched.hear(210, watched.reading(210))
    assert state.torque_reported == (False,) * 5
    assert state.torque_on == torque_on


def test_overtorque_begins_ten_percent_above_the_rated_torque(watched: Watched) -> None:
    for torque_nm, lasts in ((4.0 * 1.1, False), (4.41, True), (-4.0 * 1.1, False), (-4.41, True)):
        watched = Watched()
        watched.drive(0, torque_nm=torque_nm)
        assert watched.drive(10, torque_nm=torque_nm).overtorque_ms[TURNING] == (10.0 if lasts else 0.0)


def test_durations_start_with_their_first_cycle_and_one_good_resets(watched: Watched) -> None:
    lasted = [watched.drive(at_ms, torque_nm=5.0).overtorque_ms[TURNING] for at_ms in (0, 10, 20, 35)]
    assert lasted == [0.0, 10.0, 20.0, 35.0]
    assert watched.drive(40).overtorque_ms[TURNING] == 0.0
    assert watched.drive(50, torque_nm=5.0).overtorque_ms[TURNING] == 0.0
    assert watched.drive(60, torque_nm=5.0).overtorque_ms == (0.0, 10.0, 0.0, 0.0, 0.0)


# -- setpoints --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", [1, -1])
def test_axis_is_behind_when_its_error_exceeds_the_limit(watched: Watched, direction: int) -> None:
    for away_deg, lasts in ((20.0, False), (20.1, True)):
        watched = Watched()
        watched.command(0, 100.0)
        watched.drive(10, position_deg=100.0 + direction * away_deg)
        state = watched.drive(20, position_deg=100.0 + direction * away_deg)
        assert state.following_ms == (0.0, 10.0 if lasts else 0.0, 0.0, 0.0, 0.0)


def test_without_torque_no_motor_follows(watched: Watched) -> None:
    watched.command(0, 100.0, torque_on=False)
    watched.drive(10, position_deg=50.0)
    assert watched.drive(20, position_deg=50.0).following_ms == (0.0,) * 5


def test_a_drive_that_never_answered_is_not_behind(watched: Watched) -> None:
    watched.command(0, 100.0)
    watched.hear(0, BusSample((None,) * 5, None, ()))
    assert watched.hear(10, BusSample((None,) * 5, None, ())).following_ms == (0.0,) * 5


def test_setpoints_age_by_cycles_since_they_were_worked_out(watched: Watched) -> None:
    ages = []
    for cycle, made_ns in enumerate((5, 5, 5, 9, 9)):
        watched.observer.record_command(cycle, torque_on=True, setpoint_deg=REST_DEG, setpoint_t_ns=made_ns)
        ages.append(watched.hear(0, watched.reading(0)).setpoint_cycles)
    assert ages == [0, 1, 2, 0, 1]


def test_setpoint_age_counts_from_the_first_cycle_before_any_setpoint(watched: Watched) -> None:
    assert watched.hear(0, watched.reading(0)).setpoint_cycles == 0
    watched.observer.record_command(1, torque_on=False, setpoint_deg=REST_DEG, setpoint_t_ns=0)
    assert watched.hear(10, watched.reading(10)).setpoint_cycles == 1


# -- what cannot be ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", [1, -1])
def test_step_above_twice_the_highest_speed_is_a_jump(watched: Watched, direction: int) -> None:
    # 100 deg/s: 2 deg in 10 ms.
    watched.drive(0, position_deg=100.0)
    assert watched.drive(10, position_deg=100.0 + direction * 2.0).jump_deg[TURNING] == pytest.approx(0.0)
    state = watched.drive(30, position_deg=100.0 + direction * 10.0)
    assert state.jump_deg == pytest.approx((0.0, 4.0, 0.0, 0.0, 0.0))


def test_the_first_answer_is_no_jump(watched: Watched) -> None:
    assert watched.drive(0, position_deg=-170.0).jump_deg == (0.0,) * 5


def test_changing_speed_faster_than_allowed_lasts(watched: Watched) -> None:
    # 4,000 deg/s2: 40 deg/s in 10 ms.
    for change, lasts in ((40.0, False), (40.1, True)):
        for direction in (1, -1):
            watched = Watched()
            for cycle in range(3):
                speed = direction * change / 2 * (-1) ** cycle
                state = watched.drive(10 * cycle, speed_deg_s=speed)
            assert state.accelerating_ms == (0.0, 10.0 if lasts else 0.0, 0.0, 0.0, 0.0)


@pytest.mark.counted
def test_same_change_in_half_the_time_is_twice_the_acceleration(watched: Watched) -> None:
    watched.drive(0, speed_deg_s=0.0)
    watched.drive(5, speed_deg_s=20.1)
    assert watched.drive(10, speed_deg_s=0.0).accelerating_ms[TURNING] == 5.0


def test_two_answers_of_the_same_time_have_no_acceleration(watched: Watched) -> None:
    for speed in (0.0, 300.0, 0.0):
        state = watched.drive(0, speed_deg_s=speed)
    assert state.accelerating_ms == (0.0,) * 5
    assert watched.hear(10, BusSample((None,) * 5, None, ())).accelerating_ms == (0.0,) * 5


@pytest.mark.parametrize("direction", [1, -1])
def test_frozen_position_is_measured_by_its_setpoints_travel(watched: Watched, direction: int) -> None:
    gone = []
    for cycle in range(4):
        watched.command(10 * cycle, 100.0 + direction * 2.0 * cycle)
        gone.append(watched.drive(10 * cycle + 5, position_deg=100.0).frozen_deg[TURNING])
    assert gone == [0.0, 0.0, 2.0, 4.0]

    watched.command(50, 100.0 + direction * 10.0)
    assert watched.drive(55, position_deg=100.1).frozen_deg[TURNING] == 0.0
    watched.command(60, 100.0 + direction * 20.0)
    assert watched.drive(65, position_deg=100.1).frozen_deg[TURNING] == 0.0
    watched.command(70, 100.0 + direction * 21.0)
    assert watched.drive(75, position_deg=100.1).frozen_deg[TURNING] == 1.0


def test_without_torque_nothing_is_frozen(watched: Watched) -> None:
    for cycle in range(4):
        watched.command(10 * cycle, 100.0 + 10.0 * cycle, torque_on=False)
        assert watched.drive(10 * cycle + 5, position_deg=100.0).frozen_deg == (0.0,) * 5
