"""The shoulder joint's serial links (Section 3.1.2): where the upper arm points, and what motor 4 does to it.

Motor 3 turns about X and carries motor 4, which turns about Y while the arm hangs; both axes and motor 5's meet in the
shoulder's centre. With the arm lifted sideways by motor 3, motor 4's axis stands upright, and the same motor makes
horizontal flexion.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kata.motion.axes import CANONICAL_SIDE, Side
from kata.motion.linkage import Floats

_UPRIGHT_FROM_DEG: Final = 45.0
"""From this abduction on, motor 4's axis, (0, cos a, -+sin a) in space, is nearer to Z than to Y. The bound is ours."""


def motion_of_motor_4(abduction_deg: ArrayLike) -> NDArray[np.int_]:
    """Which basic motion motor 4 makes at this shoulder abduction: its number in Table 2.

    Between the arm hanging and the arm lifted level it makes some of both; named after the nearer one.

    :param abduction_deg: shape ``(...)``.
    :returns: shape ``(...)``: 5 (flexion / extension) or 3 (horizontal flexion / extension).
    """
    return np.where(np.asarray(abduction_deg, dtype=np.float64) < _UPRIGHT_FROM_DEG, 5, 3)


def humerus_direction(pose_deg: ArrayLike, side: Side = CANONICAL_SIDE) -> Floats:
    """Where the upper arm points in space.

    The joint sits on the scapula (Section 2.1: its parent link), whose roll and then yaw come on top of motors 4 and 3.

    :param pose_deg: shape ``(..., 5)``; external rotation turns about this direction and does not count.
    :returns: shape ``(..., 3)``, unit vectors: X forward, Y to the patient's left, Z up. (0, 0, -1) hangs.
    """
    pose = np.radians(np.asarray(pose_deg, dtype=np.float64))
    phi, abduction, flexion = pose[..., 0], pose[..., 2], pose[..., 3]
    # Upward rotation lifts the arm about the same axis as abduction does.
    lifted = abduction + pose[..., 1]
    forward = np.sin(flexion)
    outward = np.cos(flexion) * np.sin(lifted)
    # The shoulder's abduction brings the arm forward, which is about +Z on the right; left is the mirror image.
    away = forward * np.cos(phi) + outward * np.sin(phi), outward * np.cos(phi) - forward * np.sin(phi)
    left = 1.0 if side == "left" else -1.0
    return np.stack([away[0], left * away[1], -np.cos(flexion) * np.cos(lifted)], axis=-1)
