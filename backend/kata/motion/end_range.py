"""End-range time: the seconds in which a shoulder was held near the end of a motion against resistance.

It is the dose of a stretch. More end-range time per day gives more gain of passive range: Flowers and LaStayo 1994, J. Hand Ther. 7:150 (in
proportion to the time, finger joints), and Dempsey et al. 2011, Am. J. Phys. Med. Rehabil. 90:738 (frozen shoulders). Neither publication
defines the end by an angle or the resistance by a torque. A programme can prescribe both; :data:`BAND_DEG` and :data:`TORQUE_NM` are our choice
for the other motions.

Torque at the shoulder is the drive's torque without the identified load of the station (friction, weight of arm and balancer) and without
the difference between this arm's weight and the identified one. The difference is fitted where the motion is free. The remaining torque contains the
capsule, muscle tone and a patient who pushes. While the arm is held, friction is assumed to keep its last direction. docs/explanation/dose.md states the limits.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.axes import N_AXES
from kata.motion.end_feel import MOTORS, arm_growth
from kata.motion.linkage import Floats
from kata.motion.method import LoadModel
from kata.motion.path import PathPoint
from kata.motion.shoulder import rest_posture_deg

_Indices = np.ndarray[tuple[int], np.dtype[np.intp]]

BAND_DEG: Final = 10.0
"""The end of the range begins this far before the end of the recorded motion. This value is our choice."""
TORQUE_NM: Final = 0.5
"""Resistance begins at this torque, as at the onset of an end-feel test with 2 Nm. This value is our choice."""
BAND_BOUNDS_DEG: Final = (2.0, 20.0)
"""Bands that can be prescribed. Behind the cuff the arm is 0.5 deg behind the apparatus at 2 Nm, and more for more torque. A band of 20 deg
contains the whole motion of a motor that has just an end (:data:`LEAST_RANGE_DEG`).
"""
TORQUE_BOUNDS_NM: Final = (0.5, 4.0)
"""Torques that can be prescribed. The lowest is twice :data:`_FREE_NM`, so that a free shoulder does not count. The highest is that of an
end-feel test.
"""
LEAST_RANGE_DEG: Final = 20.0
"""A motor that moves less has no end of a range: the band would be half of its motion."""
GAP_S: Final = 0.5
"""Time between two samples that are farther apart does not count."""
_FREE_SHARES: Final = (0.1, 0.5)
"""The arm is weighed between these shares of the recorded range, where we assume that the shoulder is free."""
_LOAD_STEP_S: Final = 0.1
"""The load is calculated at most this often, because arm and weight change slowly."""
_SPEED_S: Final = 0.2
"""Speed is the mean over this time. Steps of an encoder would otherwise change the sign of friction."""
_SLIDING_DEG: Final = 1.0
"""Movement in which friction changes its direction (Dahl's model). This value is our choice; an encoder's count is 0.09 deg."""
_ROWS: Final = 4096
"""Postures whose load is calculated at once, to bound memory."""
_ARM_NM: Final = 3.0
"""Standard deviation of the difference between two arms' moments: an arm of 3.6 kg with its centre 0.3 m away, 30 % heavier or lighter."""
_FREE_NM: Final = 0.25
"""Standard deviation of the remaining torque in the free part. In an end-feel test, a patient with a larger difference counts as working."""
_PLACES: Final = 40.0
"""Number of independent places in the free part."""


@dataclass(frozen=True)
class EndRangeThreshold:
    """Band and torque that count. The default is that of a motion without prescription."""

    band_deg: float = BAND_DEG
    torque_nm: float = TORQUE_NM


USUAL: Final = EndRangeThreshold()


@dataclass(frozen=True)
class EndRange:
    """Condition under which time counts: at most the band before the end, or beyond it, with at least the threshold's torque outwards."""

    end_deg: float
    outward: int
    """Sign of the motor's angle on the way to the end."""
    threshold: EndRangeThreshold = USUAL


def end_range_time_s(times_s: ArrayLike, angle_deg: ArrayLike, torque_nm: ArrayLike, counted: EndRange) -> float:
    """Return the seconds that count, from samples ``(n,)`` of time, angle and torque at the shoulder.

    An interval between two samples counts fully if both are in the end range, and half if only one is. The times of a run's parts
    therefore add up to the time of the run.
    """
    times, angle, torque = (np.asarray(values, dtype=np.float64) for values in (times_s, angle_deg, torque_nm))
    near = counted.outward * (counted.end_deg - angle) <= counted.threshold.band_deg
    inside = near & (counted.outward * torque >= counted.threshold.torque_nm)
    lasts = np.diff(times)
    shares = (inside[1:].astype(np.float64) + inside[:-1]) / 2
    return float(np.sum(np.where((lasts > 0.0) & (lasts <= GAP_S), lasts, 0.0) * shares))


def end_of_motion(taught_deg: ArrayLike, motor: int, threshold: EndRangeThreshold = USUAL) -> EndRange | None:
    """Return the end of a recorded motion ``(n, 5)`` for one motor of the shoulder: the place farthest from rest.

    Return None if the motor moves less than :data:`LEAST_RANGE_DEG`.
    """
    taught = np.asarray(taught_deg, dtype=np.float64)
    distance_deg = taught[:, motor - 1] - rest_posture_deg(taught)[motor - 1]
    farthest = int(np.argmax(np.abs(distance_deg)))
    if abs(distance_deg[farthest]) < LEAST_RANGE_DEG:
        return None
    outward = 1 if distance_deg[farthest] > 0 else -1
    return EndRange(float(taught[farthest, motor - 1]), outward, threshold)


class EndRangeCounter:
    """Counts the end-range time of motors of the shoulder that have an end, while the samples of a run arrive."""

    def __init__(
        self,
        taught_deg: ArrayLike,
        load: LoadModel,
        thresholds: Mapping[int, EndRangeThreshold] = MappingProxyType({}),
        motors: Iterable[int] = MOTORS,
    ) -> None:
        """Begin with 0 s.

        :param taught_deg: ``(k, 5)``, the recorded motion.
        :param load: load of the station. Without an identified load the torque at the shoulder is unknown, and no motor is counted.
        :param thresholds: band and torque by motor; :data:`USUAL` for the other motors.
        :param motors: motors to count.
        """
        self._load = load
        self._friction = _FrictionDirection()
        self._earlier = np.empty(0), np.empty((0, N_AXES))
        """Times and angles of the newest samples, for the speed at the start of the next part."""
        rest_deg = rest_posture_deg(taught_deg)
        ends = {motor: end_of_motion(taught_deg, motor, thresholds.get(motor, USUAL)) for motor in motors}
        self._motors = {
            motor: _MotorSamples(motor, end, float(rest_deg[motor - 1]))
            for motor, end in ends.items()
            if end and load.known
        }

    def add(self, times_s: ArrayLike, angles_deg: ArrayLike, torques_nm: ArrayLike) -> None:
        """Add the next part of a run: samples ``(n,)``, ``(n, 5)`` and ``(n, 5)`` after all samples before."""
        times, angles, torques = (np.asarray(values, dtype=np.float64) for values in (times_s, angles_deg, torques_nm))
        if len(times) == 0 or not self._motors:
            return
        at = _load_sample_indices(times)
        before = len(self._earlier[0])
        around = np.concatenate((self._earlier[0], times)), np.concatenate((self._earlier[1], angles))
        load = _load_nm(*around, at + before, self._load)
        load += self._load.coulomb_nm * self._friction.follow(angles[at])
        recent = around[0] > times[-1] - _SPEED_S
        self._earlier = around[0][recent], around[1][recent]
        for motor, samples in self._motors.items():
            residual_nm = torques[:, motor - 1] - np.interp(times, times[at], load[:, motor - 1])
            growth = self._load.share[motor - 1] * arm_growth(angles[at], motor, self._load.side, 1.0)
            samples.add(times, angles[:, motor - 1], residual_nm, at, growth)

    def times_s(self) -> dict[int, float]:
        """Return the seconds by motor."""
        return {motor: samples.time_s(float(self._load.share[motor - 1])) for motor, samples in self._motors.items()}


class _MotorSamples:
    """The samples of one motor, without the load of the station, and the arm's weight as far as it is known from them."""

    def __init__(self, motor: int, end: EndRange, rest_deg: float) -> None:
        self._motor, self._end, self._rest_deg = motor, end, rest_deg
        self._parts: list[Floats] = []
        """Rows of time, angle, torque, and growth of the torque with both moments of the arm: ``(5, n)`` each."""
        self._products, self._sums, self._weighed = np.zeros((2, 2)), np.zeros(2), 0

    def add(self, times: Floats, angle: Floats, left_nm: Floats, at: _Indices, growth: Floats) -> None:
        """Add a part. ``growth``: ``(m, 2)`` at the samples ``at``."""
        share_of_range = (angle[at] - self._rest_deg) / (self._end.end_deg - self._rest_deg)
        free = (share_of_range >= _FREE_SHARES[0]) & (share_of_range <= _FREE_SHARES[1])
        self._products += growth[free].T @ growth[free]
        self._sums += growth[free].T @ left_nm[at][free]
        self._weighed += int(np.sum(free))
        columns = [np.interp(times, times[at], column) for column in growth.T]
        self._parts.append(np.vstack([times, angle, left_nm, *columns]))

    def time_s(self, share: float) -> float:
        """Return the seconds that count. ``share``: torque that the drive reports for 1 Nm."""
        if not self._parts:
            return 0.0
        self._parts = [np.concatenate(self._parts, axis=1)]
        times, angle, left_nm, *growth = self._parts[0]
        shoulder_nm = (left_nm - self._arm_difference() @ growth) / share
        return end_range_time_s(times, angle, shoulder_nm, self._end)

    def _arm_difference(self) -> Floats:
        """Return the two moments ``(2,)`` by which this arm differs from the identified one; 0 without samples of free motion."""
        if self._weighed == 0:
            return np.zeros(2)
        scale = _PLACES / self._weighed / _FREE_NM**2
        return np.asarray(
            np.linalg.solve(scale * self._products + np.eye(2) / _ARM_NM**2, scale * self._sums), dtype=np.float64
        )


class _FrictionDirection:
    """The direction of friction. It changes over :data:`_SLIDING_DEG`, so an arm that stops keeps it."""

    def __init__(self) -> None:
        self._angles: Floats | None = None
        self._direction = np.zeros(N_AXES)

    def follow(self, angles: Floats) -> Floats:
        """Return the direction at the next angles ``(m, 5)``, -1 to 1."""
        before = angles[:1] if self._angles is None else self._angles
        steps = np.diff(angles, axis=0, prepend=before) * (2.0 / _SLIDING_DEG)
        directions = np.zeros_like(angles)
        for n, step in enumerate(steps):
            self._direction = np.clip(self._direction + step, -1.0, 1.0)
            directions[n] = self._direction
        self._angles = angles[-1:]
        return directions


def _load_sample_indices(times: Floats) -> _Indices:
    """Return the indices of samples at least :data:`_LOAD_STEP_S` apart, with the last one."""
    step = np.floor((times - times[0]) / _LOAD_STEP_S)
    is_kept = np.diff(step, prepend=-1.0) > 0
    is_kept[-1] = True
    return np.flatnonzero(is_kept)


def _load_nm(times: Floats, angles: Floats, at: _Indices, load: LoadModel) -> Floats:
    """Return the torque of the station's load without dry friction at the samples ``at``, ``(m, 5)``.

    Acceleration is left out: a measured one is noise.
    """
    early, late = (np.clip(times[at] + side * _SPEED_S / 2, times[0], times[-1]) for side in (-1, 1))
    moved = np.column_stack([np.interp(late, times, one) - np.interp(early, times, one) for one in angles.T])
    speed = moved / np.maximum(late - early, 1e-3)[:, np.newaxis]
    parts = []
    for first in range(0, len(at), _ROWS):
        rows = slice(first, first + _ROWS)
        parts.append(load.arm_nm(PathPoint(angles[at[rows]], speed[rows], np.zeros_like(speed[rows]))))
    viscous: Floats = load.damping_nm_s_deg * speed
    return np.concatenate(parts) + viscous
