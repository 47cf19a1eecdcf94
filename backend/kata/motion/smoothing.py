"""Smooths without a shift in time: the natural cubic smoothing spline, used as a filter with a known cut-off.

Of all curves the spline minimises

    sum_i w_i (y_i - f(t_i))^2  +  lambda * integral f''(t)^2 dt,

It is the solution of one banded system (Reinsch 1967, Numer. Math. 10, 177; Green and Silverman 1994, Section 2.3.3). If each
sample's weight is the time that it represents, and lambda = 1 / (2 pi f_c)^4, the response at the frequency f is

    1 / (1 + (f / f_c)^4),

which is that of a second-order Butterworth filter run forwards and backwards. It does not depend on the sampling: time stamps
need not be even, and no resampling is necessary. The ends need no padding, because the spline is straight beyond them. A
recording that ends in full motion therefore keeps its speed there.
"""

from typing import Final

import numpy as np

from kata.motion.linkage import Floats

CUTOFF_HZ: Final = 6.0
"""Cut-off of the smoothing at 100 Hz: half of the amplitude remains at this frequency.

Movement must be kept: arms are led at 1 Hz and slower, where smoothing removes 0.1 %. The steps of an encoder, 360 / 4096
deg (0.025 deg RMS, evenly spread up to 50 Hz), leave 0.17 deg/s in the first derivative and 7 deg/s2 in the second. The lag
compensation turns each of these into 0.02 deg (with 0.1 s and 0.003 s2), less than a step. With a cut-off of 12 Hz it would
be more than a step.
"""
CUTOFF_PER_RATE: Final = 0.4
"""Cut-off of a slower recording as a share of its rate, because a rate of 10 Hz has too few samples for a cut-off of 6 Hz."""
LARGEST_RMSE_DEG: Final = 0.2
"""Largest RMSE between smoothed and taught motion. If it would be larger, the cut-off is raised."""
_LESS: Final = 1.25
_HIGHEST_PER_RATE: Final = 10.0
"""If the cut-off would exceed this multiple of its rate, a recording is not smoothed."""


def smoothed(times_s: Floats, angles_deg: Floats, cutoff_hz: float) -> Floats:
    """Return the smoothing spline's values at the samples. The natural cubic spline through these values is the whole curve.

    :param times_s: ``(n,)``, increasing.
    :param angles_deg: ``(n, k)``; each column is smoothed separately.
    :param cutoff_hz: the frequency at which half of the amplitude remains.
    """
    # Import here, because the device process imports this module and never smooths.
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


def natural_spline(times_s: Floats, angles_deg: Floats) -> Floats:
    """Return the coefficients of the natural cubic spline through the samples: ``(4, n - 1, k)``, the cubic first.

    They are those of ``scipy.interpolate.CubicSpline``, whose import takes twice the time of ``scipy.linalg``.

    :param times_s: ``(n,)``, increasing, at least two.
    :param angles_deg: ``(n, k)``.
    """
    # Import here, because the device process imports this module and only evaluates splines.
    from scipy.linalg import solve_banded

    step = np.diff(times_s)
    column = step[:, None]
    slopes = np.diff(angles_deg, axis=0) / column
    # Each row is the continuity of the second derivative at one sample; at both ends it is 0. The unknowns are the first derivatives.
    bands = np.zeros((3, len(times_s)))
    bands[0, 1], bands[1, 0] = step[0], 2 * step[0]
    bands[0, 2:], bands[1, 1:-1], bands[2, :-2] = step[:-1], 2 * (step[:-1] + step[1:]), step[1:]
    bands[1, -1], bands[2, -2] = 2 * step[-1], step[-1]
    known = np.empty_like(angles_deg)
    known[0], known[-1] = 3 * (angles_deg[1] - angles_deg[0]), 3 * (angles_deg[-1] - angles_deg[-2])
    known[1:-1] = 3 * (column[1:] * slopes[:-1] + column[:-1] * slopes[1:])
    speeds = solve_banded((1, 1), bands, known)
    bend = (speeds[:-1] + speeds[1:] - 2 * slopes) / column
    return np.stack([bend / column, (slopes - speeds[:-1]) / column - bend, speeds[:-1], angles_deg[:-1]])


def natural_derivatives(times_s: Floats, angles_deg: Floats) -> tuple[Floats, Floats]:
    """Return the first and second derivative of :func:`natural_spline` at the samples, each ``(n, k)``."""
    cubic, square, speed, _ = natural_spline(times_s, angles_deg)
    step = times_s[-1] - times_s[-2]
    last = speed[-1] + step * (2 * square[-1] + 3 * step * cubic[-1])
    return np.vstack([speed, last]), np.vstack([2 * square, np.zeros_like(last)])


def smoothed_recording(times_s: Floats, angles_deg: Floats) -> Floats:
    """Return :func:`smoothed` with the cut-off for the recording's rate, or with a higher one if the taught motion requires
    it.

    The RMSE of no column against the recording exceeds :data:`LARGEST_RMSE_DEG`.
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
