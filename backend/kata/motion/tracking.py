"""Playback against teaching: the paper's error (Section 4), for every motor.

The error is playback minus teaching at the same place on the path. The path's own clock is compared, not wall time,
so that a pause in a playback is not an error.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from kata.motion.linkage import Floats


@dataclass(frozen=True)
class MotorTracking:
    """One motor's errors in degrees, playback minus teaching; ``peak_deg`` keeps its sign."""

    motor: int
    peak_deg: float
    peak_at_s: float
    rmse_deg: float
    start_deg: float


@dataclass(frozen=True)
class Comparison:
    """Teaching and playback laid over each other: ``times_s`` is ``(m,)``, the angles are ``(m, 5)`` in degrees."""

    times_s: Floats
    taught_deg: Floats
    played_deg: Floats
    motors: tuple[MotorTracking, ...]

    @property
    def error_deg(self) -> Floats:
        """Playback minus teaching, ``(m, 5)``."""
        return self.played_deg - self.taught_deg

    @property
    def samples(self) -> int:
        """How many samples of the playback were compared."""
        return len(self.times_s)


def compare(
    taught_times_s: ArrayLike, taught_deg: ArrayLike, played_path_s: ArrayLike, played_deg: ArrayLike
) -> Comparison:
    """Lay a playback over its teaching.

    :param taught_times_s: ``(n,)`` times of the recording, increasing; counted from its first sample.
    :param taught_deg: ``(n, 5)`` motor angles taught.
    :param played_path_s: ``(m,)`` places on the recording's clock at which the playback was measured.
    :param played_deg: ``(m, 5)`` motor angles measured there.
    :raises ValueError: when there is nothing to compare.
    """
    taught_times = np.asarray(taught_times_s, dtype=np.float64)
    path = np.asarray(played_path_s, dtype=np.float64)
    played = np.asarray(played_deg, dtype=np.float64)
    if len(path) == 0:
        raise ValueError("the playback holds no samples")
    taught_times = taught_times - taught_times[0]
    taught: Floats = PchipInterpolator(taught_times, np.asarray(taught_deg, dtype=np.float64))(
        np.clip(path, 0.0, taught_times[-1])
    )
    error = played - taught
    peaks = np.argmax(np.abs(error), axis=0)
    motors = tuple(
        MotorTracking(
            motor=axis + 1,
            peak_deg=float(error[peak, axis]),
            peak_at_s=float(path[peak]),
            rmse_deg=float(np.sqrt(np.mean(error[:, axis] ** 2))),
            start_deg=float(error[0, axis]),
        )
        for axis, peak in enumerate(peaks)
    )
    return Comparison(path, taught, played, motors)
