"""End-range time: the seconds in which a shoulder was held near the end of a motion against resistance.

It is the dose of a stretch. More end-range time per day gives more gain of passive range: Flowers and LaStayo 1994, J. Hand Ther. 7:150 (in
proportion to the time, finger joints), and Dempsey et al. 2011, Am. J. Phys. Med. Rehabil. 90:738 (frozen shoulders). Neither publication
defines the end by an angle or the resistance by a torque. :data:`BAND_DEG` and :data:`TORQUE_NM` are our choice.

Torque at the shoulder is the drive's torque without the identified load of the station (friction, weight of arm and balancer) and without
the difference between this arm's weight and the identified one. The difference is fitted where the motion is free. The remaining torque contains the
capsule, muscle tone and a patient who pushes. While the arm is held, friction is assumed to keep its last direction. docs/explanation/dose.md states the limits.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.end_feel import MOTORS, arm_growth
from kata.motion.linkage import Floats
from kata.motion.method import LoadModel
from kata.motion.path import PathPoint
from kata.motion.shoulder import rest_posture_deg

BAND_DEG: Final = 10.0
"""The end of the range begins this far before the end of the recorded motion. This value is our choice."""
TORQUE_NM: Final = 0.5
"""Resistance begins at this torque, as at the onset of an end-feel test with 2 Nm. This value is our choice."""
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
class EndRange:
    """When time counts: at most ``band_deg`` before the end, or beyond it, with at least ``torque_nm`` of outward torque."""

    end_deg: float
    outward: int
    """Sign of the motor's angle on the way to the end."""
    band_deg: float = BAND_DEG
    torque_nm: float = TORQUE_NM


def end_range_time_s(times_s: ArrayLike, angle_deg: ArrayLike, torque_nm: ArrayLike, counted: EndRange) -> float:
    """Return the seconds that count, from samples ``(n,)`` of time, angle and torque at the shoulder.

    A time between two samples counts whole if both are in the end range, half if one is. So the parts of a run add up to the run.
    """
    times, angle, torque = (np.asarray(values, dtype=np.float64) for values in (times_s, angle_deg, torque_nm))
    near = counted.outward * (counted.end_deg - angle) <= counted.band_deg
    inside = near & (counted.outward * torque >= counted.torque_nm)
    lasts = np.diff(times)
    shares = (inside[1:].astype(np.float64) + inside[:-1]) / 2
    return float(np.sum(np.where((lasts > 0.0) & (lasts <= GAP_S), lasts, 0.0) * shares))


def end_of_motion(taught_deg: ArrayLike, motor: int) -> EndRange | None:
    """Return the end of a recorded motion ``(n, 5)`` for one motor of the shoulder: the place farthest from rest.

    Return None if the motor moves less than :data:`LEAST_RANGE_DEG`.
    """
    taught = np.asarray(taught_deg, dtype=np.float64)
    away = taught[:, motor - 1] - rest_posture_deg(taught)[motor - 1]
    farthest = int(np.argmax(np.abs(away)))
    if abs(away[farthest]) < LEAST_RANGE_DEG:
        return None
    return EndRange(float(taught[farthest, motor - 1]), 1 if away[farthest] > 0 else -1)


def end_range_times_s(
    times_s: ArrayLike, angles_deg: ArrayLike, torques_nm: ArrayLike, taught_deg: ArrayLike, load: LoadModel
) -> dict[int, float]:
    """Return the end-range time of each motor of the shoulder that has an end, from samples ``(n,)``, ``(n, 5)`` and ``(n, 5)`` of a run.

    :param taught_deg: ``(k, 5)``, the recorded motion.
    :param load: load of the station. Without an identified load the torque at the shoulder is unknown, and no time is returned.
    """
    times, angles, torques = (np.asarray(values, dtype=np.float64) for values in (times_s, angles_deg, torques_nm))
    ends = {motor: end for motor in MOTORS if (end := end_of_motion(taught_deg, motor))}
    if not load.known or not ends or len(times) < 2:
        return {}
    at = _thinned(times)
    rest = rest_posture_deg(taught_deg)
    before = _load_nm(times, angles, at, load)
    found = {}
    for motor, end in ends.items():
        share = float(load.share[motor - 1])
        left = torques[:, motor - 1] - np.interp(times, times[at], before[:, motor - 1])
        gone = (angles[at, motor - 1] - rest[motor - 1]) / (end.end_deg - rest[motor - 1])
        free = (gone >= _FREE_SHARES[0]) & (gone <= _FREE_SHARES[1])
        growth = share * arm_growth(angles[at], motor, load.side, 1.0)
        left -= np.interp(times, times[at], growth @ _arm_difference(growth[free], left[at][free]))
        found[motor] = end_range_time_s(times, angles[:, motor - 1], left / share, end)
    return found


def _thinned(times: Floats) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the indices of samples at least :data:`_LOAD_STEP_S` apart, with the last one."""
    step = np.floor((times - times[0]) / _LOAD_STEP_S)
    kept = np.append(np.flatnonzero(np.diff(step, prepend=-1.0) > 0), len(times) - 1)
    return np.unique(kept)


def _load_nm(times: Floats, angles: Floats, at: np.ndarray[tuple[int], np.dtype[np.intp]], load: LoadModel) -> Floats:
    """Return the torque of the station's load at the samples ``at``, ``(m, 5)``. Acceleration is left out: a measured one is noise."""
    early, late = (np.clip(times[at] + side * _SPEED_S / 2, times[0], times[-1]) for side in (-1, 1))
    moved = np.column_stack([np.interp(late, times, one) - np.interp(early, times, one) for one in angles.T])
    speed = moved / np.maximum(late - early, 1e-3)[:, np.newaxis]
    parts = []
    for first in range(0, len(at), _ROWS):
        rows = slice(first, first + _ROWS)
        parts.append(load.arm_nm(PathPoint(angles[at[rows]], speed[rows], np.zeros_like(speed[rows]))))
    own: Floats = load.damping_nm_s_deg * speed + load.coulomb_nm * _sliding(angles[at])
    return np.concatenate(parts) + own


def _sliding(angles: Floats) -> Floats:
    """Return the direction of friction at angles ``(m, 5)``, -1 to 1. It changes over :data:`_SLIDING_DEG`, so an arm that stops keeps it."""
    steps = np.diff(angles, axis=0, prepend=angles[:1]) * (2.0 / _SLIDING_DEG)
    directions = np.zeros_like(angles)
    direction = np.zeros(angles.shape[1])
    for n, step in enumerate(steps):
        direction = np.clip(direction + step, -1.0, 1.0)
        directions[n] = direction
    return directions


def _arm_difference(growth: Floats, left_nm: Floats) -> Floats:
    """Return the two moments ``(2,)`` by which this arm differs from the identified one; 0 without samples of free motion."""
    if len(growth) == 0:
        return np.zeros(2)
    scale = _PLACES / len(growth) / _FREE_NM**2
    products = scale * growth.T @ growth + np.eye(2) / _ARM_NM**2
    return np.asarray(np.linalg.solve(products, scale * growth.T @ left_nm), dtype=np.float64)
