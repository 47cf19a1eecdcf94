"""The range override while a recording plays, and its slow recovery."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kata.device import journal
from kata.device.ipc_messages import Approach, Pause, Play, ReduceRange, Return
from kata.device.range_override import MIN_SHARE, RECOVERY_DEG, REDUCTION_STEP, RangeOverride
from kata.motion.ilc import Correction
from kata.motion.linkage import Floats
from kata.motion.method import Method, reference
from kata.motion.path import PathPoint
from kata.motion.trajectory import Trajectory
from tests.support.playback import MOVING, load, place_s, sent, station, until_place
from tests.support.stepped import REST_DEG, Stepped

SECONDS = 4.0
REPETITIONS = 8


def strokes(repetitions: int = REPETITIONS) -> tuple[Floats, Floats]:
    """Return strokes from 0 to 60 deg and back."""
    times = np.arange(0.0, repetitions * SECONDS + 0.001, 0.01)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, MOVING] = 30.0 * (1 - np.cos(2 * np.pi * times / SECONDS))
    return times, angles


def comfort(repetition_s: float = SECONDS, max_speed_deg_s: float = 120.0) -> RangeOverride:
    return RangeOverride(reference("smooth", *strokes()), repetition_s, np.full(5, max_speed_deg_s))


def standing(comfort: RangeOverride, angle_deg: float = 60.0, speed_deg_s: float = 0.0) -> PathPoint:
    angles, speed = comfort.trajectory.rest_deg.copy(), np.zeros(5)
    angles[MOVING], speed[MOVING] = angle_deg, speed_deg_s
    return PathPoint(angles, speed, np.zeros(5))


def reached(comfort: RangeOverride, seconds: float, speed_override: float = 1.0) -> list[float]:
    """Return the moving axis every 0.01 s; its path would be held at 60 deg."""
    at = standing(comfort)
    return [float(comfort.apply(at, speed_override, 0.01).angles_deg[MOVING]) for _ in range(round(100 * seconds))]


# -- how much ---------------------------------------------------------------------------------------------------------


def test_range_is_whole_and_unchanged_until_reduction_is_requested() -> None:
    whole = comfort()
    at = standing(whole)
    assert all(whole.apply(at, 1.0, 0.01) is at for _ in range(1000))
    assert whole.is_full
    assert not whole.at_minimum


def test_one_step_removes_a_tenth_of_range_within_a_second() -> None:
    less = comfort()
    less.reduce()
    angles = reached(less, 1.0)
    # 60 deg from rest: a tenth of it is 6 deg. The smoothed start lies 0.05 deg below 0.
    assert angles[-1] == pytest.approx(54.0, abs=0.02)
    assert less.share == pytest.approx(0.9)
    assert not less.is_full
    assert np.all(np.diff(angles) <= 0.001)


def test_override_neither_jumps_nor_jerks() -> None:
    less = comfort()
    less.reduce()
    less.reduce()
    angles = np.array([60.0, 60.0, *reached(less, 2.0)])
    assert np.abs(np.diff(angles)).max() / 0.01 <= 0.25 * 60.1
    assert np.abs(np.diff(angles, 2)).max() / 0.01**2 <= 1.0 * 60.1
    assert angles[-1] == pytest.approx(48.0, abs=0.02)


@pytest.mark.parametrize("moving", [False, True])
def test_reported_speed_and_acceleration_match_the_override(moving: bool) -> None:
    less = comfort()
    less.reduce()
    at = [less.trajectory.motion_at(0.3 + n / 1000) if moving else standing(less) for n in range(900)]
    motions = [less.apply(motion, 1.0, 0.001) for motion in at]
    angles, speeds, accelerations = (np.array([part[MOVING] for part in parts]) for parts in zip(*motions, strict=True))
    # A difference is the derivative half a step earlier.
    assert speeds[1:] == pytest.approx(np.diff(angles) / 0.001, abs=0.1)
    assert accelerations[1:] == pytest.approx(np.diff(speeds) / 0.001, abs=0.6)
    assert np.abs(speeds).max() > 5.0


def test_on_moving_paths_its_speed_scales_with_the_remaining_range() -> None:
    less = comfort()
    less.reduce()
    reached(less, 1.0)
    moving = less.apply(standing(less, 30.0, 50.0), 1.0, 0.01)
    assert moving.speed_deg_s[MOVING] == pytest.approx(0.9 * 50.0)
    assert moving.angles_deg[MOVING] == pytest.approx(27.0, abs=0.01)


def test_less_and_less_ends_at_a_fifth_of_the_range() -> None:
    less = comfort(repetition_s=1000.0)
    for _ in range(8):
        assert not less.at_minimum
        less.reduce()
    assert less.at_minimum
    less.reduce()
    reached(less, 10.0)
    assert less.share == pytest.approx(MIN_SHARE)


@pytest.mark.parametrize(
    ("left_of_a_step", "taken_too"), [(0.4, True), (0.5, False), (0.6, False)], ids=["less", "half", "more"]
)
def test_step_also_takes_a_remainder_below_half_a_step(left_of_a_step: float, taken_too: bool) -> None:
    left = MIN_SHARE + left_of_a_step * REDUCTION_STEP
    # Exactly this share is left, in floating-point numbers.
    share = (
        left + REDUCTION_STEP
        if left + REDUCTION_STEP - REDUCTION_STEP == left
        else math.nextafter(left + REDUCTION_STEP, 1.0)
    )
    assert share - REDUCTION_STEP == left
    less = replace(comfort(), share=share)
    less.reduce()
    assert less.at_minimum is taken_too


def test_arm_at_rest_and_still_motors_do_not_move() -> None:
    less = comfort()
    less.reduce()
    for _ in range(200):
        motion = less.apply(standing(less, float(less.trajectory.start_deg[MOVING])), 1.0, 0.01)
        assert motion.angles_deg == pytest.approx(less.trajectory.start_deg, abs=1e-9)


def raised_strokes() -> Trajectory:
    """Strokes that begin with the raised arm: a part that was cut out of a recording."""
    times, angles = strokes()
    return reference("smooth", times, np.roll(angles, len(times) // (2 * REPETITIONS), axis=0))


@pytest.mark.parametrize("trajectory", [reference("smooth", *strokes()), raised_strokes()], ids=["hanging", "raised"])
def test_reduction_never_moves_a_motor_away_from_rest(trajectory: Trajectory) -> None:
    less = RangeOverride(trajectory, SECONDS, np.full(5, 120.0))
    for at_s in np.arange(0.0, trajectory.duration_s, 0.01):
        if at_s % 0.5 < 0.01:
            less.reduce()
        whole = trajectory.motion_at(at_s)
        reduced = less.apply(whole, 1.0, 0.01).angles_deg
        assert np.all(np.abs(reduced - REST_DEG) <= np.abs(whole.angles_deg - REST_DEG) + 0.1)
    assert not less.is_full


def test_reduction_adds_no_more_than_an_approachs_speed() -> None:
    less = comfort()
    less.reduce()
    angles = np.array([150.0, *(less.apply(standing(less, 150.0), 1.0, 0.01).angles_deg[MOVING] for _ in range(300))])
    assert angles[-1] == pytest.approx(135.0, abs=0.01)
    assert np.abs(np.diff(angles)).max() / 0.01 == pytest.approx(15.0, abs=0.05)


def test_share_changes_by_at_most_a_quarter_each_second() -> None:
    less = comfort()
    less.reduce()
    less.reduce()
    shares = [1.0]
    for _ in range(200):
        less.apply(standing(less, 10.0), 1.0, 0.01)
        shares.append(less.share)
    assert shares[-1] == pytest.approx(0.8)
    assert np.abs(np.diff(shares)).max() / 0.01 == pytest.approx(0.25)


def test_motor_at_its_highest_speed_is_not_accelerated() -> None:
    less = comfort(max_speed_deg_s=50.0)
    less.reduce()
    for _ in range(100):
        motion = less.apply(standing(less, 60.0, -50.0), 1.0, 0.01)
        assert abs(motion.speed_deg_s[MOVING]) <= 50.0 + 1e-9
    # Near rest too.
    for _ in range(50):
        less.apply(standing(less, 0.5, -50.0), 1.0, 0.01)
    assert less.is_full
    for _ in range(10):
        less.apply(standing(less, 60.0, -60.0), 1.0, 0.01)
        assert less.share == 1.0
    for _ in range(30):
        motion = less.apply(standing(less, 60.0, -46.0), 1.0, 0.01)
        assert abs(motion.speed_deg_s[MOVING]) <= 50.0 + 1e-9
    assert not less.is_full
    for _ in range(100):
        less.apply(standing(less, 60.0, -20.0), 1.0, 0.01)
    assert less.share == pytest.approx(0.9)


# -- when -------------------------------------------------------------------------------------------------------------


def test_held_arm_stays_held() -> None:
    less = comfort()
    less.reduce()
    assert reached(less, 3.0, speed_override=0.0) == pytest.approx([60.0] * 300)
    assert reached(less, 1.0)[-1] == pytest.approx(54.0, abs=0.01)


def test_range_recovers_by_a_warm_up_step_after_each_repetition() -> None:
    less = comfort()
    less.reduce()
    reached(less, SECONDS - 0.05)
    assert less.share == pytest.approx(0.9)
    # The axis with the largest range has 60 deg.
    reached(less, SECONDS)
    assert less.share == pytest.approx(0.9 + RECOVERY_DEG / 60.0, abs=0.005)
    reached(less, 2 * SECONDS)
    assert less.is_full
    assert reached(less, 0.1)[-1] == 60.0


def test_new_request_starts_from_the_recovered_range_and_waits_again() -> None:
    less = comfort()
    less.reduce()
    reached(less, 2 * SECONDS)
    less.reduce()
    reached(less, SECONDS - 0.1)
    assert less.share == pytest.approx(0.8 + RECOVERY_DEG / 60.0, abs=0.005)


def test_range_does_not_recover_during_a_reversal() -> None:
    less = comfort()
    less.reduce()
    reached(less, 3 * SECONDS, speed_override=-1.0)
    assert less.share == pytest.approx(0.9)
    reached(less, SECONDS - 0.1)
    assert less.share == pytest.approx(0.9)


def test_recording_without_motion_has_no_range_and_no_errors() -> None:
    times, angles = strokes(1)
    still = RangeOverride(Trajectory(times, np.tile(angles[:1], (len(times), 1))), 4.0, np.full(5, 120.0))
    still.reduce()
    at = standing(still, 0.0)
    for _ in range(1000):
        motion = still.apply(at, 1.0, 0.01)
    assert np.all(np.isfinite(motion.angles_deg))


# -- in a run ---------------------------------------------------------------------------------------------------------


def playing(folder: Path, method: Method = "smooth", **settings: float) -> Stepped:
    stepped = Stepped(folder, station(**settings))
    trajectory = reference(method, *strokes())
    assert stepped.send(load(method, repetition_s=SECONDS), trajectory) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None
    return stepped


@pytest.mark.parametrize(
    "method",
    [
        "paper",
        "smooth",
        pytest.param("learned", marks=pytest.mark.campaign),
    ],
)
def test_less_makes_the_strokes_smaller_and_they_grow_again(tmp_path: Path, method: Method) -> None:
    stepped = playing(tmp_path, method)
    until_place(stepped, 3.0)
    assert stepped.send(ReduceRange()) is None
    assert stepped.send(ReduceRange()) is None
    peaks = []
    for stroke in range(1, REPETITIONS):
        first = len(sent(stepped))
        until_place(stepped, (stroke + 1) * SECONDS - 0.02)
        peaks.append(float(sent(stepped)[first:].max()))
    assert stepped.causes() == []
    assert peaks[0] == pytest.approx(48.0, abs=0.2)
    # A fifth less of 60 deg is 12 deg at the far end; each repetition returns a part of it.
    assert np.diff(peaks[1:5]) == pytest.approx(RECOVERY_DEG, abs=0.1)
    stepped.until("idle", 60.0)
    assert stepped.causes() == []
    assert any("The range was reduced at 3.0 s" in event.message for event in stepped.link.events)


def test_papers_reduction_is_as_slow_as_its_place_needs(tmp_path: Path) -> None:
    """The farther the arm is from rest, the slower the share may change. The recording rests at 100 deg, and one second away it is at 67."""
    times = np.arange(0.0, 4.001, 0.01)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, MOVING] = 100.0 * np.clip((2.0 - np.abs(times - 2.0)) / 1.5, 0.0, 1.0)
    stepped = Stepped(tmp_path, station())
    assert stepped.send(load("paper"), reference("paper", times, angles)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None
    until_place(stepped, 1.65)
    assert stepped.send(ReduceRange()) is None
    first = len(sent(stepped))
    until_place(stepped, 2.35)
    steps = np.diff(sent(stepped)[first:])
    assert stepped.causes() == []
    # 15 deg/s for 0.1 s.
    assert np.abs(steps).max() == pytest.approx(1.5, abs=0.01)


def test_snapshot_reports_the_played_share_of_the_range(tmp_path: Path) -> None:
    stepped = playing(tmp_path)
    until_place(stepped, 1.0)
    run = stepped.snapshot.run
    assert run is not None and run.range_percent == 100.0
    stepped.send(ReduceRange())
    until_place(stepped, 2.5)
    run = stepped.snapshot.run
    assert run is not None and run.range_percent == pytest.approx(90.0)


def test_reduced_range_reduces_the_learned_correction(tmp_path: Path) -> None:
    times, angles = strokes()
    learned = Correction(0.02, np.full((int(times[-1] / 0.02) + 1, 5), 2.0))
    stepped = Stepped(tmp_path, station())
    trajectory = reference("learned", times, angles)
    assert stepped.send(load("learned", repetition_s=SECONDS), trajectory, learned) is None
    stepped.send(Approach())
    stepped.until("paused")
    stepped.send(Play())
    until_place(stepped, 1.0)
    for _ in range(5):
        stepped.send(ReduceRange())
    until_place(stepped, 5.0)
    run, movement = stepped.loop._machine._run, stepped.loop._machine._movement
    assert run is not None and movement is not None
    assert run.range_override.share == pytest.approx(0.5, abs=0.02)
    middle_deg = run.range_override.reduced_deg(run.trajectory.at(movement.place_s(-0.5 / run.rate_hz)))
    assert sent(stepped)[-1] - middle_deg[MOVING] == pytest.approx(2.0 * run.range_override.share, abs=0.05)


def test_reduced_playback_is_marked_and_neither_compared_nor_learned(tmp_path: Path) -> None:
    stepped = playing(tmp_path)
    until_place(stepped, 3.0)
    stepped.send(ReduceRange())
    stepped.until("idle", 60.0)
    recorded = stepped.journal()
    lessened = recorded.path_s[recorded.phase == journal.PHASE_REDUCED_RANGE]
    # From the request to the full range: one repetition, and 6 deg at 2.5 deg a repetition.
    assert lessened.min() == pytest.approx(3.0, abs=0.05)
    assert lessened.max() == pytest.approx(3.0 + SECONDS * (1 + 6.0 / RECOVERY_DEG), abs=0.6)
    assert not np.any(recorded.repetition.playing[recorded.phase == journal.PHASE_REDUCED_RANGE])
    assert np.any(recorded.path_s[recorded.phase == journal.PHASE_PLAYING] > lessened.max())


def test_reduction_requested_in_a_pause_applies_on_resume(tmp_path: Path) -> None:
    stepped = playing(tmp_path)
    until_place(stepped, 2.0)
    stepped.send(Pause())
    stepped.until("paused")
    stepped.forward(0.2)
    before = sent(stepped)[-1]
    assert stepped.send(ReduceRange()) is None
    stepped.forward(1.0)
    assert sent(stepped)[-1] == pytest.approx(before, abs=1e-9)
    stepped.send(Play())
    until_place(stepped, 6.0)
    assert sent(stepped)[-1] == pytest.approx(54.0, abs=0.3)
    assert stepped.causes() == []


def test_going_back_from_less_begins_where_the_arm_is(tmp_path: Path) -> None:
    stepped = playing(tmp_path, lag_s=0.08)
    until_place(stepped, 1.9)
    for _ in range(4):
        stepped.send(ReduceRange())
    until_place(stepped, 4.0)
    stepped.send(Pause())
    stepped.until("paused")
    assert stepped.send(Return()) is None
    stepped.until("idle", 60.0)
    assert stepped.causes() == []
    assert np.abs(np.diff(sent(stepped))).max() < 2.0


@pytest.mark.counted
def test_reduction_is_refused_without_playback_or_remaining_range(tmp_path: Path) -> None:
    stepped = Stepped(tmp_path)
    refusal = stepped.send(ReduceRange())
    assert refusal is not None and refusal.code == "is_idle"
    stepped = playing(tmp_path)
    for _ in range(8):
        assert stepped.send(ReduceRange()) is None
    refusal = stepped.send(ReduceRange())
    assert refusal is not None
    assert (refusal.code, refusal.message) == ("is_at_least", "The range cannot be less than 20 %.")
    assert place_s(stepped) < 1.0
