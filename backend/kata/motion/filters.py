"""Recursive filters without scipy.signal, which imports scipy.stats: 20 MB of memory and half a second of processor time."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from kata.motion.linkage import Floats

_PADDING: Final = 9
"""Number of samples by which a signal is continued at both ends: three times the number of coefficients of the second-order filter."""


def recursive(numerator: Sequence[float], denominator: Sequence[float], values: Floats) -> Floats:
    """Return the output ``(n,)`` of a recursive filter that is at rest before the first of the values ``(n,)``.

    The output solves a linear system with a lower banded matrix, in which each row is the filter's equation at one sample.
    """
    # Import here, because the device process imports this module and never filters.
    from scipy.linalg import solve_banded

    bands = np.tile(np.asarray(denominator, dtype=np.float64)[:, None], len(values))
    driven = np.convolve(values, numerator)[: len(values)]
    output: Floats = solve_banded((len(denominator) - 1, 0), bands, driven)
    return output


def low_pass(values: Floats, cutoff_hz: float, rate_hz: float) -> Floats:
    """Return the values ``(n,)`` after a second-order Butterworth low-pass filter, forwards and backwards, which shifts nothing in time.

    Before each way the filter is at rest at its first value. Both ends are continued by their point reflection.

    :param values: more than nine.
    """
    warped = math.tan(math.pi * cutoff_hz / rate_hz)
    scale = 1.0 / (1.0 + math.sqrt(2.0) * warped + warped**2)
    numerator = [warped**2 * scale, 2.0 * warped**2 * scale, warped**2 * scale]
    denominator = [1.0, 2.0 * (warped**2 - 1.0) * scale, (1.0 - math.sqrt(2.0) * warped + warped**2) * scale]
    before = 2.0 * values[0] - values[_PADDING:0:-1]
    after = 2.0 * values[-1] - values[-2 : -_PADDING - 2 : -1]
    signal = np.concatenate([before, values, after])
    for _ in range(2):
        signal = (signal[0] + recursive(numerator, denominator, signal - signal[0]))[::-1]
    return signal[_PADDING:-_PADDING]
