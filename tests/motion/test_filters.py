"""Filters give the values of scipy.signal, which Kata does not import for them."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from kata.motion import filters


@pytest.mark.parametrize("count", [10, 51, 40_000])
def test_low_pass_is_scipys_butterworth_forwards_and_backwards(count: int) -> None:
    values = 40.0 + np.cumsum(np.random.default_rng(count).normal(size=count))
    expected = sosfiltfilt(butter(2, 10.0, fs=100.0, output="sos"), values)
    np.testing.assert_allclose(filters.low_pass(values, 10.0, 100.0), expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("share", [0.001, 0.1, 0.9])
@pytest.mark.parametrize("count", [1, 2, 40_000])
def test_recursive_filter_is_scipys(count: int, share: float) -> None:
    values = np.random.default_rng(count).normal(size=count)
    numerator, denominator = [1.0 - share, share - 1.0], [1.0, share - 1.0]
    expected = lfilter(numerator, denominator, values)
    np.testing.assert_allclose(filters.recursive(numerator, denominator, values), expected, rtol=0.0, atol=1e-9)
