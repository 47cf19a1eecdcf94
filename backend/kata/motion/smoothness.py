"""Calculates the smoothness of a movement: the spectral arc length of its speed (SPARC).

Sources: Balasubramanian, Melendez-Calderon, Burdet, "A robust and sensitive metric for quantifying movement smoothness", IEEE
Trans. Biomed. Eng. 59 (2012) 2126; adaptive cut-off of Balasubramanian et al., "On the analysis of movement smoothness", J.
NeuroEng. Rehabil. 12:112 (2015), Eqs. (4)-(6):

    SPARC = - integral from 0 to wc of sqrt( (1/wc)^2 + (dV/dw)^2 ) dw,    V(w) = |spectrum of the speed| / its largest
    wc    = the highest frequency up to 10 Hz at which V(w) is still 0.05 or more

SPARC has no unit and does not depend on the size or duration of a movement. One minimum-jerk movement has about -1.5. Submovements,
stops and tremor make it more negative.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.filters import low_pass
from kata.motion.interpolation import MonotoneCubic

HIGHEST_HZ: Final = 10.0
"""Higher frequencies do not belong to the movement. The paper of 2015 uses 10 or 20 Hz. An arm that is moved by a hand or by
motors stays below 10 Hz.
"""
LEAST_SHARE: Final = 0.05
"""Amplitudes below this share of the largest are ignored, so that noise does not lengthen the arc."""
_PADDING: Final = 4
"""Zeros make the signal 2^4 times as long, so that the arc is fine enough for signals of any length."""
_RATE_HZ: Final = 100.0
_SHORTEST_S: Final = 0.5


def spectral_arc_length(speed: ArrayLike, rate_hz: float) -> float:
    """Return the SPARC of a speed profile ``(n,)`` in any unit, sampled at ``rate_hz``. No value may be negative.

    :raises ValueError: when no value is above 0.
    """
    profile = np.asarray(speed, dtype=np.float64)
    if not np.any(profile > 0):
        raise ValueError("smoothness needs a movement")
    length = 2 ** (math.ceil(math.log2(len(profile))) + _PADDING)
    spectrum = np.abs(np.fft.rfft(profile, length))
    spectrum = spectrum[: int(HIGHEST_HZ / rate_hz * length) + 1] / spectrum.max()
    cut = int(np.flatnonzero(spectrum >= LEAST_SHARE)[-1])
    return -float(np.sum(np.hypot(1.0 / max(cut, 1), np.diff(spectrum[: cut + 1]))))


def smoothness(times_s: ArrayLike, angles_deg: ArrayLike) -> float | None:
    """Return the SPARC of one axis' movement. The speed is computed from the angles.

    Differentiated encoder counts are tens of deg/s. Therefore a low-pass filter without delay first removes
    frequencies above 10 Hz (Butterworth, second order, forwards and backwards), which SPARC ignores anyway.

    :param times_s: ``(n,)``, increasing.
    :param angles_deg: ``(n,)``, angles of the axis.
    :returns: None if the movement is shorter than half a second or has no speed.
    """
    times = np.asarray(times_s, dtype=np.float64)
    if len(times) < 2 or times[-1] - times[0] < _SHORTEST_S:
        return None
    grid = np.arange(times[0], times[-1], 1 / _RATE_HZ)
    angles = MonotoneCubic(times, np.asarray(angles_deg, dtype=np.float64))(grid)
    speed = np.abs(np.gradient(low_pass(angles, HIGHEST_HZ, _RATE_HZ))) * _RATE_HZ
    return spectral_arc_length(speed, _RATE_HZ) if np.any(speed > 0) else None
