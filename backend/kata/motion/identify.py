"""Generates and filters the movement that identifies a station's drives. :mod:`kata.motion.identify_load` has the model."""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.linkage import Floats

BAND_HZ: Final = 4.0
"""Cut-off frequency. Above it arms do not move, drives do not follow, and the derivative of the encoder's steps exceeds the movement."""
_MIN_SPEED_DEG_S: Final = 2.0
"""An axis must reach this speed to be identified."""
_MIDDLE_DEG: Final = (15.0, 109.0, 60.0, 60.0, -25.0)
_REACH_DEG: Final = (18.0, 12.0, 40.0, 60.0, 35.0)
_WAVES_HZ: Final = (0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 1.8)
_FASTEST_DEG_S: Final = 50.0
_RISE_S: Final = 4.0
_RAISING: Final = (3, 4)
"""Motors that raise the arm."""


def excitation(
    rest_deg: Sequence[float],
    seconds: float,
    step_s: float,
    ranges_deg: Sequence[tuple[float, float]] | None = None,
    share: float = 1.0,
    slope: int = 1,
) -> Floats:
    """Return a movement of all axes, slow and fast, that begins and ends at rest: ``(n, 5)`` in degrees.

    :param rest_deg: ``(5,)``, angles at which the movement begins and ends.
    :param ranges_deg: lowest and highest angle of each axis; None: no other limit than the designed movement.
    :param share: factor for the way and the range in which motors 3 and 4 raise the arm.
    :param slope: 1: waves of all frequencies have the same speed, to identify drives; 2: they have the same acceleration, so that the
        drives can carry a heavy arm through more of its range.
    """
    times = np.arange(0.0, seconds, step_s)
    rise = np.minimum(1.0, np.minimum(times, times[-1] - times) / _RISE_S)
    rise = 3 * rise**2 - 2 * rise**3
    columns = []
    for n, (rest, middle, reach) in enumerate(zip(rest_deg, _MIDDLE_DEG, _REACH_DEG, strict=True), start=1):
        if ranges_deg is not None:
            low, high = ranges_deg[n - 1]
            middle = min(max(middle, low), high)
            reach = min(reach, middle - low, high - middle)
        raised = share if n in _RAISING else 1.0
        waves = sum(np.sin(math.tau * hz * times + n * k**2) / hz**slope for k, hz in enumerate(_WAVES_HZ, start=1))
        fastest = np.abs(np.gradient(waves, times)).max()
        waves = waves * min(raised * reach / np.abs(waves).max(), _FASTEST_DEG_S / fastest)
        columns.append(rest + rise * (raised * (middle - rest) + waves))
    return np.column_stack(columns)


class FilteredMovement(NamedTuple):
    """A measured movement without frequencies above those of an arm. Samples are ``step_s`` apart; each series is ``(n, k)``."""

    step_s: float
    series: list[Floats]
    speed_deg_s: Floats
    acceleration_deg_s2: Floats


def filtered(times_s: ArrayLike, *series: ArrayLike) -> FilteredMovement:
    """Filter several series, ``(n, k)`` each. Differentiate the second series, which must be the measured angles.

    :raises ValueError: when the samples are too few or uneven, or an axis did not move.
    """
    times = np.asarray(times_s, dtype=np.float64)
    arrays = [np.asarray(values, dtype=np.float64) for values in series]
    if len(times) < 100 or any(values.shape != arrays[0].shape or len(values) != len(times) for values in arrays):
        raise ValueError("a hundred samples or more are needed, as many setpoints as measured angles")
    steps = np.diff(times)
    step_s = float(np.median(steps))
    if np.max(np.abs(steps - step_s)) > 0.1 * step_s:
        raise ValueError("the samples must be evenly spaced")
    # Import here, because only commissioning filters. Otherwise every service would start 0.7 s later.
    from scipy.signal import butter, sosfiltfilt

    low_pass = butter(4, BAND_HZ, fs=1 / step_s, output="sos")
    # Using the same zero-phase filter for all series preserves the relations between them.
    smooth = [sosfiltfilt(low_pass, values, axis=0) for values in arrays]
    speed = np.gradient(smooth[1], step_s, axis=0)
    acceleration = np.gradient(speed, step_s, axis=0)
    # Omit the ends, where the filter has too few neighbouring samples.
    inner = slice(int(0.5 / BAND_HZ / step_s), -int(0.5 / BAND_HZ / step_s) or None)
    for n, fastest in enumerate(np.max(np.abs(speed[inner]), axis=0), start=1):
        if fastest < _MIN_SPEED_DEG_S:
            raise ValueError(f"motor {n} did not move")
    return FilteredMovement(step_s, [values[inner] for values in smooth], speed[inner], acceleration[inner])
