"""The arm as one rigid body behind the five motors: how a movement places it, and what its inertia and weight ask of each motor.

A point p of the arm, counted from the shoulder's centre while the arm hangs, is at ``T (p, 1)`` with

    T = Rz(phi) Rx(-psi) [Rx(-t3) Ry(-t4) Rz(-t5) | shoulder]

phi and psi follow from motors 1 and 2 (:mod:`kata.motion.linkage`). With the arm's pseudo-inertia ``J``, the sum of ``m (p, 1)(p, 1)^T``
over its points, the torque of motor i is ``tr(dT/dti J T''^T)`` (Uicker's form of Lagrange's equations), where T'' includes that of gravity. It
is linear in the ten numbers of J, so a movement identifies them. The same arm moves all five motors: each motor's inertia depends on the posture, and each acceleration loads
the other motors.

Angles are the body's, which are counted alike on both sides (:mod:`kata.motion.sides`). The turned apparatus is the reflection of the unturned
one, therefore the same numbers are valid on both sides.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from kata.motion.axes import APPARATUS_SIGNS, N_AXES, Side
from kata.motion.linkage import LINKAGE, Floats
from kata.motion.path import PathPoint

N_INERTIAL: Final = 10
SHOULDER_M: Final = (0.140, -0.115, 0.020)
"""From O to the shoulder's centre, as the page draws it. Our choice: the paper does not state it."""
_PAIRS: Final = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3), (3, 3))
_ROWS, _COLUMNS = np.array(_PAIRS).T
_MIXED: Final = slice(3, 9)
"""The pairs of two different indices."""
_GRAVITY_M_S2: Final = 9.81
_RAD_A_DEG: Final = math.pi / 180.0
_STEP_RAD: Final = 1e-3
_STEP_S: Final = 1e-3
_NEIGHBOURS: Final = np.concatenate([np.eye(N_AXES), -np.eye(N_AXES)]) * _STEP_RAD
_POWERS: Final = np.array([(one, two) for one in range(4) for two in range(4) if 0 < one + two < 4]).T
"""Exponents of motors 1 and 2 in each term of the cubic, ``(2, 9)``."""
_REST_DEG: Final[Floats] = LINKAGE.inverse_deg([0.0, 0.0])
_REST_RAD: Final[Floats] = np.radians(_REST_DEG)
_GRID_DEG: Final = 22.0
"""Range of the fit. The apparatus moves the scapula by 20 deg."""


class ArmMotion(NamedTuple):
    """A movement of the arm at one or more times."""

    pose_rad: Floats
    """``(..., 5)``."""
    pose_slopes: Floats
    """``(..., 5, 5)``: change of the pose for each motor's angle; rows are motors."""
    place: Floats
    """``(..., 3, 4)``: T."""
    slopes: Floats
    """``(..., 5, 3, 4)``: dT/dti of each motor, for each rad."""
    acceleration: Floats
    """``(..., 3, 4)``: T'', with gravity as an upward acceleration."""


def arm_motion(motion: PathPoint, side: Side) -> ArmMotion:
    """Return the movement of the arm that motors make, ``(5,)`` or ``(n, 5)``.

    Derivatives are differences of neighbouring places, exact to a millionth. One evaluation of all of them takes a fifth of the time of their
    formulas.
    """
    angles, speed, acceleration = (part * _RAD_A_DEG for part in motion)
    away = speed * _STEP_S
    bent = acceleration * (_STEP_S**2 / 2)
    up, down = slice(0, N_AXES), slice(N_AXES, 2 * N_AXES)
    rows = np.empty((*angles.shape[:-1], len(_NEIGHBOURS) + 3, N_AXES))
    rows[..., :-3, :] = angles[..., np.newaxis, :] + _NEIGHBOURS
    rows[..., -2, :] = angles
    rows[..., -3, :] = angles - away + bent
    rows[..., -1, :] = angles + away + bent
    poses = _poses_rad(rows, side)
    places = _places(poses)
    before, now, after = (places[..., row, :, :] for row in (-3, -2, -1))
    felt = (before - 2 * now + after) / _STEP_S**2
    felt[..., 2, 3] += _GRAVITY_M_S2
    return ArmMotion(
        poses[..., -2, :],
        (poses[..., up, :] - poses[..., down, :]) / (2 * _STEP_RAD),
        now,
        (places[..., up, :, :] - places[..., down, :, :]) / (2 * _STEP_RAD),
        felt,
    )


def inertia_terms(arm: ArmMotion) -> Floats:
    """Return the torque of each motor for each of the ten numbers of J (:class:`~kata.motion.arm_load.ArmLoad`), ``(..., 5, N_INERTIAL)``."""
    products = np.swapaxes(arm.slopes, -1, -2) @ arm.acceleration[..., np.newaxis, :, :]
    terms: Floats = products[..., _ROWS, _COLUMNS]
    terms[..., _MIXED] += products[..., _COLUMNS[_MIXED], _ROWS[_MIXED]]
    return terms


def _scapula_factors() -> Floats:
    """Return the factors of a cubic that gives phi and psi for motors 1 and 2, to within 0.25 deg. The exact solution needs a search."""
    grid = np.radians(np.mgrid[-_GRID_DEG:_GRID_DEG:23j, -_GRID_DEG:_GRID_DEG:23j].reshape(2, -1).T)
    motors = np.radians(LINKAGE.closed_deg(np.degrees(grid), "right") - _REST_DEG)
    closes = ~np.isnan(motors).any(axis=1)
    return np.asarray(np.linalg.lstsq(_powers(motors[closes]), grid[closes], rcond=None)[0])


def _powers(motors_rad: Floats) -> Floats:
    one, two = _POWERS
    powers: Floats = motors_rad[..., 0, np.newaxis] ** one * motors_rad[..., 1, np.newaxis] ** two
    return powers


_SCAPULA: Final = _scapula_factors()


def _poses_rad(angles_rad: Floats, side: Side) -> Floats:
    poses = angles_rad.copy()
    scapula = _powers(angles_rad[..., :2] - _REST_RAD) @ _SCAPULA
    poses[..., :2] = scapula * np.array(APPARATUS_SIGNS[side][:2])
    return poses


def _places(pose_rad: Floats) -> Floats:
    sines, cosines = np.sin(pose_rad), np.cos(pose_rad)
    s1, s2, s3, s4, s5 = [sines[..., n] for n in range(N_AXES)]
    c1, c2, c3, c4, c5 = [cosines[..., n] for n in range(N_AXES)]
    board, arm = np.zeros((*pose_rad.shape[:-1], 3, 3)), np.zeros((*pose_rad.shape[:-1], 3, 4))
    for row, columns in enumerate(((c1, -s1 * c2, -s1 * s2), (s1, c1 * c2, c1 * s2), (0.0, -s2, c2))):
        for column, value in enumerate(columns):
            board[..., row, column] = value
    rows = (
        (c4 * c5, c4 * s5, -s4),
        (s3 * s4 * c5 - c3 * s5, c3 * c5 + s3 * s4 * s5, s3 * c4),
        (c3 * s4 * c5 + s3 * s5, c3 * s4 * s5 - s3 * c5, c3 * c4),
    )
    for row, columns in enumerate(rows):
        for column, value in enumerate(columns):
            arm[..., row, column] = value
    arm[..., 3] = SHOULDER_M
    places: Floats = board @ arm
    return places
