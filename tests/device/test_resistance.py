"""A patient who pushes against the movement: the stroke reverses, a second time in the same place ends the run, the arm
is held.
"""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import example, given

from kata.device import journal
from kata.device.config import StationConfig
from kata.device.ipc_messages import Acknowledge, Approach, Pause, Play, Return
from kata.device.journal import JournalDisk, JournalHeader, JournalWriter
from kata.device.movement import Movement
from kata.device.resistance import ResistanceMonitor, YieldOffset
from kata.device.run import Run
from kata.motion.trajectory import Trajectory
from tests.support.examples import examples
from tests.support.pushes import Push, hold_answered, pushes
from tests.support.stepped import REST_DEG, Stepped
from tests.support.trajectories import LOAD, a_trajectory

LEVEL = 10
THRESHOLD_NM = 4.0 * 10 / 25 * 0.98
"""For a motor with a rated torque of 4 Nm."""
PUSHED = 3
"""The axis that moves in these recordings."""


def at_the_start(stepped: Stepped, level: int = LEVEL, seconds: float = 8.0) -> Stepped:
    """Bring the arm to the start of a slow stroke."""
    load = msgspec.structs.replace(LOAD, resistance_level=level)
    assert stepped.send(load, a_trajectory(seconds)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    return stepped


@pytest.fixture(scope="module")
def began_stroke(tmp_path_factory: pytest.TempPathFactory) -> Stepped:
    stepped = at_the_start(Stepped(tmp_path_factory.mktemp("stroke")))
    assert stepped.send(Play()) is None
    stepped.forward(3.0)
    return stepped


@pytest.fixture
def stroke(began_stroke: Stepped, tmp_path: Path) -> Stepped:
    """Return an apparatus three seconds into a slow upward stroke of eight."""
    return began_stroke.copied(tmp_path)


def push(stepped: Stepped, torque_nm: float = 2.0, cycles: int = 11, axis: int = PUSHED) -> None:
    """Let the patient resist a motor for this many cycles."""
    stepped.apparatus.torques_nm[axis] = torque_nm
    for _ in range(cycles):
        stepped.cycle()
    stepped.apparatus.torques_nm[axis] = 0.0


def position_s(stepped: Stepped) -> float:
    stepped.forward(0.1)
    run = stepped.snapshot.run
    assert run is not None
    return run.position_s


def reversals(stepped: Stepped) -> int:
    run = stepped.snapshot.run
    assert run is not None
    return run.reversals


def test_resistance_above_the_patients_level_reverses_the_stroke_and_waits(stroke: Stepped) -> None:
    met_at_s = position_s(stroke)
    push(stroke)
    assert stroke.mode == "playing"
    stroke.forward(0.5)
    run = stroke.snapshot.run
    assert run is not None
    assert (run.reversing, run.reversals) == (True, 1)

    stroke.until("paused")
    assert stroke.torque
    assert stroke.causes() == []
    # Two seconds back from the place of detection, 0.1 s after the push began.
    assert position_s(stroke) == pytest.approx(met_at_s + 0.1 - 2.0, abs=0.03)
    messages = [event.message for event in stroke.link.events if event.code == "load_reversal"]
    assert messages == ["Motor 4 met resistance at 3.1 s; the arm is moved back."]
    recorded = stroke.journal()
    back = recorded.path_s[recorded.phase == journal.PHASE_REVERSING]
    assert len(back) > 150
    assert np.all(np.diff(back[30:]) <= 0)
    assert np.diff(back).min() == pytest.approx(-0.01, abs=1e-4)  # no faster than it was taught
    steps_deg = np.abs(np.diff(np.array(stroke.apparatus.written), axis=0))
    assert steps_deg.max() < 0.2  # the reversal is as gentle as playing


def test_arm_waits_after_a_reversal_until_play_is_pressed(stroke: Stepped) -> None:
    push(stroke)
    stroke.until("paused")
    waiting_at_s = position_s(stroke)
    stroke.forward(5.0)
    assert position_s(stroke) == waiting_at_s

    assert stroke.send(Play()) is None
    run = stroke.snapshot.run
    assert run is not None
    assert not run.reversing
    stroke.until("idle")
    end = stroke.journal().end
    assert end is not None
    assert end.reason == "completed"


def test_arm_waiting_after_a_reversal_may_return_to_the_start(stroke: Stepped) -> None:
    push(stroke)
    stroke.until("paused")
    assert stroke.send(Return()) is None
    stroke.forward(0.1)
    run = stroke.snapshot.run
    assert run is not None
    assert (run.reversing, run.reversals) == (False, 1)
    stroke.until("idle")
    end = stroke.journal().end
    assert end is not None
    assert end.reason == "returned"


def test_reversal_returns_no_further_than_the_start(stepped: Stepped) -> None:
    at_the_start(stepped)
    stepped.send(Play())
    stepped.forward(1.5)
    push(stepped)
    stepped.until("paused")

    assert position_s(stepped) == 0.0
    run = stepped.snapshot.run
    assert run is not None
    assert run.at_start
    recorded = stepped.journal()
    assert recorded.path_s[recorded.phase == journal.PHASE_REVERSING].min() >= 0.0


def test_push_shorter_than_a_tenth_of_a_second_is_ignored(stroke: Stepped) -> None:
    push(stroke, cycles=10)
    stroke.forward(0.1)
    push(stroke, cycles=10)
    stroke.forward(0.1)
    assert reversals(stroke) == 0

    push(stroke, cycles=11)
    stroke.forward(0.1)
    assert reversals(stroke) == 1


@pytest.mark.parametrize("level", [1, LEVEL, 25])
def test_load_within_the_patients_level_is_no_resistance(stepped: Stepped, level: int) -> None:
    """Level 25 is the drive's own limit; the drive reports slightly less."""
    at_the_start(stepped, level=level)
    stepped.send(Play())
    stepped.forward(2.0)
    threshold_nm = THRESHOLD_NM * level / LEVEL
    push(stepped, torque_nm=threshold_nm - 0.001, cycles=100)
    assert reversals(stepped) == 0

    push(stepped, torque_nm=threshold_nm + 0.001, cycles=11)
    stepped.forward(0.1)
    assert reversals(stepped) == 1


def test_torque_against_the_direction_of_movement_is_no_resistance(stroke: Stepped) -> None:
    """The motor brakes an arm that is pushed along; the patient does not resist."""
    push(stroke, torque_nm=-3.0, cycles=50)
    assert reversals(stroke) == 0

    stroke.forward(2.0)  # past the reversal the arm moves down: this is now the direction of movement
    push(stroke, torque_nm=-3.0, cycles=50)
    assert reversals(stroke) == 1


def test_resistance_elsewhere_turns_the_stroke_back_again(stepped: Stepped) -> None:
    at_the_start(stepped)
    for seconds in (1.5, 3.0):  # to 1.5 s, from there back to the start, and to 3.0 s
        assert stepped.send(Play()) is None
        stepped.forward(seconds)
        push(stepped)
        stepped.until("paused")

    assert reversals(stepped) == 2
    assert stepped.causes() == []


@pytest.fixture(scope="module")
def began_held(began_stroke: Stepped, tmp_path_factory: pytest.TempPathFactory) -> Stepped:
    stepped = began_stroke.copied(tmp_path_factory.mktemp("held"))
    push(stepped)
    stepped.until("paused")
    assert stepped.send(Play()) is None
    stepped.forward(2.0)
    push(stepped)
    stepped.until("stopped")
    return stepped


@pytest.fixture
def held(began_held: Stepped, tmp_path: Path) -> Stepped:
    """Return an apparatus that holds the arm after the patient has resisted twice in the same place."""
    return began_held.copied(tmp_path)


def test_repeated_resistance_in_one_place_returns_and_holds_the_arm(held: Stepped) -> None:
    assert held.causes() == ["load_repeated"]
    assert held.snapshot.stop is not None
    assert held.snapshot.stop.causes[0].axis == PUSHED + 1
    held.forward(1.0)
    stands_deg = list(held.apparatus.angles_deg)

    held.forward(30.0)
    assert held.mode == "stopped"
    assert held.torque
    assert held.apparatus.angles_deg == stands_deg
    run = held.snapshot.run
    assert run is not None
    assert run.position_s == pytest.approx(1.2, abs=0.2)


@pytest.mark.counted
def test_pause_during_the_second_reversal_does_not_save_the_run(stroke: Stepped) -> None:
    push(stroke)
    stroke.until("paused")
    stroke.send(Play())
    stroke.forward(2.0)
    push(stroke)
    stroke.forward(0.5)
    assert stroke.send(Pause()) is None
    stroke.forward(0.5)

    assert stroke.mode == "stopped"
    assert stroke.causes() == ["load_repeated"]
    assert stroke.torque


def test_pause_during_the_first_reversal_is_a_normal_pause(stroke: Stepped) -> None:
    push(stroke)
    stroke.forward(0.5)
    assert stroke.send(Pause()) is None
    stroke.forward(0.5)

    assert stroke.mode == "paused"
    assert stroke.send(Play()) is None
    stroke.until("idle")


def test_a_held_arm_is_let_go_by_the_acknowledgement(held: Stepped) -> None:
    held.forward(1.0)
    assert held.send(Acknowledge()) is None
    held.cycle()

    assert held.mode == "idle"
    assert not held.torque
    end = held.journal().end
    assert end is not None
    assert (end.reason, end.cause_code) == ("stopped", "load_repeated")


def test_arm_slowing_down_to_be_held_is_not_released(stroke: Stepped) -> None:
    stroke.send(Pause())
    stroke.until("paused")
    stroke.send(Return())
    stroke.forward(1.0)
    push(stroke, torque_nm=-2.0, cycles=12)
    refusal = stroke.send(Acknowledge())
    assert refusal is not None
    assert refusal.code == "still_stopping"
    assert stroke.torque

    stroke.forward(0.3)
    assert stroke.send(Acknowledge()) is None


def test_any_stop_that_requires_it_cuts_a_held_arms_torque(held: Stepped) -> None:
    held.forward(1.0)
    held.link.request_stop()
    held.forward(0.05)

    assert held.causes() == ["load_repeated", "operator_stop"]
    assert not held.torque


def test_lost_browser_releases_a_held_arm_with_its_reason(held: Stepped) -> None:
    held.forward(1.0)
    held.link.request_stop("browser_lost")
    held.forward(0.05)

    assert held.causes() == ["load_repeated", "browser_lost"]
    assert not held.torque


@pytest.mark.parametrize("way", ["approaching", "returning"])
def test_resistance_during_approach_or_return_holds_the_arm_in_place(stepped: Stepped, way: str) -> None:
    stepped.apparatus.angles_deg[PUSHED] = 50.0
    assert stepped.send(msgspec.structs.replace(LOAD, resistance_level=LEVEL), a_trajectory()) is None
    assert stepped.send(Approach()) is None
    if way == "returning":
        stepped.until("paused")
        assert stepped.send(Return()) is None
    stepped.forward(1.0)
    assert stepped.mode == way
    push(stepped, torque_nm=-2.0 if way == "approaching" else 2.0, cycles=12)

    assert stepped.mode == "stopped"
    assert stepped.causes() == ["load_on_the_way"]
    stepped.forward(10.0)
    assert stepped.torque
    assert stepped.send(Acknowledge()) is None
    stepped.cycle()
    assert not stepped.torque
    end = stepped.journal().end
    assert end is not None
    assert end.cause_code == "load_on_the_way"


@pytest.mark.counted
def test_arm_too_heavy_for_a_motor_is_held(stepped: Stepped) -> None:
    """The motor sinks to its highest torque within the time in which it takes over the weight."""
    stepped.apparatus.angles_deg[PUSHED] = 50.0
    assert stepped.send(msgspec.structs.replace(LOAD, resistance_level=LEVEL), a_trajectory()) is None
    assert stepped.send(Approach()) is None
    stepped.forward(0.05)
    push(stepped, torque_nm=2.0, cycles=12)
    assert (stepped.mode, stepped.causes()) == ("stopped", ["arm_too_heavy"])
    assert stepped.torque
    assert stepped.apparatus.angles_deg[PUSHED] == pytest.approx(50.0, abs=0.5)


def test_resistance_on_the_way_stops_as_fast_as_a_reversal(stroke: Stepped) -> None:
    """In 0.08 s. A pause takes 0.2 s."""
    assert stroke.send(Pause()) is None
    stroke.until("paused")
    assert stroke.send(Return()) is None
    stroke.forward(1.0)
    push(stroke, torque_nm=-2.0, cycles=12)
    assert stroke.causes() == ["load_on_the_way"]
    stroke.forward(0.1)
    stands_deg = list(stroke.apparatus.angles_deg)
    stroke.forward(0.2)
    assert stroke.apparatus.angles_deg == stands_deg


def test_pushes_before_and_after_a_pause_are_separate(stroke: Stepped) -> None:
    push(stroke, cycles=9)
    stroke.send(Pause())
    stroke.until("paused")
    stroke.send(Play())
    push(stroke, cycles=9)
    stroke.forward(0.2)

    assert reversals(stroke) == 0


def test_play_does_not_make_a_push_begin_again(stroke: Stepped) -> None:
    """The push began during the pause and counts from there."""
    stroke.send(Pause())
    stroke.until("paused")
    stroke.apparatus.torques_nm[PUSHED] = 2.0
    stroke.forward(0.05)
    stroke.send(Play())
    stroke.forward(0.06)
    stroke.apparatus.torques_nm[PUSHED] = 0.0
    stroke.forward(0.1)
    assert reversals(stroke) == 1


def test_resistance_while_slowing_down_for_a_pause_turns_back(stroke: Stepped) -> None:
    push(stroke, cycles=5)
    stroke.apparatus.torques_nm[PUSHED] = 2.0
    stroke.send(Pause())
    stroke.forward(0.06)
    stroke.apparatus.torques_nm[PUSHED] = 0.0
    stroke.forward(0.1)
    assert reversals(stroke) == 1
    stroke.until("paused")
    assert stroke.causes() == []


def test_resistance_on_the_way_back_holds_the_arm(stroke: Stepped) -> None:
    push(stroke)
    stroke.forward(0.5)
    push(stroke, torque_nm=-3.0, cycles=12)
    assert stroke.mode == "stopped"
    assert stroke.causes() == ["load_on_the_way"]
    assert stroke.torque


@pytest.mark.parametrize("push_nm", [2.0, -2.0])
def test_resistance_in_a_pause_holds_the_arm(stroke: Stepped, push_nm: float) -> None:
    stroke.send(Pause())
    stroke.until("paused")
    push(stroke, torque_nm=push_nm, cycles=12)
    assert stroke.causes() == ["load_while_held"]
    stroke.forward(1.0)
    assert stroke.torque
    assert stroke.send(Acknowledge()) is None
    stroke.forward(0.1)
    assert stroke.mode == "idle"


def play_a_hold(stepped: Stepped) -> None:
    """Stop the run, and play another recording, which moves no motor, for five seconds."""
    times = np.arange(0.0, 12.01, 0.01)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    stepped.link.request_stop()
    stepped.forward(0.5)
    assert stepped.send(Acknowledge()) is None
    load = msgspec.structs.replace(LOAD, resistance_level=LEVEL, run_id="hold")
    assert stepped.send(load, Trajectory(times, angles)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    stepped.send(Play())
    stepped.forward(5.0)


def test_a_push_that_outlasts_the_turn_holds_the_arm(stroke: Stepped) -> None:
    """A reversal inside a hold leads nowhere: a push that continues after it stops the run."""
    play_a_hold(stroke)
    stroke.apparatus.torques_nm[PUSHED] = 3.9
    stroke.forward(0.3)
    assert reversals(stroke) == 1
    assert stroke.causes() == []
    stroke.forward(1.0)
    assert stroke.causes() == ["load_on_the_way"]


# -- giving way -------------------------------------------------------------------------------------------------------


def test_held_arm_yields_to_a_push_and_stays_there(stroke: Stepped) -> None:
    stroke.send(Pause())
    stroke.until("paused")
    at_deg = stroke.apparatus.angles_deg[PUSHED]
    push(stroke, torque_nm=2.0, cycles=40)
    gone_deg = stroke.apparatus.angles_deg[PUSHED] - at_deg
    assert -2.0 < gone_deg < -0.3
    stroke.forward(1.0)
    assert stroke.apparatus.angles_deg[PUSHED] == pytest.approx(at_deg + gone_deg, abs=0.05)


def test_a_torque_within_the_level_moves_no_held_arm(held: Stepped) -> None:
    held.forward(1.0)
    at_deg = list(held.apparatus.angles_deg)
    push(held, torque_nm=THRESHOLD_NM - 0.01, cycles=200)
    assert held.apparatus.angles_deg == pytest.approx(at_deg, abs=1e-9)


def test_giving_way_ends_at_the_patients_limit(stepped: Stepped) -> None:
    limits = [(-180.0, 180.0)] * 5
    limits[PUSHED] = (19.0, 41.0)
    load = msgspec.structs.replace(LOAD, resistance_level=LEVEL, limits_deg=tuple(limits))
    stepped.apparatus.angles_deg[PUSHED] = 22.0
    assert stepped.send(load, a_trajectory(8.0)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    push(stepped, torque_nm=3.9, cycles=300)
    assert stepped.causes() == ["load_while_held"]
    assert stepped.apparatus.angles_deg[PUSHED] == pytest.approx(19.0)


def test_stuck_torque_reading_moves_an_arm_at_most_fifteen_degrees(stroke: Stepped) -> None:
    stroke.send(Pause())
    stroke.until("paused")
    at_deg = stroke.apparatus.angles_deg[PUSHED]
    push(stroke, torque_nm=-3.9, cycles=1000)
    assert stroke.apparatus.angles_deg[PUSHED] == pytest.approx(at_deg + 15.0, abs=0.01)


def test_after_giving_way_the_recording_is_met_slowly(stepped: Stepped) -> None:
    """Two degrees off the path, at 5 deg/s."""
    at_the_start(stepped)
    stepped.send(Play())
    stepped.forward(3.0)
    push(stepped, torque_nm=3.9, cycles=40)
    stepped.until("paused")
    run = stepped.loop._machine._run
    assert run is not None
    off_deg = stepped.apparatus.angles_deg[PUSHED] - run.reference_deg[PUSHED]
    assert off_deg < -1.0
    stepped.send(Play())
    before = len(stepped.apparatus.written)
    stepped.forward(1.0)
    steps_deg = np.abs(np.diff(np.array(stepped.apparatus.written)[before - 1 :, PUSHED]))
    assert steps_deg.max() < 0.05 + 0.08 + 0.01  # of the way back to the path, and of the path itself
    movement = stepped.loop._machine._movement
    assert movement is not None
    middle_deg = run.trajectory.at(movement.place_s(-0.5 / run.rate_hz))  # of the past period
    assert stepped.apparatus.angles_deg[PUSHED] == pytest.approx(middle_deg[PUSHED], abs=0.01)
    stepped.until("idle")
    assert stepped.causes() == []


def test_reversal_from_rest_yields_with_its_first_setpoint(stroke: Stepped) -> None:
    stroke.send(Pause())
    stroke.until("paused")
    stroke.apparatus.torques_nm[PUSHED] = 2.0
    stroke.forward(0.09)
    assert stroke.send(Play()) is None
    held_deg = stroke.apparatus.written[-1][PUSHED]
    assert reversals(stroke) == 0
    stroke.cycle()
    assert stroke.link.events[-1].code == "load_reversal"
    assert stroke.apparatus.written[-1][PUSHED] < held_deg


@pytest.mark.parametrize(("axis", "torque_nm"), [(2, 3.0), (PUSHED, -3.0)])
def test_reversal_yields_to_no_other_push(tmp_path: Path, axis: int, torque_nm: float) -> None:
    """At level 1, at which 0.16 Nm of motor 4 are resistance. Another push counts only after 0.1 s."""
    reversing = at_the_start(Stepped(tmp_path), level=1)
    assert reversing.send(Play()) is None
    reversing.forward(3.0)
    push(reversing, torque_nm=0.3, cycles=12)
    reversing.forward(0.3)
    assert reversals(reversing) == 1
    undisturbed = reversing.copied(tmp_path)
    push(reversing, torque_nm=torque_nm, cycles=9, axis=axis)
    undisturbed.forward(0.09)
    assert reversing.apparatus.written == undisturbed.apparatus.written
    others = np.delete(np.array(reversing.apparatus.written), PUSHED, axis=1)
    assert np.abs(others - np.delete(REST_DEG, PUSHED)).max() < 1e-9


def test_yielded_setpoint_returns_no_faster_than_the_recording_plays(stroke: Stepped) -> None:
    """In a hold, after a yield. The setpoint returns by 0.05 deg times the speed override, which grows by 0.05 from setpoint to setpoint."""
    play_a_hold(stroke)
    push(stroke, torque_nm=3.9, cycles=40)
    stroke.until("paused")
    stroke.forward(0.1)
    held_deg = stroke.apparatus.angles_deg[PUSHED]
    assert held_deg < REST_DEG[PUSHED] - 2.0
    assert stroke.send(Play()) is None
    stroke.forward(0.1)
    returned_deg = sum(0.05 * 0.05 * n for n in range(10))
    assert stroke.apparatus.angles_deg[PUSHED] - held_deg == pytest.approx(returned_deg, abs=0.01)
    stroke.forward(0.2)
    assert stroke.send(Pause()) is None
    paused_deg = stroke.apparatus.angles_deg[PUSHED]
    stroke.until("paused")
    stroke.forward(0.1)
    assert stroke.apparatus.angles_deg[PUSHED] == pytest.approx(paused_deg, abs=0.06)
    assert paused_deg < REST_DEG[PUSHED] - 0.5


@pytest.mark.parametrize(("played_s", "torque_nm", "limit_deg"), [(0.0, 3.9, 19.0), (4.0, -3.9, 41.0)])
def test_arm_leaves_a_limit_at_once_when_pushed_back(
    stepped: Stepped, played_s: float, torque_nm: float, limit_deg: float
) -> None:
    """The offset of a yield does not grow while a limit holds the setpoint."""
    limits = [(-180.0, 180.0)] * 5
    limits[PUSHED] = (19.0, 41.0)
    stepped.apparatus.angles_deg[PUSHED] = 22.0
    load = msgspec.structs.replace(LOAD, resistance_level=LEVEL, limits_deg=tuple(limits))
    assert stepped.send(load, a_trajectory(8.0)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    if played_s:
        assert stepped.send(Play()) is None
        stepped.forward(played_s)
        assert stepped.send(Pause()) is None
        stepped.until("paused")
    push(stepped, torque_nm=torque_nm, cycles=300)
    assert stepped.apparatus.angles_deg[PUSHED] == pytest.approx(limit_deg)
    push(stepped, torque_nm=-torque_nm, cycles=20)
    assert abs(stepped.apparatus.angles_deg[PUSHED] - limit_deg) > 1.0


@pytest.mark.parametrize("rate_hz", [10, 100])
@pytest.mark.parametrize(("p_nm_deg", "i_nm_deg_s", "rated_nm"), [(2.79, 6.98, 4.0), (0.21, 1.05, 2.0)])
@pytest.mark.parametrize("level", [0.1, 0.4, 0.9])
@pytest.mark.parametrize("wound_up", [False, True])
def test_the_push_against_a_blocked_arm_ends_in_time(
    rate_hz: int, p_nm_deg: float, i_nm_deg_s: float, rated_nm: float, level: float, wound_up: bool
) -> None:
    """A simulated position control, 40 ms late, with all of its push in the proportional or in the integral part."""
    threshold_nm = level * rated_nm
    giving = YieldOffset([threshold_nm], rate_hz, 15.0)
    integral_nm = 0.99 * rated_nm if wound_up else 0.0
    began_deg = 0.0 if wound_up else 0.99 * rated_nm / p_nm_deg
    late = [began_deg] * 40
    ended_ms, torques_nm = None, []
    for ms in range(4000):
        ahead_deg = late[-40]
        torque_nm = float(np.clip(p_nm_deg * ahead_deg + integral_nm, -rated_nm, rated_nm))
        if abs(torque_nm) < rated_nm:
            integral_nm += i_nm_deg_s * ahead_deg / 1000
        torques_nm.append(abs(torque_nm))
        if ended_ms is None and abs(torque_nm) < threshold_nm:
            ended_ms = ms
        if ms % (1000 // rate_hz) == 0:
            giving.yield_to(np.array([torque_nm]), np.array([late[-1]]), np.array([0.0]))
        late.append(began_deg + float(giving.offset_deg[0]))
    assert ended_ms is not None and ended_ms <= (1000 if rate_hz == 100 else 1500)
    # The push does not begin again, and the drive does not oscillate.
    assert max(torques_nm[3000:]) <= 1.4 * threshold_nm


# -- exactly at the limits --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rate_hz", "step_deg"), [(100, 0.06), (50, 0.1), (10, 0.1)])
def test_setpoint_yields_smoothly_at_six_degrees_per_second_and_newtonmetre(rate_hz: int, step_deg: float) -> None:
    giving = YieldOffset([1.0], rate_hz, 15.0)
    giving.yield_to(np.array([2.0]), np.array([0.0]), np.array([0.0]))
    assert giving.offset_deg[0] == pytest.approx(-step_deg)


@pytest.mark.parametrize(
    ("fastest_deg_s", "speed_override", "step_deg"), [(15.0, 1.0, 0.05), (15.0, 0.5, 0.025), (2.0, 1.0, 0.02)]
)
def test_setpoint_returns_at_five_degrees_per_second_or_patients_limit(
    fastest_deg_s: float, speed_override: float, step_deg: float
) -> None:
    giving = YieldOffset([1.0], 100, fastest_deg_s)
    giving.offset_deg = np.array([-3.0])
    giving.resume(speed_override)
    assert giving.offset_deg[0] == pytest.approx(-3.0 + step_deg)


def test_push_that_caused_a_reversal_has_one_second_to_end(stepped: Stepped) -> None:
    monitor = ResistanceMonitor([1.0] * 5)
    monitor.start_after_reversal(PUSHED, 2.0, 0)
    state = stepped.loop._state_builder.build(0, None, stepped.loop._loop_context(0, 0.0))
    pushed = msgspec.structs.replace(state, torque_nm=(0.0, 0.0, 0.0, 2.0, 0.0))
    times_ns = range(0, 1_500_000_000, 10_000_000)
    along = [0.0, 0.0, 0.0, 5.0, 0.0]
    felt_by = [
        monitor.resisting_axis(msgspec.structs.replace(pushed, t_ns=t_ns), along, moves_back=True) for t_ns in times_ns
    ]
    assert times_ns[felt_by.index(PUSHED)] == 1_100_000_000


@pytest.mark.counted
@pytest.mark.parametrize(
    ("reversed_by_nm", "torque_nm", "counts"), [(None, 2.0, True), (2.0, 0.2, False), (2.0, -0.2, True)]
)
def test_only_the_push_of_the_reversal_may_end(
    stepped: Stepped, reversed_by_nm: float | None, torque_nm: float, counts: bool
) -> None:
    monitor = ResistanceMonitor([0.1] * 5)
    if reversed_by_nm is not None:
        monitor.start_after_reversal(PUSHED, reversed_by_nm, 0)
    state = stepped.loop._state_builder.build(0, None, stepped.loop._loop_context(0, 0.0))
    torques = tuple(torque_nm if n == PUSHED else 0.0 for n in range(5))
    along = [np.sign(torque_nm) * 5.0] * 5
    for t_ns in (0, 100_000_000):
        state = msgspec.structs.replace(state, t_ns=t_ns, torque_nm=torques)
        felt_by = monitor.resisting_axis(state, along, moves_back=True)
    assert felt_by == (PUSHED if counts else None)


@pytest.mark.parametrize(
    ("torque_nm", "offset_deg"),
    # A fifth of the way to the measured angle in each hundredth of a second, and 0.06 deg for each Nm above the level.
    [(0.999, 0.0), (1.0, -0.4), (1.5, -0.43), (-1.5, 0.03)],
)
def test_setpoint_yields_to_the_measured_angle_and_beyond(torque_nm: float, offset_deg: float) -> None:
    giving = YieldOffset([1.0], 100, 15.0)
    giving.yield_to(np.array([torque_nm]), np.array([12.0]), np.array([10.0]))
    assert giving.offset_deg[0] == pytest.approx(offset_deg, abs=1e-9)


@pytest.mark.parametrize(
    ("offset_deg", "lowest_deg", "highest_deg", "kept_deg"),
    [
        (-3.0, -2.0, 4.0, -2.0),
        (5.0, -2.0, 4.0, 4.0),
        (1.0, -2.0, 4.0, 1.0),
        # The path itself is beyond a limit: the offset does not push it farther, and need not bring it back.
        (-3.0, 0.5, 4.0, 0.0),
        (0.2, 0.5, 4.0, 0.2),
        (3.0, -4.0, -0.5, 0.0),
        (-0.2, -4.0, -0.5, -0.2),
    ],
)
def test_an_offset_does_not_grow_beyond_a_limit(
    offset_deg: float, lowest_deg: float, highest_deg: float, kept_deg: float
) -> None:
    giving = YieldOffset([1.0], 100, 15.0)
    giving.offset_deg = np.array([offset_deg])
    giving.keep_within(np.array([lowest_deg]), np.array([highest_deg]))
    assert giving.offset_deg[0] == kept_deg


def a_run(folder: Path, trajectory: Trajectory, level: int = 25, **settings: object) -> Run:
    config = msgspec.structs.replace(StationConfig(), **settings)
    header = msgspec.convert(
        {"kind": "run", "id": "r", "recording_id": "a", "station": "s", "rate_hz": config.rate_hz,
         "started_at": "2025-01-01T00:00:00Z", "started_ns": 0},
        JournalHeader,
    )  # fmt: skip
    load = msgspec.structs.replace(LOAD, resistance_level=level)
    return Run(load, trajectory, JournalWriter(folder, header, JournalDisk()), config)


@pytest.mark.counted
@pytest.mark.parametrize(
    ("first_s", "second_s", "again"),
    [(3.0, 4.0, True), (3.0, 4.001, False), (4.0, 3.0, True), (4.0, 2.999, False), (3.0, 3.0, True)],
)
def test_same_place_means_within_one_second_of_recording_time(
    tmp_path: Path, first_s: float, second_s: float, again: bool
) -> None:
    run = a_run(tmp_path, a_trajectory())
    run.resisted_at_s = [first_s]
    assert not run.resisted_again
    run.resisted_at_s = [first_s, second_s]
    assert run.resisted_again == again


def test_a_place_of_long_ago_is_remembered(tmp_path: Path) -> None:
    run = a_run(tmp_path, a_trajectory())
    run.resisted_at_s = [1.0, 7.0, 1.5]
    assert run.resisted_again


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("speed_deg_s", "torque_nm", "speed_override", "resists"),
    [
        (1.5, 0.5, -1.0, True),
        (1.5, -0.5, -1.0, False),  # the motor brakes
        (1.5, 0.0, -1.0, False),
        (1.0, -0.5, -1.0, False),
        (0.999, -0.5, -1.0, True),  # too slow to have a direction
        (1.5, 0.5, 0.0, False),
        (1.5, 0.5, 1.0, False),
    ],
)
def test_only_torque_along_the_way_back_resists_it(
    stroke: Stepped, sign: int, speed_deg_s: float, torque_nm: float, speed_override: float, resists: bool
) -> None:
    run = stroke.loop._machine._run
    assert run is not None
    run._speed_deg_s = np.full(5, sign * speed_deg_s)
    movement = Movement(run.trajectory, speed_override=speed_override)
    state = stroke.loop._state_builder.build(0, None, stroke.loop._loop_context(0, 0.0))
    state = msgspec.structs.replace(state, torque_nm=(sign * torque_nm,) * 5)
    assert run.resists_moving_back(PUSHED, movement, state) is resists


def test_a_new_path_begins_without_the_last_ones_yield(tmp_path: Path) -> None:
    trajectory = a_trajectory()
    run = a_run(tmp_path, trajectory)
    run.start_path(trajectory.start_deg)
    run._yield_offset.offset_deg[3] = 5.0
    movement = run.movement_along(trajectory, direction=0)
    assert run.setpoint(movement)[3] > trajectory.start_deg[3]
    run.start_path(trajectory.start_deg)
    assert run.setpoint(movement) == pytest.approx(trajectory.start_deg.tolist())


def felt(stepped: Stepped, speed_deg_s: float, torque_nm: float, ahead_deg: float = 0.0) -> int | None:
    """Return the axis that a monitor finds after 0.1 s of a push of motor 5."""
    monitor = ResistanceMonitor([4.0, 4.0, 4.0, 4.0, 1.0])
    state = stepped.loop._state_builder.build(0, None, stepped.loop._loop_context(0, 0.0))
    for t_ns in (0, 100_000_000):
        now = msgspec.structs.replace(
            state,
            t_ns=t_ns,
            torque_nm=(0.0, 0.0, 0.0, 0.0, torque_nm),
            setpoint_deg=(*REST_DEG[:4], REST_DEG[4] + ahead_deg),
            measured_deg=REST_DEG,
        )
        axis = monitor.resisting_axis(now, [0.0, 0.0, 0.0, 0.0, speed_deg_s], moves_back=False)
    return axis


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("speed_deg_s", "ahead_deg", "pushes"),
    [
        (60.0, 0.0, True),
        (0.001, -5.0, True),  # along the path, however slow
        (-60.0, 5.0, False),  # the motor brakes
        (-1.0, 5.0, False),
        (-0.999, 5.0, True),  # too slow to have a direction: towards the setpoint
        (0.0, 0.0, True),  # on the setpoint: an integral part
        (0.0, -0.099, True),
        (0.0, -0.1, False),  # beyond the setpoint: the torque ends on its own
    ],
)
def test_a_drive_pushes_along_its_path_or_towards_its_setpoint(
    stepped: Stepped, sign: int, speed_deg_s: float, ahead_deg: float, pushes: bool
) -> None:
    assert (felt(stepped, sign * speed_deg_s, sign * 1.0, sign * ahead_deg) == 4) is pushes
    assert felt(stepped, sign * speed_deg_s, sign * 0.999, sign * ahead_deg) is None


# -- every phase ------------------------------------------------------------------------------------------------------


@given(pushes())
@example(Push("play", axis=3, speed_deg_s=0.05, level=1, above=1.01, direction=1))
@example(Push("return", axis=1, speed_deg_s=4.0, level=1, above=1.01, direction=-1))
@example(Push("play", axis=4, speed_deg_s=60.0, level=25, above=1.01, direction=1))
@example(Push("reversal", axis=1, speed_deg_s=60.0, level=12, above=1.01, direction=1))
@example(Push("pause", axis=0, speed_deg_s=5.0, level=1, above=1.01, direction=-1))
@example(Push("play after a paused reversal", axis=2, speed_deg_s=10.0, level=5, above=1.01, direction=1))
@example(Push("way back of a test", axis=0, speed_deg_s=5.0, level=12, above=1.01, direction=-1))
@example(Push("paused test", axis=3, speed_deg_s=5.0, level=12, above=1.01, direction=1))
@examples(few=4, many=100)
def test_a_push_above_the_level_is_answered_in_every_phase(
    tmp_path_factory: pytest.TempPathFactory, push: Push
) -> None:
    hold_answered(tmp_path_factory.mktemp("run"), push)


# -- a push that lasts after a reversal ---------------------------------------------------------------------------

_ANSWERED_S = 0.2
"""0.1 s of push, the ramp of a turn, and two cycles."""


def _reversed(folder: Path, playing_s: float) -> Stepped:
    """Push until the arm turns back, and go on pushing."""
    station = at_the_start(Stepped(folder))
    assert station.send(Play()) is None
    station.forward(playing_s)
    station.apparatus.torques_nm[PUSHED] = 1.1 * THRESHOLD_NM
    for _ in range(15):
        if not any(event.code == "load_reversal" for event in station.link.events):
            station.cycle()
    assert station.link.events[-1].code == "load_reversal"
    return station


def test_pause_during_a_reversal_still_yields_to_the_push(tmp_path: Path) -> None:
    station = _reversed(tmp_path, 3.0)
    assert station.send(Pause()) is None
    station.until("paused", 0.2)
    station.forward(_ANSWERED_S)
    assert station.causes() == ["load_while_held"]


def test_play_after_pause_does_not_ignore_a_lasting_push(tmp_path: Path) -> None:
    station = _reversed(tmp_path, 3.0)
    assert station.send(Pause()) is None
    station.until("paused", 0.2)
    reversals = [event.code for event in station.link.events].count("load_reversal")
    assert station.send(Play()) is None
    station.forward(2 * _ANSWERED_S)
    again = [event.code for event in station.link.events].count("load_reversal") > reversals
    assert again or station.causes()


def test_reversal_that_ends_at_the_start_yields_further(tmp_path: Path) -> None:
    station = _reversed(tmp_path, 0.3)
    station.until("paused", 1.0)
    station.forward(_ANSWERED_S)
    assert station.causes() == ["load_while_held"]
