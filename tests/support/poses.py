"""Random poses of the arm, and an independent account of the limits: by vectors, without motor angles."""

from typing import Final

import numpy as np

from kata.motion.axes import POSE_RANGE_DEG, Side
from kata.motion.linkage import Floats
from kata.motion.reach import ArmLimits, doctors_set, reachable_set
from kata.motion.scapula_fit import ball_joint_swing_deg
from kata.motion.shoulder import humerus_direction

DOCTORS: Final = (
    ArmLimits(),
    ArmLimits(side_deg=90.0, front_deg=90.0),
    ArmLimits(side_deg=60.0, front_deg=120.0, back_deg=60.0),
    ArmLimits(plane_deg=(0.0, 100.0), flexion_from_deg=(0.0, -20.0)),
    ArmLimits(scapula_deg=((-10.0, 10.0), (-5.0, 15.0)), side_deg=100.0),
)


def random_poses(rng: np.random.Generator, count: int, beyond_deg: float = 0.0) -> Floats:
    """Return poses ``(count, 5)`` in the ranges of Table 2, and ``beyond_deg`` around them."""
    low, high = np.array(POSE_RANGE_DEG).T
    return rng.uniform(low - beyond_deg, high + beyond_deg, (count, 5))


def random_limits(rng: np.random.Generator) -> ArmLimits:
    """Return one of :data:`DOCTORS`, or limits of any size."""
    if rng.random() < 0.3:
        return DOCTORS[rng.integers(len(DOCTORS))]
    low, high = -rng.uniform(0.0, 20.0, 2), rng.uniform(0.0, 20.0, 2)
    side_deg = float(rng.uniform(30.0, 120.0))
    return ArmLimits(
        scapula_deg=((float(low[0]), float(high[0])), (float(low[1]), float(high[1]))),
        side_deg=side_deg,
        front_deg=float(rng.uniform(30.0, 180.0)),
        back_deg=side_deg,
        plane_deg=(float(rng.uniform(-20.0, 20.0)), float(rng.uniform(60.0, 130.0))),
        flexion_from_deg=(float(rng.uniform(-20.0, 0.0)), -20.0),
    )


def margin_of(motors_deg: Floats, side: Side, limits: ArmLimits | None) -> Floats:
    """Return the margin of each pose, ``(n,)``, as the code under test says: to the reachable set, or to a doctor's limits."""
    bounds = reachable_set(motors_deg, side) if limits is None else doctors_set(motors_deg, side, limits)
    margin: Floats = -np.max([bound.beyond_deg for bound in bounds], axis=0)
    return margin


def true_beyond_deg(poses: Floats, side: Side, limits: ArmLimits | None) -> Floats:
    """Return how far each pose is beyond, ``(n,)``, from the direction of the upper arm in space."""
    if limits is None:
        return _beyond_reach(poses, side)
    elevation, plane = _body_angles(poses, side)
    phi, psi = poses[:, 0], poses[:, 1]
    (low_phi, high_phi), (low_psi, high_psi) = limits.scapula_deg
    knots = np.array([[-180, limits.front_deg], [-90, limits.back_deg], [0, limits.side_deg], [90, limits.front_deg]]).T
    allowed = np.interp(np.minimum(_wrapped(plane), 90.0), *knots)
    free = 10.0 * (np.maximum(45.0 - elevation, 0.0) + np.maximum(elevation - 135.0, 0.0))
    share = np.clip(poses[:, 2] / 90.0, 0.0, 1.0)
    hanging, level = limits.flexion_from_deg
    beyond: Floats = np.max(
        [
            low_phi - phi, phi - high_phi, low_psi - psi, psi - high_psi,
            elevation - allowed,
            _turn(elevation, plane - limits.plane_deg[1] - free),
            _turn(elevation, limits.plane_deg[0] - free - _wrapped(plane)),
            (1.0 - share) * hanging + share * level - poses[:, 3],
        ],
        axis=0,
    )  # fmt: skip
    return beyond


def _beyond_reach(poses: Floats, side: Side) -> Floats:
    scapula = np.abs(poses[:, :2]).max(axis=1) - 20.0
    swing = ball_joint_swing_deg(poses[:, :2] * ([1.0, -1.0] if side == "left" else [1.0, 1.0])).max(axis=1) - 30.0
    relative = poses.copy()
    relative[:, :2] = 0.0
    elevation, plane = _body_angles(relative, side)
    across = np.minimum(_turn(elevation, plane - 130.0), 165.0 - elevation)
    in_front = np.cos(np.radians(poses[:, 3])) >= 0.0
    beyond: Floats = np.max([scapula, swing, np.where(in_front, -90.0, across)], axis=0)
    return beyond


def _body_angles(poses: Floats, side: Side) -> tuple[Floats, Floats]:
    x, y, z = humerus_direction(poses, side).T
    outward = y if side == "left" else -y
    # The scapula's yaw turns a plane by its own angle, also where the plane passes backward.
    return np.degrees(np.arccos(np.clip(-z, -1.0, 1.0))), (np.degrees(np.arctan2(x, outward)) + 90.0) % 360.0 - 90.0


def _wrapped(plane: Floats) -> Floats:
    wrapped: Floats = np.where(plane > 180.0, plane - 360.0, plane)
    return wrapped


def _turn(elevation: Floats, plane: Floats) -> Floats:
    sine = np.sin(np.radians(elevation)) * np.sin(np.radians(np.clip(plane, -90.0, 90.0)))
    turn: Floats = np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0)))
    return turn
