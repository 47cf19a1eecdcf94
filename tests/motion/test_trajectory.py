"""A recording as a trajectory, and the approach to it."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from kata.motion.approach import MinimumJerkMove, PathSequence, unidirectional_approach
from kata.motion.linkage import Floats
from kata.motion.method import Method, reference
from kata.motion.smoothing import natural_derivatives, natural_spline
from kata.motion.trajectory import AxisLimits, Trajectory, TrajectoryError, ZeroOrderHold
from tests.support.examples import examples

METHODS: tuple[Method, ...] = ("paper", "smooth", "learned")

angles = st.lists(st.floats(-100, 100, allow_subnormal=False), min_size=2, max_size=40)
STEPS_S = st.lists(st.sampled_from([0.001, 0.008, 0.01, 0.012, 0.1, 0.9]), min_size=40, max_size=40)


def columns(samples: list[float]) -> Floats:
    """Return five axes with the same angles."""
    return np.array([samples] * 5).T


@settings(max_examples=50)
@given(angles, STEPS_S)
def test_limits_check_the_highest_and_lowest_angle_ever_reached(samples: list[float], steps_s: list[float]) -> None:
    """A smooth curve exceeds its samples, and a setpoint may lie anywhere."""
    trajectory = Trajectory(np.cumsum(steps_s)[: len(samples)], columns(samples))
    assume(trajectory.duration_s >= 0.1)
    path = trajectory.along(np.linspace(0.0, trajectory.duration_s, 500))
    low, high = float(path.min()), float(path.max())
    with pytest.raises(TrajectoryError, match=r"motor 1 would go to"):
        trajectory.check([AxisLimits(low - 1000.0, high - 0.01, np.inf)] * 5, tolerance_deg=0.0)
    with pytest.raises(TrajectoryError, match=r"motor 1 would go to"):
        trajectory.check([AxisLimits(low + 0.01, high + 1000.0, np.inf)] * 5, tolerance_deg=0.0)
    _, extremes = trajectory._extremes()
    assert extremes.min() <= low + 1e-9
    assert extremes.max() >= high - 1e-9
    trajectory.check([AxisLimits(float(extremes.min()), float(extremes.max()), np.inf)] * 5, tolerance_deg=0.0)


@settings(max_examples=50)
@given(angles, STEPS_S)
def test_trajectory_preserves_any_taught_motion(samples: list[float], steps_s: list[float]) -> None:
    times = np.cumsum(steps_s)[: len(samples)]
    trajectory = Trajectory(times, columns(samples))
    off = trajectory.along(times - times[0]) - columns(samples)
    assert np.sqrt(np.mean(off**2, axis=0)) == pytest.approx(trajectory.rmse_deg, abs=1e-6)
    assert trajectory.rmse_deg.max() <= 0.2


@settings(max_examples=50)
@given(angles, STEPS_S, st.floats(0.02, 0.98))
def test_its_speed_and_acceleration_are_those_of_its_angles(
    samples: list[float], steps_s: list[float], share: float
) -> None:
    trajectory = Trajectory(np.cumsum(steps_s)[: len(samples)], columns(samples))
    time_s, d = share * trajectory.duration_s, 1e-6
    before, here, after = (trajectory.motion_at(time_s + way) for way in (-d, 0.0, d))
    assert trajectory.at(time_s) == pytest.approx(here.angles_deg)
    assert trajectory.along(np.array([time_s]))[0] == pytest.approx(here.angles_deg, abs=1e-6)
    # Continuous up to the second derivative, so differences stay close for any sample.
    near = 1e-3 * (1 + np.abs(trajectory._coefficients[0]).max())
    assert after.angles_deg - before.angles_deg == pytest.approx(2 * d * here.speed_deg_s, abs=d * near)
    assert after.speed_deg_s - before.speed_deg_s == pytest.approx(2 * d * here.acceleration_deg_s2, abs=d * near)


@pytest.mark.parametrize("count", [2, 3, 1000])
def test_natural_spline_is_scipys(count: int) -> None:
    random = np.random.default_rng(count)
    times, angles = np.cumsum(random.uniform(0.001, 0.1, count)), random.normal(0.0, 40.0, (count, 5))
    expected = CubicSpline(times, angles, bc_type="natural")
    np.testing.assert_allclose(natural_spline(times, angles), expected.c, rtol=1e-12, atol=1e-9)
    for order, derivative in enumerate(natural_derivatives(times, angles), start=1):
        np.testing.assert_allclose(derivative, expected(times, order), rtol=1e-12, atol=1e-7)


def test_trajectory_rests_beyond_its_ends_and_keeps_its_speed_before() -> None:
    """A pedal may be released in full motion."""
    times = 5.0 + np.arange(0.0, 2.0, 0.01)
    rows = columns(list(40.0 * (times - 5.0)))
    trajectory = Trajectory(times, rows)
    assert trajectory.duration_s == pytest.approx(1.99)
    for time_s, angle in ((-1.0, 0.0), (0.0, 0.0), (1.0, 40.0), (1.99, 79.6), (9.0, 79.6)):
        assert trajectory.at(time_s) == pytest.approx([angle] * 5, abs=1e-6)
        assert trajectory.motion_at(time_s).speed_deg_s == pytest.approx([40.0] * 5)


@pytest.mark.parametrize(
    ("times", "rows", "sentence"),
    [
        ([0.0], [[0.0] * 5], "at least two samples"),
        ([0.0, 0.1], [[0.0] * 4] * 2, "at least two samples of five"),
        ([0.0, 0.1], [[0.0] * 5, [np.nan] * 5], "not numbers"),
        ([0.0, 0.0], [[0.0] * 5] * 2, "does not increase"),
        ([0.0, 0.00005], [[0.0] * 5] * 2, "closer together than 0.1 ms"),
        ([0.0, 0.5, 3.0], [[0.0] * 5] * 3, "samples are missing for 2.5 s after 0.5 s"),
    ],
)
def test_invalid_trajectories_are_refused(times: list[float], rows: list[list[float]], sentence: str) -> None:
    with pytest.raises(TrajectoryError, match=sentence):
        Trajectory(times, rows)


def test_recording_beyond_a_limit_is_refused_with_motor_time_values() -> None:
    times = np.arange(0, 2.0, 0.01)
    rows = np.zeros((len(times), 5))
    rows[:, 3] = 103.0 * np.sin(np.pi * times / 2)
    trajectory = Trajectory(times, rows)

    trajectory.check([AxisLimits(-100.0, 100.0, 200.0)] * 5, tolerance_deg=4.0)
    with pytest.raises(TrajectoryError, match=r"motor 4 would go to 103.0° at 1.0 s; its range is -100 to 100°"):
        trajectory.check([AxisLimits(-100.0, 100.0, 200.0)] * 5, tolerance_deg=2.0)
    with pytest.raises(TrajectoryError, match=r"motor 4 would move at 16\d°/s at 0.0 s; its limit is 150°/s"):
        trajectory.check([AxisLimits(-110.0, 110.0, 150.0)] * 5, tolerance_deg=2.0)


def test_single_counts_of_an_encoder_are_no_speed() -> None:
    """A motor at rest between two counts jumps by 0.088 deg at 100 Hz: 9 deg/s without any movement."""
    times = np.arange(0, 1.0, 0.01)
    rows = np.zeros((len(times), 5))
    rows[::2, 0] = 360 / 4096
    for method in METHODS:
        reference(method, times, rows).check([AxisLimits(-10.0, 10.0, 2.0)] * 5, tolerance_deg=0.0)


def test_jerk_is_refused_before_playback() -> None:
    times = np.arange(0, 1.0, 0.01)
    rows = np.zeros((len(times), 5))
    rows[:, 2] = 60.0 * times
    calm = [AxisLimits(-10.0, 100.0, np.inf, 20_000.0)] * 5
    Trajectory(times, rows).check(calm, tolerance_deg=0.0)
    # Two recordings were joined.
    rows[50:, 2] += 20.0
    with pytest.raises(TrajectoryError, match=r"motor 3 would jerk at 0.5 s"):
        Trajectory(times, rows).check(calm, tolerance_deg=0.0)


def test_motion_too_abrupt_at_100_hertz_may_pass_at_ten() -> None:
    times = np.arange(0, 2.01, 0.1)
    rows = np.zeros((len(times), 5))
    rows[10:, 2] = 14.0
    held = ZeroOrderHold(times, rows)
    held.check([AxisLimits(-10.0, 20.0, 150.0, 1400.1)] * 5, tolerance_deg=0.0)
    with pytest.raises(TrajectoryError, match=r"motor 3 would jerk at 0.9 s"):
        held.check([AxisLimits(-10.0, 20.0, 150.0, 1399.9)] * 5, tolerance_deg=0.0)


@examples(few=30, many=300)
@given(
    st.lists(st.floats(-90, 90), min_size=5, max_size=5),
    st.lists(st.floats(-90, 90), min_size=5, max_size=5),
    st.floats(1, 60),
)
def test_approach_arrives_without_a_jump_and_within_its_speed(
    start: list[float], goal: list[float], speed_deg_s: float
) -> None:
    approach = MinimumJerkMove(np.array(start), np.array(goal), speed_deg_s)
    times = np.linspace(0, approach.duration_s, 500)
    moving = [approach.motion_at(time_s) for time_s in times]
    path = np.array([motion.angles_deg for motion in moving])

    assert path[0] == pytest.approx(start)
    assert path[-1] == pytest.approx(goal)
    speeds = np.abs(np.diff(path, axis=0)) / (times[1] - times[0])
    assert speeds.max() <= speed_deg_s * 1.001
    assert speeds[0].max() <= 0.001 * speed_deg_s + 1e-6
    assert speeds[-1].max() <= 0.001 * speed_deg_s + 1e-6
    for values, rate, allowed in (
        (path, [motion.speed_deg_s for motion in moving], 0.05),
        ([motion.speed_deg_s for motion in moving], [motion.acceleration_deg_s2 for motion in moving], 0.5),
    ):
        assert np.abs(np.gradient(values, times, axis=0) - rate)[1:-1].max() <= allowed


def test_every_axis_reaches_the_start_from_its_departure_side() -> None:
    times = np.arange(0, 4.01, 0.1)
    rows = np.zeros((len(times), 5))
    there_and_back = 1 - np.cos(times * np.pi / 2)
    # The axes: far up, far down, slightly up, slightly up and then far down, none.
    rows[:, 0], rows[:, 1], rows[:, 2] = 20 * there_and_back, 90 - 15 * there_and_back, 0.2 * there_and_back
    rows[:, 3] = 0.5 * np.sin(times * np.pi) * (times < 1) - 15 * there_and_back * (times >= 2)
    trajectory = Trajectory(times, rows)
    start = trajectory.start_deg

    for here in (start - 10, start + 10):
        way = unidirectional_approach(here, start, trajectory.departure_deg, 15.0)
        path = np.array([way.motion_at(time_s).angles_deg for time_s in np.linspace(0, way.duration_s, 1000)])
        assert path[0] == pytest.approx(here)
        assert path[-1] == pytest.approx(start)
        came = path[-1] - way.motion_at(way.duration_s - 0.9).angles_deg
        assert list(np.sign(came[[0, 1, 3]])) == [-1, 1, 1]
        assert abs(came[2]) <= 0.45
        assert abs(came[4]) <= 1e-9
        # Once aside, it never passes the start on the other side, where nothing was taught.
        aside = path[np.argmax(np.all(np.abs(path - start) <= 2.0 + 1e-9, axis=1)) :]
        assert np.abs(aside - start).max() <= 2.0 + 1e-6


def test_path_of_several_legs_is_continuous_and_rests_between_them() -> None:
    legs = [
        MinimumJerkMove(np.zeros(5), np.full(5, 10.0), 15.0),
        MinimumJerkMove(np.full(5, 10.0), np.full(5, 8.0), 15.0),
    ]
    way = PathSequence(legs)
    assert way.duration_s == legs[0].duration_s + legs[1].duration_s
    for time_s in (-1.0, 0.0, legs[0].duration_s, way.duration_s, way.duration_s + 1):
        assert way.motion_at(time_s).speed_deg_s == pytest.approx(np.zeros(5))
    before, after = (way.motion_at(legs[0].duration_s + by) for by in (-1e-6, 1e-6))
    assert before.angles_deg == pytest.approx(after.angles_deg, abs=1e-6)
    assert way.motion_at(way.duration_s + 1).angles_deg == pytest.approx(np.full(5, 8.0))
