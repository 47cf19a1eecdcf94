"""Compares playback with teaching: the paper's error (Section 4) and other figures, for every motor and motion.

The error is playback minus teaching at the same place on the path. The comparison uses the path's own clock, not wall time, so
that a pause in a playback is not an error. Times are not warped: a lag of the playback appears as an error.
:func:`wall_clock_s` calculates the wall clock. The start is reported separately, as in the paper ("start excepted"). The larger
of the two errors, of the start and of the rest, is the largest error of the playback.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kata.motion.axes import BASIC_MOTIONS, BasicMotion
from kata.motion.interpolation import MonotoneCubic, lowest_at
from kata.motion.linkage import Floats
from kata.motion.shoulder import motion_of_motor_4
from kata.motion.smoothness import smoothness

START_S: Final = 0.5
"""Duration of the start of a playback, on the path's clock. We chose it: five samples of the paper's 10 Hz. The paper excludes
"the initial state" without a time.
"""
MIN_MOTION_DEG: Final = 2.0
"""An axis with a smaller range hardly moves, so its lag and smoothness would be those of noise."""
_LARGEST_LAG_S: Final = 0.5
"""Largest lag that is searched: five samples of the paper's 10 Hz. With a larger lag the axis does not follow at all."""
_LAG_STEP_S: Final = 0.02
"""Step of the first search, before the refinement: far less than the period of a tremor."""
_LAG_EXACT_S: Final = 1e-5
_LAG_SAMPLES: Final = 20_000
"""Maximum number of samples for the lag. More samples would not increase the precision."""
_SAME_PLACE_S: Final = 1e-3
"""Places on the recording that are closer than this count as the same place."""


class AngleRange(NamedTuple):
    """Lowest and highest angle, degrees."""

    min_deg: float
    max_deg: float


class ErrorFigures(NamedTuple):
    """The error of one angle: the start, and separately everything after it. If a playback ended within its start, both are
    calculated from all samples.
    """

    peak_deg: float
    """Largest error after the start, with its sign."""
    peak_at_s: float
    rmse_deg: float
    """Root mean square of the error after the start."""
    start_deg: float
    """Largest error of the start, with its sign."""


def error_figures(clock_s: Floats, error_deg: Floats) -> ErrorFigures:
    """Return the figures of an error ``(m,)`` at the times ``clock_s`` ``(m,)``, degrees and seconds; ``m`` is at least 1."""
    start = clock_s < clock_s[0] + START_S
    after = ~start if not np.all(start) else start
    later = error_deg[after]
    peak = int(np.argmax(np.abs(later)))
    return ErrorFigures(
        float(later[peak]), float(clock_s[after][peak]), float(np.sqrt(np.mean(later**2))), largest(error_deg[start])
    )


@dataclass(frozen=True, kw_only=True)
class Tracking:
    """The figures of one angle, playback minus teaching. The first four are those of :class:`ErrorFigures`."""

    peak_deg: float
    peak_at_s: float
    rmse_deg: float
    start_deg: float
    lag_ms: float | None
    """The shift of the clock that best aligns playback with teaching. It is positive if the playback is late. None if the angle
    hardly moves.
    """
    taught: AngleRange
    """Range of the whole recording."""
    played: AngleRange
    """Range that the playback reached."""
    taught_smoothness: float | None
    """SPARC (:mod:`kata.motion.smoothness`) of the part that was played."""
    played_smoothness: float | None


@dataclass(frozen=True, kw_only=True)
class MotorTracking(Tracking):
    """The figures of one motor."""

    motor: int
    torque_peak_nm: float | None
    """Largest torque while playing, with its sign; None if no torque was given."""


@dataclass(frozen=True, kw_only=True)
class MotionTracking(Tracking):
    """The figures of one basic motion, in the angle of the body instead of the motors."""

    motion: BasicMotion
    """The motion's row of Table 2, with the ranges of the apparatus and of a healthy shoulder."""


class Comparison:
    """Teaching and playback on one clock. ``times_s`` is ``(m,)``; the angles are ``(m, 5)`` in degrees."""

    def __init__(self, aligned: "_AlignedRecordings", torque_nm: Floats | None) -> None:
        self._aligned = aligned
        self._torque_nm = torque_nm
        self.times_s = aligned.path
        self.taught_deg = aligned.taught_there
        self.played_deg = aligned.played

    @cached_property
    def motors(self) -> tuple[MotorTracking, ...]:
        """The figures of every motor. They are computed on first use, because a plot of an hour does not need them."""
        torque = self._torque_nm
        return tuple(
            MotorTracking(
                motor=axis + 1,
                torque_peak_nm=None if torque is None else largest(torque[:, axis]),
                **vars(self._aligned.figures(axis)),
            )
            for axis in range(self.played_deg.shape[1])
        )

    @property
    def error_deg(self) -> Floats:
        """Playback minus teaching, ``(m, 5)``."""
        return self.played_deg - self.taught_deg

    @property
    def samples(self) -> int:
        """Number of compared samples of the playback."""
        return len(self.times_s)


def compare(
    taught_times_s: ArrayLike,
    taught_deg: ArrayLike,
    played_path_s: ArrayLike,
    played_deg: ArrayLike,
    torque_nm: ArrayLike | None = None,
) -> Comparison:
    """Compare a playback with its teaching, motor by motor.

    :param taught_times_s: ``(n,)`` times of the recording, increasing. They are used relative to the first sample.
    :param taught_deg: ``(n, 5)`` motor angles taught.
    :param played_path_s: ``(m,)`` places on the recording's clock at which the playback was measured.
    :param played_deg: ``(m, 5)`` motor angles measured there.
    :param torque_nm: ``(m, 5)`` torque measured there.
    :raises ValueError: when the playback has no samples.
    """
    aligned = _AlignedRecordings(taught_times_s, taught_deg, played_path_s, played_deg)
    return Comparison(aligned, None if torque_nm is None else np.asarray(torque_nm, dtype=np.float64))


def compare_motions(
    taught_times_s: ArrayLike,
    taught_pose_deg: Floats,
    played_path_s: ArrayLike,
    played_pose_deg: Floats,
) -> tuple[MotionTracking, ...]:
    """Compare in the body's angles: one result for each basic motion that the recording moves, in the order of Table 2.

    The motions are those of :func:`moved_motions`. The parameters are those of :func:`compare`, with poses (:func:`kata.motion.linkage.pose_deg`) instead of motor angles.

    :raises ValueError: when the playback has no samples.
    """
    aligned = _AlignedRecordings(taught_times_s, taught_pose_deg, played_path_s, played_pose_deg)
    return tuple(
        MotionTracking(motion=motion, **vars(aligned.figures(motion.axis - 1)))
        for motion in moved_motions(taught_pose_deg)
    )


def moved_motions(taught_pose_deg: Floats) -> tuple[BasicMotion, ...]:
    """Return the basic motions of a recording, in the order of Table 2, from its poses ``(n, 5)``.

    Motor 4 performs forward or horizontal flexion, depending on how far the arm is lifted. One of the two motions is chosen
    for the whole recording.
    """
    not_this_one = _other_of_motor_4(taught_pose_deg)
    moved = np.ptp(taught_pose_deg, axis=0) >= MIN_MOTION_DEG
    return tuple(motion for motion in BASIC_MOTIONS if motion.number != not_this_one and moved[motion.axis - 1])


def angles_at(times_s: Floats, angles_deg: Floats, places_s: Floats) -> Floats:
    """Return the angles ``(k, ...)`` at places ``(k,)``, degrees; they are constant before the start and after the end."""
    return MonotoneCubic(times_s, angles_deg)(np.clip(places_s, times_s[0], times_s[-1]))


def wall_clock_s(times_s: Floats, path_s: Floats, moving: NDArray[np.bool_]) -> Floats:
    """Return the wall clock of a playback ``(m,)``, in seconds from the start of its motion.

    The path's clock starts slowly, together with the arm. The wall clock starts at full speed. It is set to the path's clock at
    the first sample and after every interruption, such as a pause.

    :param times_s: ``(m,)`` real times of all samples of the run.
    :param path_s: ``(m,)`` their places on the path.
    :param moving: ``(m,)`` True for samples in which the arm moved forwards. For other samples the result is NaN.
    """
    begins = moving & ~np.concatenate([[False], moving[:-1]])
    since = np.flatnonzero(begins)[np.maximum(np.cumsum(begins) - 1, 0)] if np.any(begins) else np.zeros(0, np.intp)
    if not len(since):
        return np.full(len(times_s), np.nan)
    wall: Floats = np.where(moving, path_s[since] + times_s - times_s[since], np.nan)
    return wall


class _AlignedRecordings:
    """Teaching and playback on one clock, with five motor angles or the five angles of a pose."""

    def __init__(self, times_s: ArrayLike, taught: ArrayLike, path_s: ArrayLike, played: ArrayLike) -> None:
        self.path: Floats = np.asarray(path_s, dtype=np.float64)
        self.played: Floats = np.asarray(played, dtype=np.float64)
        if len(self.path) == 0:
            raise ValueError("the playback has no samples")
        self.taught: Floats = np.asarray(taught, dtype=np.float64)
        times = np.asarray(times_s, dtype=np.float64)
        self._times: Floats = times - times[0]
        self.taught_there = angles_at(self._times, self.taught, self.path)
        # Places after a reversal were played twice. The speed is calculated only from the first time.
        forward = np.diff(np.maximum.accumulate(self.path), prepend=-np.inf) > _SAME_PLACE_S
        self._once: Floats = self.path[forward]
        self._played_once: Floats = self.played[forward]

    def figures(self, axis: int) -> Tracking:
        """Return the figures that are common to motors and motions."""
        error = self.played[:, axis] - self.taught_there[:, axis]
        moves = bool(np.ptp(self.taught_there[:, axis]) >= MIN_MOTION_DEG)
        return Tracking(
            **error_figures(self.path, error)._asdict(),
            lag_ms=self._lag_ms(axis) if moves else None,
            taught=_range(self.taught[:, axis]),
            played=_range(self.played[:, axis]),
            taught_smoothness=self._taught_smoothness(axis) if moves else None,
            played_smoothness=smoothness(self._once, self._played_once[:, axis]) if moves else None,
        )

    def _taught_smoothness(self, axis: int) -> float | None:
        in_first_repetition = (self._times >= self._once[0]) & (self._times <= self._once[-1])
        return smoothness(self._times[in_first_repetition], self.taught[in_first_repetition, axis])

    def _lag_ms(self, axis: int) -> float:
        """Return the shift in ms with the smallest variance of the remaining error. The variance ignores a constant error."""
        curve = MonotoneCubic(self._times, self.taught[:, axis])
        step = -(-len(self.path) // _LAG_SAMPLES)
        played, path = self.played[::step, axis], self.path[::step]

        def left(lag_s: float) -> float:
            return float(np.var(played - curve(np.clip(path - lag_s, 0.0, self._times[-1]))))

        tried = np.arange(-_LARGEST_LAG_S, _LARGEST_LAG_S + _LAG_STEP_S / 2, _LAG_STEP_S)
        near = float(tried[int(np.argmin([left(lag_s) for lag_s in tried]))])
        return lowest_at(left, near - _LAG_STEP_S, near + _LAG_STEP_S, _LAG_EXACT_S) * 1000


def _range(angles: Floats) -> AngleRange:
    return AngleRange(float(angles.min()), float(angles.max()))


def largest(values: Floats) -> float:
    """Return the value of ``(m,)`` that is farthest from 0, with its sign."""
    return float(values[int(np.argmax(np.abs(values)))])


def _other_of_motor_4(pose_deg: Floats) -> int:
    """Return the number of the motion, 3 or 5, that motor 4 does not perform. It is decided by the abduction of the arm,
    averaged over the distance that motor 4 moves.
    """
    way = np.abs(np.diff(pose_deg[:, 3]))
    lifted = np.average(pose_deg[1:, 2], weights=way) if np.any(way > 0) else pose_deg[0, 2]
    return 8 - int(motion_of_motor_4(lifted))
