"""Spectral arc length: known values."""

import numpy as np
import pytest
from numpy.typing import NDArray

from kata.motion.smoothness import smoothness, spectral_arc_length

Floats = NDArray[np.float64]


def minimum_jerk(duration_s: float, deg: float, rate_hz: float = 100.0) -> tuple[Floats, Floats]:
    times = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    t = times / times[-1]
    return times, deg * (10 * t**3 - 15 * t**4 + 6 * t**5)


@pytest.mark.parametrize("duration_s", [0.8, 2.0, 5.0, 12.0])
@pytest.mark.parametrize("deg", [5.0, 40.0, -150.0])
def test_minimum_jerk_smoothness_is_independent_of_size_and_duration(duration_s: float, deg: float) -> None:
    # The arc goes from (0, 1) to (1, 0.05): never shorter than the straight line between them, 1.379.
    assert smoothness(*minimum_jerk(duration_s, deg)) == pytest.approx(-1.404, abs=0.005)


def test_smoothness_is_independent_of_unit_and_sampling_rate() -> None:
    times, angles = minimum_jerk(2.0, 30.0, 1000.0)
    speed = np.abs(np.gradient(angles, times))
    assert spectral_arc_length(speed, 1000.0) == pytest.approx(spectral_arc_length(speed * 0.017, 1000.0))
    assert spectral_arc_length(speed[::10], 100.0) == pytest.approx(spectral_arc_length(speed, 1000.0), abs=5e-3)


def test_the_more_submovements_the_less_smooth() -> None:
    _, once = minimum_jerk(1.0, 10.0)
    values = []
    for count in (1, 2, 3, 5):
        angles = np.concatenate([once + 10 * n for n in range(count)])
        values.append(smoothness(np.arange(len(angles)) / 100, angles))
    assert values == sorted(values, key=lambda value: -(value or 0.0))
    assert np.all(np.diff(np.array(values, dtype=np.float64)) < -0.3)


def test_the_more_tremor_the_less_smooth() -> None:
    times, angles = minimum_jerk(4.0, 60.0)
    values = [smoothness(times, angles + deg * np.sin(2 * np.pi * 6 * times)) for deg in (0.0, 0.1, 0.2, 0.5)]
    assert np.all(np.diff(np.array(values, dtype=np.float64)) < -0.1)


def test_an_encoders_counts_are_not_tremor() -> None:
    times, angles = minimum_jerk(4.0, 60.0)
    count_deg = 360 / 4096
    counted = smoothness(times, np.round(angles / count_deg) * count_deg)
    assert counted == pytest.approx(smoothness(times, angles), abs=0.01)


def test_resting_or_short_motion_has_no_smoothness() -> None:
    assert smoothness([0.0, 1.0, 2.0], [5.0, 5.0, 5.0]) is None
    assert smoothness([0.0, 0.2, 0.4], [0.0, 5.0, 9.0]) is None
    with pytest.raises(ValueError, match="needs a movement"):
        spectral_arc_length(np.zeros(100), 100.0)
