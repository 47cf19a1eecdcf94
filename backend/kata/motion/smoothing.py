"""Smoothing without a shift in time: the natural cubic smoothing spline, as a filter with a known cut-off.

Of all curves it is the one that minimises

    sum_i w_i (y_i - f(t_i))^2  +  lambda * integral f''(t)^2 dt,

solved in one banded system (Reinsch 1967, Numer. Math. 10, 177; Green and Silverman 1994, Section 2.3.3). With each
sample weighing as much as the time that it stands for, and lambda = 1 / (2 pi f_c)^4, it answers to the frequency f with

    1 / (1 + (f / f_c)^4),

which is a second-order Butterworth filter run forwards and backwards, whatever the sampling: time stamps need not be
even, and nothing has to be resampled. Its ends need no padding either: beyond them it is straight, so that a recording
that breaks off in full motion keeps its speed there.
"""

from typing import Final

import numpy as np

from kata.motion.linkage import Floats

CUTOFF_HZ: Final = 6.0
"""Cut-off of the smoothing at 100 Hz: half of the amplitude is left there.

Movement must be kept: arms are led at 1 Hz and slower, of which smoothing removes 0.1 %. Of an encoder's steps of 360 /
4096 deg (0.025 deg rms, evenly spread up to 50 Hz) it leaves 0.17 deg/s in the first derivative and 7 deg/s2 in the
second. The lag compensation turns this into 0.02 deg each (0.1 s and 0.003 s2), less than a step; with 12 Hz it would
be more than a step.
"""
CUTOFF_PER_RATE: Final = 0.4
"""The cut-off of a slower recording, as a share of its rate: at 10 Hz there are too few samples a period for 6 Hz."""
LARGEST_RMSE_DEG: Final = 0.2
"""Limits the difference between smoothed and taught motion: if it would be larger, the cut-off rises."""
_LESS: Final = 1.25
_HIGHEST_PER_RATE: Final = 10.0
"""With a cut-off this far above its rate a recording is not smoothed at all."""


def smoothed(times_s: Floats, angles_deg: Floats, cutoff_hz: float) -> Floats:
    """Return the smoothing spline at its samples; the natural cubic spline through these is the curve itself.

    :param times_s: ``(n,)``, increasing.
    :param angles_deg: ``(n, k)``; each column separately.
    :param cutoff_hz: the frequency at which half of the amplitude is left.
    """
    # Imported here: the device process imports this module and never smoothes.
    from scipy.linalg import solveh_banded

    if len(times_s) < 3:
        return angles_deg
    step = np.diff(times_s)
    stands_for = np.concatenate([step[:1], step[:-1] + step[1:], step[-1:]]) / 2
    loose = (2 * np.pi * cutoff_hz) ** -4 / stands_for
    # The columns of Q, each with three entries: the second divided difference at an inner sample.
    before, after = 1 / step[:-1], 1 / step[1:]
    inner = -(before + after)
    bands = np.zeros((3, len(inner)))
    bands[0] = (step[:-1] + step[1:]) / 3
    bands[0] += before**2 * loose[:-2] + inner**2 * loose[1:-1] + after**2 * loose[2:]
    bands[1, :-1] = step[1:-1] / 6 + inner[:-1] * before[1:] * loose[1:-2] + after[:-1] * inner[1:] * loose[2:-1]
    bands[2, :-2] = after[:-2] * before[2:] * loose[2:-2]
    slopes = np.diff(angles_deg, axis=0) / step[:, None]
    bend = solveh_banded(bands, np.diff(slopes, axis=0), lower=True)
    taken = np.zeros_like(angles_deg)
    taken[:-2] += before[:, None] * bend
    taken[1:-1] += inner[:, None] * bend
    taken[2:] += after[:, None] * bend
    left: Floats = angles_deg - loose[:, None] * taken
    return left


def smoothed_recording(times_s: Floats, angles_deg: Floats) -> Floats:
    """Return :func:`smoothed` with the cut-off that a recording's rate allows, or a higher one that keeps the taught
    motion.

    No column's RMSE against the recording exceeds :data:`LARGEST_RMSE_DEG`.
    """
    rate_hz = 1 / float(np.median(np.diff(times_s)))
    cutoff_hz = min(CUTOFF_HZ, CUTOFF_PER_RATE * rate_hz)
    while cutoff_hz < _HIGHEST_PER_RATE * rate_hz:
        smooth = smoothed(times_s, angles_deg, cutoff_hz)
        if np.max(rmse(smooth, angles_deg)) <= LARGEST_RMSE_DEG:
            return smooth
        cutoff_hz *= _LESS
    return angles_deg


def rmse(one_deg: Floats, other_deg: Floats) -> Floats:
    """Return the root mean square difference of each column, ``(k,)``."""
    difference: Floats = np.sqrt(np.mean((one_deg - other_deg) ** 2, axis=0))
    return difference
