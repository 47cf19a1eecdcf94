"""A patient who pushes against the movement: the stroke turns back, twice in the same place ends the run, the arm is held."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from kata.device import journal
from kata.device.config import StationConfig
from kata.device.journal import Files, JournalHeader, JournalWriter
from kata.device.messages import Acknowledge, Approach, Pause, Play, Return
from kata.device.run import Run
from kata.motion.trajectory import Trajectory
from tests.device.conftest import LOAD, a_trajectory
from tests.device.stepped import REST_DEG, Stepped

LEVEL = 10
THRESHOLD_NM = 4.0 * 10 / 25 * 0.98
"""Of a motor whose rated torque is 4 Nm."""
PUSHED = 3
"""The axis that moves in these recordings."""


def at_the_start(stepped: Stepped, level: int = LEVEL, seconds: float = 8.0) -> Stepped:
    """The arm has been brought to where a slow stroke begins."""
    load = msgspec.structs.replace(LOAD, load_level=level)
    assert stepped.send(load, a_trajectory(seconds)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    return stepped


@pytest.fixture
def stroke(stepped: Stepped) -> Stepped:
    """Three seconds into a slow stroke of eight, upwards."""
    at_the_start(stepped)
    assert stepped.send(Play()) is None
    stepped.forward(3.0)
    return stepped


def push(stepped: Stepped, torque_nm: float = 2.0, cycles: int = 11) -> None:
    """The patient resists motor 4 for so many cycles."""
    stepped.apparatus.torques_nm[PUSHED] = torque_nm
    for _ in range(cycles):
        stepped.cycle()
    stepped.apparatus.torques_nm[PUSHED] = 0.0


def position_s(stepped: Stepped) -> float:
    stepped.forward(0.1)
    run = stepped.snapshot.run
    assert run is not None
    return run.position_s


def reversals(stepped: Stepped) -> int:
    run = stepped.snapshot.run
    assert run is not None
    return run.reversals


def test_resistance_over_the_patients_level_turns_the_stroke_back_along_its_path_and_waits(stroke: Stepped) -> None:
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
    # Two seconds back from where it was felt, a tenth of a second after the push began.
    assert position_s(stroke) == pytest.approx(met_at_s + 0.1 - 2.0, abs=0.03)
    told = [event.message for event in stroke.exchange.events if event.code == "load_reversal"]
    assert told == ["Motor 4 met resistance at 3.1 s; the arm is taken back."]
    kept = stroke.journal()
    back = kept.path_s[kept.phase == journal.PHASE_REVERSING]
    assert len(back) > 150
    assert np.all(np.diff(back[30:]) <= 0)
    assert np.diff(back).min() == pytest.approx(-0.01, abs=1e-4)  # no faster than it was taught
    steps_deg = np.abs(np.diff(np.array(stroke.apparatus.written), axis=0))
    assert steps_deg.max() < 0.2  # turning round is as gentle as playing


def test_after_a_reversal_the_arm_waits_until_it_is_told_to_play_on_and_then_plays_to_the_end(stroke: Stepped) -> None:
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


def test_an_arm_that_waits_after_a_reversal_may_be_taken_all_the_way_back(stroke: Stepped) -> None:
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


def test_a_reversal_goes_no_further_back_than_the_start(stepped: Stepped) -> None:
    at_the_start(stepped)
    stepped.send(Play())
    stepped.forward(1.5)
    push(stepped)
    stepped.until("paused")

    assert position_s(stepped) == 0.0
    run = stepped.snapshot.run
    assert run is not None
    assert run.at_start
    kept = stepped.journal()
    assert kept.path_s[kept.phase == journal.PHASE_REVERSING].min() >= 0.0


def test_a_push_shorter_than_a_tenth_of_a_second_is_none(stroke: Stepped) -> None:
    push(stroke, cycles=10)
    stroke.forward(0.1)
    push(stroke, cycles=10)
    stroke.forward(0.1)
    assert reversals(stroke) == 0

    push(stroke, cycles=11)
    stroke.forward(0.1)
    assert reversals(stroke) == 1


@pytest.mark.parametrize("level", [1, LEVEL, 25])
def test_what_the_patients_level_allows_is_no_resistance(stepped: Stepped, level: int) -> None:
    """Level 25 is the drive's own limit, which it reports a little below."""
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
    """The motor brakes an arm that is pushed along; nobody resists."""
    push(stroke, torque_nm=-3.0, cycles=50)
    assert reversals(stroke) == 0

    stroke.forward(2.0)  # past the turning point the arm goes down: now this is the direction of movement
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


@pytest.fixture
def held(stroke: Stepped) -> Stepped:
    """The arm is held after the patient has resisted twice in the same place."""
    push(stroke)
    stroke.until("paused")
    assert stroke.send(Play()) is None
    stroke.forward(2.0)
    push(stroke)
    stroke.until("stopped")
    return stroke


def test_resistance_twice_in_the_same_place_takes_the_arm_back_and_ends_the_run_held(held: Stepped) -> None:
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


def test_a_pause_while_the_arm_is_taken_back_for_the_second_time_does_not_save_the_run(stroke: Stepped) -> None:
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


def test_a_pause_while_the_arm_is_taken_back_for_the_first_time_is_a_pause(stroke: Stepped) -> None:
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


def test_an_arm_that_still_slows_down_to_be_held_is_not_let_go(stroke: Stepped) -> None:
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


def test_a_held_arm_loses_its_torque_to_any_stop_that_wants_it(held: Stepped) -> None:
    held.forward(1.0)
    held.exchange.request_stop()
    held.forward(0.05)

    assert held.causes() == ["load_repeated", "operator_stop"]
    assert not held.torque


def test_an_arm_that_is_held_when_the_browser_is_lost_is_let_go_and_the_stop_says_why(held: Stepped) -> None:
    held.forward(1.0)
    held.exchange.request_stop("browser_lost")
    held.forward(0.05)

    assert held.causes() == ["load_repeated", "browser_lost"]
    assert not held.torque


@pytest.mark.parametrize("way", ["approaching", "returning"])
def test_resistance_on_the_way_there_or_back_holds_the_arm_where_it_is(stepped: Stepped, way: str) -> None:
    stepped.apparatus.angles_deg[PUSHED] = 50.0
    assert stepped.send(msgspec.structs.replace(LOAD, load_level=LEVEL), a_trajectory()) is None
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


def test_what_was_felt_in_one_stroke_does_not_count_in_the_next(stroke: Stepped) -> None:
    """A push just before a pause and one just after it are two short ones."""
    stroke.apparatus.torques_nm[PUSHED] = 2.0
    stroke.forward(0.09)
    stroke.send(Pause())
    stroke.until("paused")
    stroke.send(Play())
    stroke.forward(0.05)
    stroke.apparatus.torques_nm[PUSHED] = 0.0
    stroke.forward(0.2)

    assert reversals(stroke) == 0


def test_while_it_slows_down_for_a_pause_nothing_is_turned_back(stroke: Stepped) -> None:
    stroke.apparatus.torques_nm[PUSHED] = 2.0
    stroke.forward(0.05)
    stroke.send(Pause())
    stroke.until("paused")
    assert reversals(stroke) == 0


def test_pushing_the_other_way_while_the_arm_is_taken_back_changes_nothing(stroke: Stepped) -> None:
    push(stroke)
    stroke.forward(0.5)
    push(stroke, torque_nm=-3.0, cycles=50)
    stroke.until("paused")
    assert reversals(stroke) == 1
    assert stroke.causes() == []


# -- exactly at the limits --------------------------------------------------------------------------------------------


def a_run(folder: Path, trajectory: Trajectory, level: int = 25, **settings: object) -> Run:
    config = msgspec.structs.replace(StationConfig(), **settings)
    header = msgspec.convert(
        {"kind": "run", "id": "r", "recording_id": "a", "station": "s", "rate_hz": config.rate_hz,
         "started_at": "2025-01-01T00:00:00Z", "started_ns": 0},
        JournalHeader,
    )  # fmt: skip
    load = msgspec.structs.replace(LOAD, load_level=level)
    return Run(load, trajectory, JournalWriter(folder, header, Files()), config)


@pytest.mark.parametrize(
    ("first_s", "second_s", "again"),
    [(3.0, 4.0, True), (3.0, 4.001, False), (4.0, 3.0, True), (4.0, 2.999, False), (3.0, 3.0, True)],
)
def test_the_same_place_is_within_a_second_on_the_recordings_clock(
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


@pytest.mark.parametrize("rate_hz", [10, 100])
@pytest.mark.parametrize("direction", [1, -1])
def test_an_axis_slower_than_two_degrees_a_second_has_no_direction_to_push_in(
    stepped: Stepped, tmp_path: Path, rate_hz: int, direction: int
) -> None:
    run = a_run(tmp_path, a_trajectory(), rate_hz=rate_hz)
    facts = stepped.loop._observer.facts(0, None, stepped.loop._situation(0, 0.0))

    def felt(speed_deg_s: float, torque_nm: float) -> int | None:
        run.forget_resistance()
        before = np.array(REST_DEG)
        after = before + np.array([0, 0, 0, 0, direction * speed_deg_s / rate_hz])
        for t_ns in (0, 100_000_000):
            torques = (0.0, 0.0, 0.0, 0.0, direction * torque_nm)
            axis = run.resisted(
                msgspec.structs.replace(facts, t_ns=t_ns, torque_nm=torques), tuple(before), tuple(after)
            )
        return axis

    rated_nm = run.config.axes[4].max_torque_nm
    assert felt(2.0, rated_nm) == 4
    assert felt(1.999, rated_nm) is None
    assert felt(2.001, rated_nm * 0.98) == 4
    assert felt(2.001, rated_nm * 0.98 - 0.001) is None
