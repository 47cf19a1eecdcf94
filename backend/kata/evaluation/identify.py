"""How far the drives of a station fall behind their setpoints, found from what they did with known ones.

The model is the one that :class:`kata.motion.method.Lag` compensates, of each axis by itself:

    u = y + a1 y' + a2 y'' + f tanh(y' / v0) + constant,

with ``u`` what was asked for and ``y`` what was measured at the same time. It is linear in what is sought, and solved
by least squares. Needed is a movement that was sent as it is, without compensation: fast and slow, to and fro.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import butter, sosfiltfilt

from kata.motion.linkage import Floats

BAND_HZ: Final = 4.0
"""Above this neither arms move nor drives follow; an encoder's steps, differentiated, are louder there than the movement."""
TURNING_DEG_S: Final = 5.0
"""``v0``: over about this speed friction turns round."""
_LEAST_SPEED_DEG_S: Final = 2.0
"""An axis that never became this fast tells nothing about its lag."""


@dataclass(frozen=True)
class Identified:
    """One axis: ``lag_s`` (a1), ``lag2_s2`` (a2), ``friction_deg`` (f), and the RMS of what they do not explain."""

    lag_s: float
    lag2_s2: float
    friction_deg: float
    unexplained_deg: float


def identify(times_s: ArrayLike, asked_deg: ArrayLike, measured_deg: ArrayLike) -> tuple[Identified, ...]:
    """The lag of each axis.

    :param times_s: ``(n,)``, when it was measured; even to within a tenth of a step.
    :param asked_deg: ``(n, k)``, where each axis should have been at that time.
    :param measured_deg: ``(n, k)``.
    :raises ValueError: when the samples are too few or uneven, or an axis did not move.
    """
    times = np.asarray(times_s, dtype=np.float64)
    asked, measured = np.asarray(asked_deg, dtype=np.float64), np.asarray(measured_deg, dtype=np.float64)
    steps = np.diff(times)
    if len(times) < 100 or asked.shape != measured.shape or len(asked) != len(times):
        raise ValueError("a hundred samples or more are needed, of what was asked and what was measured alike")
    step_s = float(np.median(steps))
    if np.max(np.abs(steps - step_s)) > 0.1 * step_s:
        raise ValueError("the samples must be evenly spaced")
    low_pass = butter(4, BAND_HZ, fs=1 / step_s, output="sos")
    # One filter for both, without a shift in time, leaves the relation between them as it is.
    asked, measured = sosfiltfilt(low_pass, asked, axis=0), sosfiltfilt(low_pass, measured, axis=0)
    speed = np.gradient(measured, step_s, axis=0)
    bend = np.gradient(speed, step_s, axis=0)
    # The filter knows nothing from beyond the ends.
    kept = slice(int(0.5 / BAND_HZ / step_s), -int(0.5 / BAND_HZ / step_s) or None)
    return tuple(
        _axis(n, asked[kept, n], measured[kept, n], speed[kept, n], bend[kept, n]) for n in range(asked.shape[1])
    )


def _axis(n: int, asked: Floats, measured: Floats, speed: Floats, bend: Floats) -> Identified:
    if np.max(np.abs(speed)) < _LEAST_SPEED_DEG_S:
        raise ValueError(f"motor {n + 1} did not move")
    columns = np.column_stack([speed, bend, np.tanh(speed / TURNING_DEG_S), np.ones_like(speed)])
    found, *_ = np.linalg.lstsq(columns, asked - measured, rcond=None)
    left = asked - measured - columns @ found
    return Identified(float(found[0]), float(found[1]), float(found[2]), float(np.sqrt(np.mean(left**2))))
