"""Converts motions between the left and the right shoulder: both use one canonical pose.

The apparatus is set up for the right shoulder (:data:`~kata.motion.axes.CANONICAL_SIDE`). For the left shoulder it is turned by
180 deg about X (Section 2.2). A **pose** has the same signs on both sides, as in anatomy: abduction is away from the body,
flexion forward, external rotation outward. The sides differ in the signs that the turned apparatus measures.

X points forward, Y to the patient's left, Z up. The left body is the right one reflected in the sagittal plane,
M = diag(1, -1, 1). The turned apparatus is the unturned one after T = diag(1, -1, -1), which is its own inverse. A
rotation R of the right body is M R M for the left body, and in the coordinates of the turned apparatus

    T (M R M) T = S R S        with S = T M = diag(1, 1, -1)

S is a reflection. It changes a rotation about n into a rotation by the same angle about -S n. Rotations about X and Y therefore
change their sign and rotations about Z keep it. This holds for each link, because S (R1 R2) S = (S R1 S)(S R2 S):

    phi (Z)   psi (X)   abduction (X)   flexion (Y)   rotation (Z, along the hanging arm)
       +         -            -              -            +              = APPARATUS_SIGNS["left"]

The paper states this for psi: its range is symmetric *because* of the turn (Section 4.1). It follows:

* motors 1 and 2 are at linkage(phi, -psi) on the left. (In the linkage's own equations roll turns from Z to X, about Y. The
  sign of such an axis changes too.)
* motors 3-5 have the signs of the pose on both sides, so that limits and figures have the same meaning. The direction in
  which the drives of axes 3 and 4 turn changes with the side; the bus driver applies it (``Axis.direction``).

The arm hangs along +Z of the turned apparatus. The paper refers to its references for the way in which the links get there.
Our zero is the hanging arm on both sides.
"""

from numpy.typing import ArrayLike

from kata.motion.axes import Side
from kata.motion.linkage import Floats, motor_angles_deg, pose_deg


def mirrored_deg(angles_deg: ArrayLike, from_side: Side, to_side: Side) -> Floats:
    """Return the motor angles that give the other shoulder the same pose.

    The linkage is not symmetric in psi, so the limits of the other side differ. The result is checked like every
    recording (:meth:`kata.motion.trajectory.Trajectory.check`).

    :param angles_deg: shape ``(..., 5)``, as taught on ``from_side``.
    :returns: shape ``(..., 5)``, for ``to_side``.
    :raises OutOfReachError: when the links cannot close for a row on either side.
    """
    return motor_angles_deg(pose_deg(angles_deg, from_side), to_side)
