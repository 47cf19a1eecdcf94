"""The interpolation and the search for a minimum equal those of scipy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize_scalar

from kata.motion.interpolation import MonotoneCubic, lowest_at

_STEPS_S = st.floats(1e-3, 10.0)
# scipy divides by the slopes, and those of the smallest numbers overflow.
_ANGLES_DEG = st.one_of(st.floats(-180.0, 180.0).map(lambda angle: round(angle, 9)), st.sampled_from([0.0, 1.0, 90.0]))


@given(st.data(), st.lists(_STEPS_S, min_size=1, max_size=12), st.sampled_from([(), (5,)]))
def test_interpolation_equals_that_of_scipy(
    data: st.DataObject, steps_s: list[float], columns: tuple[int, ...]
) -> None:
    times_s = np.cumsum([0.0, *steps_s])
    angles_deg = data.draw(arrays(np.float64, (len(times_s), *columns), elements=_ANGLES_DEG))
    shares = data.draw(arrays(np.float64, 20, elements=st.floats(0.0, 1.0)))
    places_s = np.concatenate([times_s, shares * times_s[-1]])
    expected_deg = PchipInterpolator(times_s, angles_deg)(places_s)
    assert MonotoneCubic(times_s, angles_deg)(places_s) == pytest.approx(expected_deg, abs=1e-9, rel=0)


@given(st.lists(_STEPS_S, min_size=1, max_size=12), st.data())
def test_no_place_leaves_the_range_of_its_neighbours(steps_s: list[float], data: st.DataObject) -> None:
    times_s = np.cumsum([0.0, *steps_s])
    angles_deg = data.draw(arrays(np.float64, len(times_s), elements=_ANGLES_DEG))
    places_s = np.sort(np.concatenate([times_s[:-1] + share * np.diff(times_s) for share in np.linspace(0.0, 1.0, 11)]))
    row = np.clip(np.searchsorted(times_s, places_s, side="right") - 1, 0, len(times_s) - 2)
    between_deg = MonotoneCubic(times_s, angles_deg)(places_s)
    assert np.all(between_deg >= np.minimum(angles_deg[row], angles_deg[row + 1]) - 1e-9)
    assert np.all(between_deg <= np.maximum(angles_deg[row], angles_deg[row + 1]) + 1e-9)


@given(st.floats(-0.02, 0.02), st.floats(0.1, 100.0))
def test_lowest_place_equals_that_of_scipy(lowest: float, height: float) -> None:
    def curve(place: float) -> float:
        return height * (1.0 - math.cos(30.0 * (place - lowest))) + 1.0

    expected = minimize_scalar(curve, bounds=(-0.02, 0.02), method="bounded", options={"xatol": 1e-5}).x
    assert lowest_at(curve, -0.02, 0.02, 1e-5) == pytest.approx(expected, abs=3e-5)
