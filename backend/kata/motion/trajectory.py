"""Represents a recording as a function of time, and checks it before it may move an arm."""

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from kata.motion import texts
from kata.motion.axes import N_AXES
from kata.motion.interpolation import MonotoneCubic
from kata.motion.linkage import Floats
from kata.motion.path import PathPoint
from kata.motion.shoulder import rest_posture_deg
from kata.motion.smoothing import natural_spline, rmse, smoothed_recording

HOLD_S: Final = 0.1
"""Time for which the paper's method holds a sample: 10 Hz (Section 4)."""
RUN_UP_DEG: Final = 2.0
"""Every motor moves this far in one direction before it reaches the start (:mod:`kata.motion.approach`). This is enough to
take up friction and play of the loosest motor.
"""
_SPEED_WINDOW_S: Final = 0.1
"""Speed is averaged over this time, because one encoder count between neighbouring samples already corresponds to 9 deg/s."""
_LONGEST_GAP_S: Final = 1.0
_SHORTEST_STEP_S: Final = 1e-4
"""Shortest time between two samples. No bus is polled faster. At a shorter time one encoder count would be a speed of more than
880 deg/s, which smoothing would have to remove.
"""
_SECOND_DIFFERENCE_STEP_S: Final = 0.01
"""Acceleration is checked from setpoints at this distance, which is that of 100 Hz."""
_ROUNDING: Final = 1e-6
_LARGEST_DEG: Final = 3600.0
"""Largest accepted angle: ten turns. No axis reaches it, and calculations with smaller angles cannot overflow."""


class TrajectoryError(ValueError):
    """The recording must not be played. The message names the motor and the time. ``motor`` and ``at_s`` are the same, or None if
    the message has none.
    """

    def __init__(self, message: str, motor: int | None = None, at_s: float | None = None) -> None:
        super().__init__(message)
        self.motor = motor
        self.at_s = at_s


class OverloadError(TrajectoryError):
    """A motor cannot carry the motion; the message names motor, time and torque."""


class AxisLimits(NamedTuple):
    """The limits of one motor."""

    min_deg: float
    max_deg: float
    max_speed_deg_s: float
    max_acceleration_deg_s2: float = float("inf")


class Trajectory:
    """A recording's motor angles as a smooth function of time: the ``smooth`` reference.

    It is the spline of :mod:`kata.motion.smoothing`, continuous up to its second derivative. It approximates the
    recorded samples; :attr:`rmse_deg` is the difference. The spline also bridges gaps between samples.
    """

    def __init__(self, times_s: ArrayLike, angles_deg: ArrayLike) -> None:
        """Smooth and interpolate the recording.

        :param times_s: shape ``(n,)``, increasing. They may begin at any time and are shifted to begin at 0.
        :param angles_deg: shape ``(n, 5)``.
        :raises TrajectoryError: when shapes differ, numbers are not finite, or time does not increase or has a gap.
        """
        times, angles = _checked(times_s, angles_deg)
        smooth = smoothed_recording(times, angles)
        self.rmse_deg: Floats = rmse(smooth, angles)
        """``(5,)``: RMSE of the reference against the recording."""
        self._times_s = times
        self._coefficients: Floats = natural_spline(times, smooth)
        self._set_range(smooth)

    def parts(self) -> dict[str, Floats]:
        """Return every array of the trajectory, by name."""
        return dict(vars(self))

    @classmethod
    def from_parts(cls, parts: Mapping[str, Floats]) -> Self:
        """Make a trajectory from the :meth:`parts` of another one, without computing or checking."""
        trajectory = cls.__new__(cls)
        vars(trajectory).update(parts)
        return trajectory

    @property
    def duration_s(self) -> float:
        """Time of the last sample."""
        return float(self._times_s[-1])

    @property
    def start_deg(self) -> Floats:
        """Angles ``(5,)`` at the start."""
        return self.at(0.0)

    def at(self, time_s: float) -> Floats:
        """Return the angles ``(5,)`` in degrees at ``time_s``; they are constant before the start and after the end."""
        d, (c3, c2, c1, c0) = self._piece(time_s)
        angles: Floats = ((c3 * d + c2) * d + c1) * d + c0
        return angles

    def motion_at(self, time_s: float) -> PathPoint:
        """Return angles, speed and acceleration at a time. A time before the start or after the end is replaced by the start or end."""
        d, (c3, c2, c1, c0) = self._piece(time_s)
        return PathPoint(((c3 * d + c2) * d + c1) * d + c0, (3 * c3 * d + 2 * c2) * d + c1, 6 * c3 * d + 2 * c2)

    def _piece(self, time_s: float) -> tuple[float, Floats]:
        """Return the time since the sample before ``time_s``, and the cubic from there: ``(4, 5)``, the highest power first."""
        time_s = min(max(time_s, 0.0), self.duration_s)
        interval = min(int(np.searchsorted(self._times_s, time_s, side="right")), len(self._times_s) - 1) - 1
        return time_s - self._times_s[interval], self._coefficients[:, interval]

    def along(self, times_s: Floats) -> Floats:
        """Return the angles ``(m, 5)`` at the times ``(m,)``, as :meth:`at`."""
        times_s = np.clip(times_s, 0.0, self.duration_s)
        intervals = np.minimum(np.searchsorted(self._times_s, times_s, side="right"), len(self._times_s) - 1) - 1
        d = (times_s - self._times_s[intervals])[:, None]
        angles: Floats = self._coefficients[0, intervals]
        for coefficients in self._coefficients[1:]:
            angles *= d
            angles += coefficients[intervals]
        return angles

    def motions(self, times_s: Floats) -> PathPoint:
        """Return angles, speeds and accelerations at the times ``(m,)``, each ``(m, 5)``, as :meth:`motion_at`."""
        times_s = np.clip(times_s, 0.0, self.duration_s)
        intervals = np.minimum(np.searchsorted(self._times_s, times_s, side="right"), len(self._times_s) - 1) - 1
        d = (times_s - self._times_s[intervals])[:, None]
        c3, c2, c1, c0 = self._coefficients[:, intervals]
        return PathPoint(((c3 * d + c2) * d + c1) * d + c0, (3 * c3 * d + 2 * c2) * d + c1, 6 * c3 * d + 2 * c2)

    def speeds(self) -> tuple[Floats, Floats]:
        """Return times ``(m,)`` and each motor's mean speed over the 0.1 s after them, ``(m, 5)`` in deg/s without
        sign.
        """
        times = self._windows()
        return times, np.abs(self.along(times + _SPEED_WINDOW_S) - self.along(times)) / _SPEED_WINDOW_S

    def check(self, limits: Sequence[AxisLimits], tolerance_deg: float) -> None:
        """Refuse a recording that leaves an axis' range by more than the tolerance, or exceeds its speed or acceleration.

        Angles are never clipped, because the result would differ from the taught motion.

        :raises TrajectoryError: naming motor, time, value and limit of the worst violation of the first such motor.
        """
        if self.duration_s < _SPEED_WINDOW_S - _ROUNDING:
            raise TrajectoryError(texts.RECORDING_TOO_SHORT(duration_s=self.duration_s, least_s=_SPEED_WINDOW_S))
        window, speeds = self.speeds()
        times, extremes = self._extremes()
        second_difference_times, second_differences = self._second_differences()
        for axis, limit in enumerate(limits):
            angles = extremes[:, axis]
            beyond = np.maximum(limit.min_deg - angles, angles - limit.max_deg)
            worst = int(np.argmax(beyond))
            if beyond[worst] > tolerance_deg:
                raise TrajectoryError(
                    texts.MOTOR_OUT_OF_RANGE(
                        motor=axis + 1,
                        angle_deg=angles[worst],
                        at_s=times[worst, axis],
                        lowest_deg=limit.min_deg,
                        highest_deg=limit.max_deg,
                    ),
                    axis + 1,
                    float(times[worst, axis]),
                )
            fastest = int(np.argmax(speeds[:, axis]))
            if speeds[fastest, axis] > limit.max_speed_deg_s:
                raise TrajectoryError(
                    texts.MOTOR_TOO_FAST(
                        motor=axis + 1,
                        speed_deg_s=speeds[fastest, axis],
                        at_s=window[fastest],
                        limit_deg_s=limit.max_speed_deg_s,
                    ),
                    axis + 1,
                    float(window[fastest]),
                )
            sharp = second_differences[:, axis] > limit.max_acceleration_deg_s2
            if np.any(sharp):
                at_s = float(second_difference_times[int(np.argmax(second_differences[:, axis]))])
                raise TrajectoryError(texts.MOTOR_WOULD_JERK(motor=axis + 1, at_s=at_s), axis + 1, at_s)

    def _windows(self) -> Floats:
        """Return the times ``(m,)`` at which the speed windows begin. The last window ends with the recording."""
        last_s = self.duration_s - _SPEED_WINDOW_S
        return np.append(np.arange(0.0, last_s, _SPEED_WINDOW_S), last_s)

    def _set_range(self, angles_deg: Floats) -> None:
        low, high = angles_deg.min(axis=0), angles_deg.max(axis=0)
        self.rest_deg: Floats = rest_posture_deg(angles_deg)
        """``(5,)``: the posture towards which the range is reduced."""
        self.farthest_deg: Floats = np.maximum(high - self.rest_deg, self.rest_deg - low)
        """``(5,)``: largest distance of each motor from the rest posture."""
        self.reach_deg: Floats = high - low
        """``(5,)``: difference between the highest and the lowest angle of each motor."""
        self.least_share: Floats = np.array(0.0)
        """``()``: the motion stays within the limits of the pose from this share of its range on. The check of a Load sets it."""
        self.top_speed_deg_s: Floats = self.speeds()[1].max(axis=0)
        """``(5,)``: highest mean speed of each motor over 0.1 s, without sign."""
        away = np.clip(angles_deg - angles_deg[0], -RUN_UP_DEG, RUN_UP_DEG)
        self.departure_deg: Floats = away[np.argmax(np.abs(away), axis=0), np.arange(N_AXES)]
        """``(5,)``: signed distance that each motor first moves away from the start: :data:`RUN_UP_DEG`, or less if the motor
        never moves that far. It is computed once, because the control loop has no time to search an hour of samples.
        """

    def _extremes(self) -> tuple[Floats, Floats]:
        """Return times and angles, ``(m, 5)`` each, that include every axis' highest and lowest angle. A cubic has up to two
        extremes in each piece.
        """
        c3, c2, c1, _ = self._coefficients
        steps = np.diff(self._times_s)[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            # Use the form of the quadratic formula that avoids cancellation.
            q = -(c2 + np.copysign(np.sqrt(c2 * c2 - 3 * c3 * c1), c2))
            inside = np.stack([q / (3 * c3), c1 / q])
            inside = np.where((inside > 0) & (inside < steps), inside, 0.0)
        times = np.concatenate([*(self._times_s[:-1, None] + inside), np.full((1, N_AXES), self.duration_s)])
        c = self._coefficients[:, None]
        angles = (((c[0] * inside + c[1]) * inside + c[2]) * inside + c[3]).reshape(-1, N_AXES)
        return times, np.concatenate([angles, self.at(self.duration_s)[None]])

    def _second_differences(self) -> tuple[Floats, Floats]:
        """Return times ``(m,)`` and the absolute acceleration at these times ``(m, 5)``."""
        # Use half steps, because setpoints may be anywhere between two steps.
        times = np.arange(0.0, self.duration_s, _SECOND_DIFFERENCE_STEP_S / 2)
        grid = self.along(times)
        # The last difference ends with the recording.
        before, last, end = self.along(self.duration_s - _SECOND_DIFFERENCE_STEP_S * np.array([2.0, 1.0, 0.0]))
        second_differences = np.concatenate([grid[4:] - 2 * grid[2:-2] + grid[:-4], (end - 2 * last + before)[None]])
        return np.append(times[2:-2], self.duration_s - _SECOND_DIFFERENCE_STEP_S), np.abs(
            second_differences
        ) / _SECOND_DIFFERENCE_STEP_S**2


class ZeroOrderHold(Trajectory):
    """A recording at 10 Hz with a zero-order hold: the ``paper`` reference (Section 4).

    Its speed and acceleration are 0.
    """

    def __init__(self, times_s: ArrayLike, angles_deg: ArrayLike) -> None:
        """See :class:`Trajectory`."""
        times, angles = _checked(times_s, angles_deg)
        self._times_s = times
        # A recording of another rate is interpolated without overshoot.
        sample_times = np.arange(int(self.duration_s / HOLD_S + _ROUNDING) + 1) * HOLD_S
        self.samples: Floats = MonotoneCubic(times, angles)(np.minimum(sample_times, self.duration_s))
        """Held angles ``(m, 5)`` in degrees, :data:`HOLD_S` apart."""
        self._set_range(self.samples)
        self.rmse_deg = rmse(self.along(times), angles)

    def at(self, time_s: float) -> Floats:
        """Return the sample that is held at this time."""
        held: Floats = self.along(np.array([time_s]))[0]
        return held

    def motion_at(self, time_s: float) -> PathPoint:
        """Return the sample that is held at this time, with speed and acceleration 0."""
        return PathPoint(self.at(time_s), np.zeros(N_AXES), np.zeros(N_AXES))

    def along(self, times_s: Floats) -> Floats:
        """Return the samples that are held at the times ``(m,)``."""
        held: Floats = self.samples[(np.clip(times_s, 0.0, self.duration_s) / HOLD_S + _ROUNDING).astype(int)]
        return held

    def motions(self, times_s: Floats) -> PathPoint:
        """Return the held samples at the times ``(m,)``, with speed and acceleration 0."""
        held = self.along(times_s)
        return PathPoint(held, np.zeros_like(held), np.zeros_like(held))

    def _extremes(self) -> tuple[Floats, Floats]:
        times = np.arange(len(self.samples)) * HOLD_S
        return np.tile(times[:, None], N_AXES), self.samples

    def _second_differences(self) -> tuple[Floats, Floats]:
        second_differences = np.abs(np.diff(self.samples, 2, axis=0)) / HOLD_S**2
        times = np.arange(len(second_differences), dtype=np.float64)
        return (times + 1) * HOLD_S, second_differences


def _checked(times_s: ArrayLike, angles_deg: ArrayLike) -> tuple[Floats, Floats]:
    times = np.asarray(times_s, dtype=np.float64)
    angles = np.asarray(angles_deg, dtype=np.float64)
    if times.ndim != 1 or len(times) < 2 or angles.shape != (len(times), N_AXES):
        raise TrajectoryError(texts.SAMPLES_TOO_FEW())
    if not (np.all(np.isfinite(times)) and np.all(np.isfinite(angles))):
        raise TrajectoryError(texts.SAMPLES_NOT_NUMBERS())
    if np.any(np.abs(angles) > _LARGEST_DEG):
        row, axis = np.unravel_index(int(np.argmax(np.abs(angles))), angles.shape)
        raise TrajectoryError(
            texts.ANGLE_IMPLAUSIBLE(motor=axis + 1, angle_deg=angles[row, axis], largest_deg=_LARGEST_DEG),
            int(axis) + 1,
        )
    steps = np.diff(times)
    if np.any(steps <= 0):
        raise TrajectoryError(texts.TIME_NOT_INCREASING())
    if np.any(steps < _SHORTEST_STEP_S):
        raise TrajectoryError(texts.SAMPLES_TOO_CLOSE(shortest_ms=_SHORTEST_STEP_S * 1000))
    if np.any(steps > _LONGEST_GAP_S):
        at = times[int(np.argmax(steps))] - times[0]
        raise TrajectoryError(texts.SAMPLES_MISSING(gap_s=np.max(steps), at_s=at))
    return times - times[0], angles
