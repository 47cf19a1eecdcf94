"""Comparison of playback with teaching."""

import numpy as np
import pytest

from kata.motion.linkage import Floats
from kata.motion.tracking import compare, compare_motions, error_figures, wall_clock_s

TIMES_S = np.arange(0, 4.0, 0.01)
TAUGHT_DEG = np.column_stack([amplitude * np.sin(TIMES_S) for amplitude in (1, 5, 10, 20, 40)])


def test_a_playback_that_lags_has_the_error_of_its_lag() -> None:
    lag_s = 0.05
    path_s = np.arange(0.0, 3.9, 0.013)
    after = path_s >= 0.5
    played = np.column_stack([a * np.sin(np.maximum(path_s - lag_s, 0)) for a in (1, 5, 10, 20, 40)])
    comparison = compare(TIMES_S + 100.0, TAUGHT_DEG, path_s, played)

    assert comparison.samples == len(path_s)
    for motor, amplitude in zip(comparison.motors, (1, 5, 10, 20, 40), strict=True):
        # The sine is fastest, and its error largest, at its zero crossings: -a cos(t) * lag.
        assert abs(motor.peak_deg) == pytest.approx(amplitude * lag_s, rel=0.01)
        assert motor.start_deg == pytest.approx(-amplitude * lag_s, rel=0.01)
        error = amplitude * (np.sin(np.maximum(path_s - lag_s, 0)) - np.sin(path_s))
        assert motor.rmse_deg == pytest.approx(np.sqrt(np.mean(error[after] ** 2)), rel=1e-3)


def test_start_and_rest_together_hide_no_error() -> None:
    error = np.random.default_rng(22).normal(0.0, 1.0, (20, 200))
    for values in error:
        found = error_figures(np.linspace(0.0, 1.99, 200), values)
        assert max(abs(found.start_deg), abs(found.peak_deg)) == np.abs(values).max()


def test_playback_that_ended_in_its_start_has_one_error() -> None:
    found = error_figures(np.array([0.0, 0.1, 0.2]), np.array([0.5, -1.5, 1.0]))
    assert (found.peak_deg, found.peak_at_s, found.start_deg) == (-1.5, 0.1, -1.5)


def test_wall_clock_begins_again_after_an_interruption() -> None:
    times_s = np.array([10.0, 10.1, 10.2, 14.0, 15.0, 15.1, 15.2])
    path_s = np.array([np.nan, 0.0, 0.05, 0.05, 0.03, 0.1, 0.2])
    moving = np.array([False, True, True, False, True, True, True])
    wall_s = wall_clock_s(times_s, path_s, moving)
    assert wall_s == pytest.approx([np.nan, 0.0, 0.1, np.nan, 0.03, 0.13, 0.23], nan_ok=True)
    assert np.isnan(wall_clock_s(times_s, path_s, np.zeros(7, dtype=bool))).all()


def test_peak_keeps_sign_and_place_and_the_start_is_apart() -> None:
    path_s = np.array([0.0, 1.0, 2.0])
    played = np.column_stack([a * np.sin(path_s) for a in (1, 5, 10, 20, 40)])
    played[0, 2] += 0.5
    played[1, 2] -= 3.0
    motor = compare(TIMES_S, TAUGHT_DEG, path_s, played).motors[2]

    assert motor.motor == 3
    assert motor.start_deg == pytest.approx(0.5)
    assert motor.peak_deg == pytest.approx(-3.0, abs=1e-3)
    assert motor.peak_at_s == 1.0


def test_the_error_is_playback_minus_teaching() -> None:
    comparison = compare(TIMES_S, TAUGHT_DEG, TIMES_S, TAUGHT_DEG + 2.0)
    assert comparison.error_deg == pytest.approx(2.0)


def test_nothing_played_is_nothing_compared() -> None:
    with pytest.raises(ValueError, match="no samples"):
        compare(TIMES_S, TAUGHT_DEG, [], np.empty((0, 5)))


@pytest.mark.parametrize("lag_s", [-0.03, 0.0, 0.0042, 0.05, 0.2])
@pytest.mark.parametrize("rate_hz", [10, 100])
def test_lag_is_found_to_a_fraction_of_a_sample(lag_s: float, rate_hz: int) -> None:
    """With a constant error, an encoder's counts, and gaps where nothing was measured."""
    times_s = np.arange(0, 12.0, 0.01)
    path_s = np.arange(0.0, 11.0, 1 / rate_hz)
    path_s = path_s[(path_s < 3.0) | (path_s > 4.5)]
    amplitudes = np.array([5.0, 8.0, 10.0, 20.0, 40.0])

    def motion(times: Floats) -> Floats:
        return np.outer(np.sin(np.maximum(times, 0.0)) + 0.3 * np.sin(3.1 * np.maximum(times, 0.0)), amplitudes)

    count_deg = 360 / 4096
    played = np.round((motion(path_s - lag_s) + 1.5) / count_deg) * count_deg
    comparison = compare(times_s, motion(times_s), path_s, played)
    for motor in comparison.motors:
        assert motor.lag_ms == pytest.approx(lag_s * 1000, abs=2.0)


def test_motor_that_hardly_moves_has_no_lag_or_smoothness() -> None:
    taught = TAUGHT_DEG.copy()
    taught[:, 1] = 0.5 * np.sin(TIMES_S)
    motors = compare(TIMES_S, taught, TIMES_S, taught).motors
    assert (motors[1].lag_ms, motors[1].taught_smoothness, motors[1].played_smoothness) == (None, None, None)
    assert motors[2].lag_ms == pytest.approx(0.0, abs=0.1)
    assert motors[2].taught_smoothness == pytest.approx(motors[2].played_smoothness or 0.0, abs=1e-6)


def test_reached_range_is_compared_with_the_whole_taught_range() -> None:
    path_s = np.arange(0.0, 1.0, 0.01)
    played = 0.9 * np.array([np.interp(path_s, TIMES_S, angles) for angles in TAUGHT_DEG.T]).T
    motor = compare(TIMES_S, TAUGHT_DEG, path_s, played).motors[4]
    assert motor.taught == pytest.approx((40 * np.sin(3.99), 40.0), abs=1e-3)
    assert motor.played == pytest.approx((0.0, 0.9 * 40 * np.sin(0.99)), abs=1e-3)


def test_largest_torque_keeps_its_sign() -> None:
    torque = np.zeros_like(TAUGHT_DEG)
    torque[100, 3], torque[200, 3] = 1.5, -2.5
    motors = compare(TIMES_S, TAUGHT_DEG, TIMES_S, TAUGHT_DEG, torque).motors
    assert motors[3].torque_peak_nm == -2.5
    assert compare(TIMES_S, TAUGHT_DEG, TIMES_S, TAUGHT_DEG).motors[3].torque_peak_nm is None


def test_a_jerky_playback_is_less_smooth_than_its_teaching() -> None:
    times_s = np.arange(0.0, 10.0, 0.01)
    taught = np.repeat(20 * np.sin(times_s)[:, None], 5, axis=1)
    held = taught[(np.arange(len(times_s)) // 10) * 10]
    motor = compare(times_s, taught, times_s, held).motors[0]
    assert motor.played_smoothness is not None
    assert motor.taught_smoothness is not None
    assert motor.played_smoothness < motor.taught_smoothness - 0.1


def test_each_place_counts_once_for_smoothness_despite_reversals() -> None:
    path_s = np.concatenate([np.arange(0.0, 2.0, 0.01), np.arange(1.0, 3.9, 0.01)])
    played = np.array([np.interp(path_s, TIMES_S, angles) for angles in TAUGHT_DEG.T]).T
    straight = compare(TIMES_S, TAUGHT_DEG, TIMES_S[:390], TAUGHT_DEG[:390]).motors[4]
    motor = compare(TIMES_S, TAUGHT_DEG, path_s, played).motors[4]
    assert motor.played_smoothness == pytest.approx(straight.played_smoothness, abs=0.02)
    assert motor.rmse_deg == pytest.approx(0.0, abs=1e-3)


def pose_deg(motors_deg: Floats) -> Floats:
    """Any one-to-one relation is enough here."""
    return motors_deg * [2.0, 0.5, 1.0, 1.0, 1.0] - [1.0, 2.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(("lifted_deg", "number"), [(10.0, 5), (90.0, 3)])
def test_motion_is_compared_in_body_angles_and_with_table_2(lifted_deg: float, number: int) -> None:
    times_s = np.arange(0.0, 10.0, 0.01)
    taught = np.zeros((len(times_s), 5))
    taught[:, 0] = 8 * np.sin(times_s)
    taught[:, 2] = lifted_deg
    taught[:, 3] = 60 - 60 * np.cos(times_s)
    played = taught + np.array([0.5, 0, 0, -1.0, 0])
    motions = compare_motions(times_s, pose_deg(taught), times_s, pose_deg(played))

    assert [motion.motion.number for motion in motions] == [1, number]
    scapula, arm = motions
    assert scapula.taught == pytest.approx((-17.0, 15.0), abs=0.01)
    assert scapula.played == pytest.approx((-16.0, 16.0), abs=0.01)
    assert scapula.motion.range_deg == (-20.0, 20.0)
    assert scapula.peak_deg == pytest.approx(1.0)
    assert arm.played == pytest.approx((-1.0, 119.0), abs=0.01)
    assert arm.rmse_deg == pytest.approx(1.0)
    assert arm.motion.range_deg == {3: (-20.0, 130.0), 5: (-20.0, 190.0)}[number]
