"""Playback laid over teaching."""

import numpy as np
import pytest

from kata.motion.tracking import compare

TIMES_S = np.arange(0, 4.0, 0.01)
TAUGHT_DEG = np.column_stack([amplitude * np.sin(TIMES_S) for amplitude in (1, 5, 10, 20, 40)])


def test_a_playback_that_lags_has_the_error_of_its_lag() -> None:
    lag_s = 0.05
    path_s = np.arange(0.0, 3.9, 0.013)
    played = np.column_stack([a * np.sin(np.maximum(path_s - lag_s, 0)) for a in (1, 5, 10, 20, 40)])
    comparison = compare(TIMES_S + 100.0, TAUGHT_DEG, path_s, played)

    assert comparison.samples == len(path_s)
    for motor, amplitude in zip(comparison.motors, (1, 5, 10, 20, 40), strict=True):
        # The sine is fastest, and its error largest, at its zero crossings: -a cos(t) * lag.
        assert abs(motor.peak_deg) == pytest.approx(amplitude * lag_s, rel=0.01)
        assert motor.start_deg == 0.0
        error = amplitude * (np.sin(np.maximum(path_s - lag_s, 0)) - np.sin(path_s))
        assert motor.rmse_deg == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-3)


def test_peak_keeps_its_sign_and_place_and_the_start_is_the_first_sample() -> None:
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
