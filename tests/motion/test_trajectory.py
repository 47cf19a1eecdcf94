"""A recording as a trajectory, and the approach to it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.motion.approach import Approach
from kata.motion.trajectory import AxisLimits, Trajectory, TrajectoryError

LIMITS = [AxisLimits(-100.0, 100.0, 150.0)] * 5
angles = st.lists(st.floats(-100, 100, allow_subnormal=False), min_size=2, max_size=40)


@given(angles, st.floats(-1, 50))
def test_between_samples_it_never_leaves_their_range(samples: list[float], time_s: float) -> None:
    """So a limit that holds at the samples holds everywhere."""
    trajectory = Trajectory(np.arange(len(samples)) * 0.1, np.array([samples] * 5).T)
    n = int(np.clip(time_s / 0.1, 0, len(samples) - 2))
    neighbours = samples if not 0 <= time_s <= trajectory.duration_s else samples[max(0, n - 1) : n + 3]
    assert min(neighbours) - 1e-9 <= trajectory.at(time_s)[0] <= max(neighbours) + 1e-9


def test_it_passes_through_its_samples_and_stands_still_beyond() -> None:
    times = np.array([5.0, 5.1, 5.25, 5.3])
    given_deg = np.random.default_rng(0).uniform(-50, 50, (4, 5))
    trajectory = Trajectory(times, given_deg)

    for time_s, row in zip(times - 5.0, given_deg, strict=True):
        assert trajectory.at(time_s) == pytest.approx(row)
    assert trajectory.at(-1.0) == pytest.approx(given_deg[0])
    assert trajectory.at(9.0) == pytest.approx(given_deg[-1])


@pytest.mark.parametrize(
    ("times", "rows", "sentence"),
    [
        ([0.0], [[0.0] * 5], "at least two samples"),
        ([0.0, 0.1], [[0.0] * 4] * 2, "at least two samples of five"),
        ([0.0, 0.1], [[0.0] * 5, [np.nan] * 5], "not numbers"),
        ([0.0, 0.0], [[0.0] * 5] * 2, "does not increase"),
        ([0.0, 0.5, 3.0], [[0.0] * 5] * 3, "samples are missing for 2.5 s after 0.5 s"),
    ],
)
def test_what_is_no_trajectory(times: list[float], rows: list[list[float]], sentence: str) -> None:
    with pytest.raises(TrajectoryError, match=sentence):
        Trajectory(times, rows)


def test_a_recording_beyond_a_limit_is_refused_with_motor_time_and_values() -> None:
    times = np.arange(0, 2.0, 0.01)
    rows = np.zeros((len(times), 5))
    rows[:, 3] = 103.0 * np.sin(np.pi * times / 2)
    trajectory = Trajectory(times, rows)

    trajectory.check([AxisLimits(-100.0, 100.0, 200.0)] * 5, tolerance_deg=4.0)
    with pytest.raises(TrajectoryError, match=r"motor 4 would go to 103.0 deg at 1.0 s; its range is -100 to 100 deg"):
        trajectory.check([AxisLimits(-100.0, 100.0, 200.0)] * 5, tolerance_deg=2.0)
    with pytest.raises(TrajectoryError, match=r"motor 4 would move at 16\d deg/s at 0.0 s; 150 deg/s is its limit"):
        trajectory.check([AxisLimits(-110.0, 110.0, 150.0)] * 5, tolerance_deg=2.0)


def test_single_counts_of_an_encoder_are_no_speed() -> None:
    """A motor that stands between two counts jumps by 0.088 deg at 100 Hz: 9 deg/s that nobody moved at."""
    times = np.arange(0, 1.0, 0.01)
    rows = np.zeros((len(times), 5))
    rows[::2, 0] = 360 / 4096
    Trajectory(times, rows).check([AxisLimits(-10.0, 10.0, 2.0)] * 5, tolerance_deg=0.0)


def test_a_jerk_is_refused_before_it_is_played() -> None:
    """A sample with a wrong time bends the path where the arm never did."""
    times = np.arange(0, 1.0, 0.01)
    rows = np.zeros((len(times), 5))
    rows[:, 2] = 60.0 * times
    calm = [AxisLimits(-10.0, 100.0, 150.0, 20_000.0)] * 5
    Trajectory(times, rows).check(calm, tolerance_deg=0.0)
    rows[50, 2] += 1.3
    with pytest.raises(TrajectoryError, match=r"motor 3 would jerk at 0.5 s"):
        Trajectory(times, rows).check(calm, tolerance_deg=0.0)


@given(
    st.lists(st.floats(-90, 90), min_size=5, max_size=5),
    st.lists(st.floats(-90, 90), min_size=5, max_size=5),
    st.floats(1, 60),
)
def test_an_approach_gets_there_without_a_jump_and_within_its_speed(
    start: list[float], goal: list[float], speed_deg_s: float
) -> None:
    approach = Approach(np.array(start), np.array(goal), speed_deg_s)
    times = np.linspace(0, approach.duration_s, 500)
    path = np.array([approach.at(time_s) for time_s in times])

    assert path[0] == pytest.approx(start)
    assert path[-1] == pytest.approx(goal)
    speeds = np.abs(np.diff(path, axis=0)) / (times[1] - times[0])
    assert speeds.max() <= speed_deg_s * 1.001
    assert speeds[0].max() <= 0.001 * speed_deg_s + 1e-6
    assert speeds[-1].max() <= 0.001 * speed_deg_s + 1e-6
