"""Interpolates samples without overshoot, and finds the lowest place of a curve.

``PchipInterpolator`` and ``minimize_scalar`` of scipy return the same (tests/motion/test_interpolation.py). They are not used, because the
import of ``scipy.interpolate`` and ``scipy.optimize`` takes 17 MB of memory in each process that interpolates.
"""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from kata.motion.linkage import Floats

_STEEPEST_END: Final = 3.0
"""Largest slope at an end, in multiples of the first difference quotient, where the quotients change their sign (Fritsch and Carlson)."""
_GOLDEN: Final = (math.sqrt(5.0) - 1.0) / 2.0
"""Share of an interval that remains after a step of the golden-section search."""


class MonotoneCubic:
    """A piecewise cubic through samples with a continuous first derivative. Between two samples it never leaves their range.

    The slopes are those of Fritsch and Butland (1984), SIAM J Sci Stat Comput 5, 300-304.
    """

    def __init__(self, times_s: Floats, values: Floats) -> None:
        """Prepare the curve. ``times_s``: ``(n,)``, increasing, at least two. ``values``: ``(n,)`` or ``(n, k)``."""
        self._times_s = times_s
        self._values = values
        self._slopes = _slopes(times_s, values)

    def __call__(self, places_s: Floats) -> Floats:
        """Return the values ``(m,)`` or ``(m, k)`` at places ``(m,)``. Beyond an end the outermost cubic continues."""
        row = np.clip(np.searchsorted(self._times_s, places_s, side="right") - 1, 0, len(self._times_s) - 2)
        step = _column(self._times_s[row + 1] - self._times_s[row], self._values)
        share = _column(places_s - self._times_s[row], self._values) / step
        start, end = self._values[row], self._values[row + 1]
        leaving, arriving = self._slopes[row] * step, self._slopes[row + 1] * step
        bend = leaving + arriving - 2 * (end - start)
        values: Floats = start + share * (leaving + share * (end - start - leaving - bend + share * bend))
        return values


def _column(times: Floats, values: Floats) -> Floats:
    return times if values.ndim == 1 else times[:, None]


def _slopes(times_s: Floats, values: Floats) -> Floats:
    """Return the derivative at each sample: 0 at an extremum, else the weighted harmonic mean of the two difference quotients."""
    step = _column(np.diff(times_s), values)
    quotient = np.diff(values, axis=0) / step
    if len(quotient) == 1:
        return np.concatenate([quotient, quotient])
    before, after = quotient[:-1], quotient[1:]
    weight_before, weight_after = step[:-1] + 2 * step[1:], 2 * step[:-1] + step[1:]
    same_way = np.sign(before) * np.sign(after) > 0
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        mean = (weight_before + weight_after) / (weight_before / before + weight_after / after)
    slopes = np.empty(values.shape)
    slopes[1:-1] = np.where(same_way, mean, 0.0)
    slopes[0] = _end_slope(step[0], step[1], quotient[0], quotient[1])
    slopes[-1] = _end_slope(step[-1], step[-2], quotient[-1], quotient[-2])
    return slopes


def _end_slope(step: Floats, next_step: Floats, quotient: Floats, next_quotient: Floats) -> Floats:
    """Return the derivative at an end from the two outermost intervals, limited so that the curve stays between the samples."""
    slope = ((2 * step + next_step) * quotient - step * next_quotient) / (step + next_step)
    turning = np.sign(quotient) != np.sign(next_quotient)
    steep = np.abs(slope) > _STEEPEST_END * np.abs(quotient)
    limited: Floats = np.where(turning & steep, _STEEPEST_END * quotient, slope)
    return np.where(np.sign(slope) == np.sign(quotient), limited, 0.0)


def lowest_at(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Return the place between ``low`` and ``high`` where a function with one minimum is lowest, by golden-section search (Kiefer 1953)."""
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    while high - low > tolerance:
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - _GOLDEN * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + _GOLDEN * (high - low)
            at_right = function(right)
    return (low + high) / 2
