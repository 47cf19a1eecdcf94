"""Identifies the lag of a station's drives behind their setpoints from measured movements.

The model, which :class:`kata.motion.method.ServoModel` compensates, is for each axis:

    u = y + a1 y' + a2 y'' + f tanh(y' / v0) + constant,

with the setpoint ``u`` and the measured angle ``y`` at the same time. It is linear in the parameters and solved by least squares. It
needs a movement without compensation, fast and slow, in both directions.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import butter, sosfiltfilt

from kata.motion.linkage import Floats

BAND_HZ: Final = 4.0
"""Above this frequency arms do not move and drives do not follow; the derivative of the encoder's steps exceeds the movement."""
FRICTION_REVERSAL_DEG_S: Final = 5.0
"""``v0``: the speed range over which friction changes its sign."""
_MIN_SPEED_DEG_S: Final = 2.0
"""An axis must reach this speed for its lag to be identified."""


@dataclass(frozen=True)
class IdentifiedLag:
    """One axis: ``lag_s`` (a1), ``lag2_s2`` (a2), ``friction_deg`` (f), and the RMS error of the model."""

    lag_s: float
    lag2_s2: float
    friction_deg: float
    residual_deg: float


def identify(times_s: ArrayLike, setpoint_deg: ArrayLike, measured_deg: ArrayLike) -> tuple[IdentifiedLag, ...]:
    """Return the lag of each axis.

    :param times_s: ``(n,)``, times of the measurement, evenly spaced to within a tenth of a step.
    :param setpoint_deg: ``(n, k)``, setpoints at these times.
    :param measured_deg: ``(n, k)``.
    :raises ValueError: when the samples are too few or uneven, or an axis did not move.
    """
    times = np.asarray(times_s, dtype=np.float64)
    setpoint, measured = np.asarray(setpoint_deg, dtype=np.float64), np.asarray(measured_deg, dtype=np.float64)
    steps = np.diff(times)
    if len(times) < 100 or setpoint.shape != measured.shape or len(setpoint) != len(times):
        raise ValueError("a hundred samples or more are needed, as many setpoints as measured angles")
    step_s = float(np.median(steps))
    if np.max(np.abs(steps - step_s)) > 0.1 * step_s:
        raise ValueError("the samples must be evenly spaced")
    low_pass = butter(4, BAND_HZ, fs=1 / step_s, output="sos")
    # The same zero-phase filter for both keeps their relation.
    setpoint, measured = sosfiltfilt(low_pass, setpoint, axis=0), sosfiltfilt(low_pass, measured, axis=0)
    speed = np.gradient(measured, step_s, axis=0)
    acceleration = np.gradient(speed, step_s, axis=0)
    # Leave out the ends, where the filter has no neighbouring samples.
    inner = slice(int(0.5 / BAND_HZ / step_s), -int(0.5 / BAND_HZ / step_s) or None)
    return tuple(
        _axis(n, setpoint[inner, n], measured[inner, n], speed[inner, n], acceleration[inner, n])
        for n in range(setpoint.shape[1])
    )


def _axis(n: int, setpoint: Floats, measured: Floats, speed: Floats, acceleration: Floats) -> IdentifiedLag:
    if np.max(np.abs(speed)) < _MIN_SPEED_DEG_S:
        raise ValueError(f"motor {n + 1} did not move")
    columns = np.column_stack([speed, acceleration, np.tanh(speed / FRICTION_REVERSAL_DEG_S), np.ones_like(speed)])
    found, *_ = np.linalg.lstsq(columns, setpoint - measured, rcond=None)
    residual = setpoint - measured - columns @ found
    return IdentifiedLag(float(found[0]), float(found[1]), float(found[2]), float(np.sqrt(np.mean(residual**2))))
