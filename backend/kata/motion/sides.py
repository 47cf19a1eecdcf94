"""Left and right: one canonical motion for both shoulders.

The apparatus serves the right shoulder as it is (:data:`~kata.motion.axes.CANONICAL_SIDE`) and the left one turned by
180 deg about X (Section 2.2). A **pose** is counted the same way on both sides, as anatomy does: abduction is away from
the body, flexion forward, external rotation outward. What differs is how the turned apparatus sees it.

X points forward, Y to the patient's left, Z up. The left body is the right one reflected in the sagittal plane,
M = diag(1, -1, 1); the turned apparatus is the unturned one after T = diag(1, -1, -1), which is its own inverse. A
rotation R of the right body is M R M of the left one, and in the coordinates of the turned apparatus

    T (M R M) T = S R S        with S = T M = diag(1, 1, -1)

S is a reflection: it makes of a rotation about n one by the same angle about -S n. So rotations about X and Y change
their sign and those about Z keep it, link by link, because S (R1 R2) S = (S R1 S)(S R2 S):

    phi (Z)   psi (X)   abduction (X)   flexion (Y)   rotation (Z, along the hanging arm)
       +         -            -              -            +              = APPARATUS_SIGNS["left"]

The paper says so of psi: its range is symmetric *because* of the turn (Section 4.1). Hence

* motors 1 and 2 stand at linkage(phi, -psi) on the left. (In the linkage's own equations roll goes from Z to X, about
  Y; the sign of such an axis changes as well.)
* motors 3-5 are counted as the pose is, on both sides, so that limits and figures mean the same. It is the sense in
  which the drives of axes 3 and 4 turn that changes with the pin, a matter for the bus (``Axis.direction``).

The arm hangs along +Z of the turned apparatus. How its links get there, the paper leaves to its references; our zero is
the hanging arm on both sides.
"""

from numpy.typing import ArrayLike

from kata.motion.axes import Side
from kata.motion.linkage import Floats, motor_angles_deg, pose_deg


def mirrored_deg(angles_deg: ArrayLike, from_side: Side, to_side: Side) -> Floats:
    """Return the motor angles that give the other shoulder the same pose.

    The linkage is not symmetric in psi, so the limits differ on the other side. The result is checked like any
    recording (:meth:`kata.motion.trajectory.Trajectory.check`).

    :param angles_deg: shape ``(..., 5)``, as taught on ``from_side``.
    :returns: shape ``(..., 5)``, for ``to_side``.
    :raises OutOfReachError: where the links cannot close, on either side.
    """
    return motor_angles_deg(pose_deg(angles_deg, from_side), to_side)
