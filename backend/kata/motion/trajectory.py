"""A recording as something that can be asked for any time, checked before it may move an arm."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from kata.motion.axes import N_AXES
from kata.motion.linkage import Floats

_SPEED_WINDOW_S: Final = 0.1
"""Speed is judged over this long: between neighbouring samples an encoder's single count is already 9 deg/s."""
_LONGEST_GAP_S: Final = 1.0
_BEND_S: Final = 0.01
"""Acceleration is judged between setpoints so far apart: those of 100 Hz."""


class TrajectoryError(ValueError):
    """The recording must not be played; the message names the motor and the time."""


class AxisLimits(NamedTuple):
    """What one motor may be asked for."""

    min_deg: float
    max_deg: float
    max_speed_deg_s: float
    max_acceleration_deg_s2: float = float("inf")


class Trajectory:
    """A recording's motor angles as a smooth function of time.

    Between samples it is the monotone cubic of Fritsch and Carlson (PCHIP): smooth in speed, and never outside the
    range of the two neighbouring samples, so that a limit which holds at the samples holds everywhere.
    """

    def __init__(self, times_s: ArrayLike, angles_deg: ArrayLike) -> None:
        """:param times_s: shape ``(n,)``, increasing; begins anywhere, is counted from 0.

        :param angles_deg: shape ``(n, 5)``.
        :raises TrajectoryError: when shapes disagree, numbers are not finite, time does not increase or has a gap.
        """
        times = np.asarray(times_s, dtype=np.float64)
        angles = np.asarray(angles_deg, dtype=np.float64)
        if times.ndim != 1 or len(times) < 2 or angles.shape != (len(times), N_AXES):
            raise TrajectoryError("a recording needs at least two samples of five angles each")
        if not (np.all(np.isfinite(times)) and np.all(np.isfinite(angles))):
            raise TrajectoryError("the recording holds values that are not numbers")
        steps = np.diff(times)
        if np.any(steps <= 0):
            raise TrajectoryError("the recording's time does not increase")
        if np.any(steps > _LONGEST_GAP_S):
            at = times[int(np.argmax(steps))] - times[0]
            raise TrajectoryError(f"samples are missing for {np.max(steps):.1f} s after {at:.1f} s")
        self.times_s: Floats = times - times[0]
        self.angles_deg: Floats = angles
        self._curve = PchipInterpolator(self.times_s, angles)

    @property
    def duration_s(self) -> float:
        """Time of the last sample."""
        return float(self.times_s[-1])

    def at(self, time_s: float) -> Floats:
        """Angles ``(5,)`` in degrees at ``time_s``; before the start and after the end it stands still."""
        angles: Floats = self._curve(min(max(time_s, 0.0), self.duration_s))
        return angles

    def check(self, limits: Sequence[AxisLimits], tolerance_deg: float) -> None:
        """Refuse a recording that leaves an axis' range by more than the tolerance, or is faster or more abrupt than the axis may go.

        Nothing is clipped: a clipped motion is not the one that was taught.

        :raises TrajectoryError: naming motor, time, value and limit of the worst violation of the first such motor.
        """
        window = np.arange(0.0, self.duration_s + _SPEED_WINDOW_S, _SPEED_WINDOW_S)
        speeds = np.abs(np.diff(self._curve(np.minimum(window, self.duration_s)), axis=0)) / _SPEED_WINDOW_S
        # Wherever between two of them the setpoints come to lie.
        grid = self._curve(np.arange(0.0, self.duration_s, _BEND_S / 2))
        bends = np.abs(grid[4:] - 2 * grid[2:-2] + grid[:-4]) / _BEND_S**2
        for axis, limit in enumerate(limits):
            angles = self.angles_deg[:, axis]
            beyond = np.maximum(limit.min_deg - angles, angles - limit.max_deg)
            worst = int(np.argmax(beyond))
            if beyond[worst] > tolerance_deg:
                raise TrajectoryError(
                    f"motor {axis + 1} would go to {angles[worst]:.1f} deg at {self.times_s[worst]:.1f} s; "
                    f"its range is {limit.min_deg:g} to {limit.max_deg:g} deg"
                )
            fastest = int(np.argmax(speeds[:, axis]))
            if speeds[fastest, axis] > limit.max_speed_deg_s:
                raise TrajectoryError(
                    f"motor {axis + 1} would move at {speeds[fastest, axis]:.0f} deg/s at {window[fastest]:.1f} s; "
                    f"{limit.max_speed_deg_s:g} deg/s is its limit"
                )
            sharpest = int(np.argmax(bends[:, axis])) if len(bends) else 0
            if len(bends) and bends[sharpest, axis] > limit.max_acceleration_deg_s2:
                raise TrajectoryError(f"motor {axis + 1} would jerk at {(sharpest + 2) * _BEND_S / 2:.1f} s")
