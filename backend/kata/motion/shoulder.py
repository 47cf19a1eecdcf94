"""Calculates the shoulder joint's serial links (Section 3.1.2): the upper arm's direction, and the basic motion of motor 4.

Motor 3 turns about X and carries motor 4, which turns about Y while the arm hangs. Both axes and the axis of motor 5 meet in
the shoulder's centre. When motor 3 has lifted the arm sideways, the axis of motor 4 is vertical, and motor 4 performs
horizontal flexion.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kata.motion.axes import CANONICAL_SIDE, Side
from kata.motion.linkage import Floats

_RAISED_START_DEG: Final = 10.0
"""A motion that starts higher than this above its lowest posture does not start at rest. We chose this value, because the arm
hangs at 0 to 20 deg in the recorded motions.
"""
_UPRIGHT_FROM_DEG: Final = 45.0
"""From this abduction the axis of motor 4, (0, cos a, -+sin a) in space, is nearer to Z than to Y. We chose this value.
"""


def motion_of_motor_4(abduction_deg: ArrayLike) -> NDArray[np.int_]:
    """Return the number in Table 2 of the basic motion that motor 4 performs at this shoulder abduction.

    Between the hanging and the level arm, motor 4 performs a part of both motions. The nearer one is returned.

    :param abduction_deg: shape ``(...)``.
    :returns: shape ``(...)``: 5 (flexion / extension) or 3 (horizontal flexion / extension).
    """
    return np.where(np.asarray(abduction_deg, dtype=np.float64) < _UPRIGHT_FROM_DEG, 5, 3)


def humerus_direction(pose_deg: ArrayLike, side: Side = CANONICAL_SIDE) -> Floats:
    """Return the direction of the upper arm in space.

    The joint is on the scapula (Section 2.1: its parent link). The scapula's roll and then its yaw are applied after motors 4 and 3.

    :param pose_deg: shape ``(..., 5)``; external rotation turns about the arm's direction and therefore has no effect.
    :returns: shape ``(..., 3)``, unit vectors: X forward, Y to the patient's left, Z up. (0, 0, -1) hangs.
    """
    pose = np.radians(np.asarray(pose_deg, dtype=np.float64))
    phi, abduction, flexion = pose[..., 0], pose[..., 2], pose[..., 3]
    # Upward rotation lifts the arm about the same axis as abduction.
    lifted = abduction + pose[..., 1]
    forward = np.sin(flexion)
    outward = np.cos(flexion) * np.sin(lifted)
    # The scapula's abduction moves the arm forward: a rotation about +Z on the right side. The left side is the mirror image.
    away = forward * np.cos(phi) + outward * np.sin(phi), outward * np.cos(phi) - forward * np.sin(phi)
    left = 1.0 if side == "left" else -1.0
    return np.stack([away[0], left * away[1], -np.cos(flexion) * np.cos(lifted)], axis=-1)


def elevation_deg(direction: Floats) -> Floats:
    """Return the elevation of the upper arm against the trunk, shape ``(...)``. It is 0 for the hanging arm.

    :param direction: of the humerus, ``(..., 3)`` (:func:`humerus_direction`).
    """
    elevation: Floats = np.degrees(np.arccos(np.clip(-direction[..., 2], -1.0, 1.0)))
    return elevation


def rest_posture_deg(angles_deg: ArrayLike) -> Floats:
    """Return the posture towards which a motion's range is reduced: its start, where the arm hangs.

    A motion that starts with a raised arm, such as a trimmed part, is reduced towards its lowest posture, because a
    reduction must never lift the arm.

    :param angles_deg: shape ``(n, 5)``, motor angles or poses.
    :returns: shape ``(5,)``, one of the rows.
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    shoulder = np.radians(angles[:, 2:4])
    elevation = np.degrees(np.arccos(np.prod(np.cos(shoulder), axis=1)))
    lowest = int(np.argmin(elevation))
    rest: Floats = angles[0 if elevation[0] <= elevation[lowest] + _RAISED_START_DEG else lowest]
    return rest.copy()
