"""Calculates the kinematics of the scapula's parallel links (Section 3.2, Eqs. 1-20, with two misprints corrected).

The printed Eqs. (1) and (2) contradict the paper's own Eqs. (15)-(20). This module uses the version of (1) and (2) that
agrees with Eqs. (15)-(20), for each of the two legs i = 1, 2:

    OQi  = |OQi| (sin(psi+wi) cos phi, sin(psi+wi) sin phi, cos(psi+wi))
    O1P1 = |O1P1| (sin t1, cos t1, 0)        O2P2 = |O2P2| (0, sin t2, -cos t2)
    |OOi - OQi + OiPi| = |QiPi|

*Inverse*: with V = OOi - OQi this is ``A sin t + B cos t + C = 0`` (Eqs. 13-20). The solution is
``t = atan2(A, B) + acos(-C / hypot(A, B))``. The + branch is the one that is assembled.

*Forward*: t2 determines P2. An equation of the same form then gives psi for each phi from leg 2. The remaining opening of
leg 1 depends only on phi. A bracketing root finder brings it to zero for all rows at once.

Within +-45 deg of phi and psi, if the links close, det d(theta)/d(phi, psi) > 0. There the assembled linkage has no
singularity, no two poses have the same motor angles, and a path of motor angles has one pose path, without jumps.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kata.motion import texts
from kata.motion.axes import APPARATUS_SIGNS, CANONICAL_SIDE, Side

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Vector = tuple[Floats, Floats, Floats]
"""x, y and z as separate arrays. For a million rows this is faster than one array ``(n, 3)``."""

WITHIN_DEG: Final = 45.0
"""Limit of phi and psi in the search, on both sides of 0. Table 2 needs 20 deg; singular poses begin at about 50 deg."""
_EXACT_RAD: Final = 1e-14
_MOST_STEPS: Final = 60
"""Largest number of steps of the root finder. It needs about ten."""
_CLOSED_DEG: Final = 1e-7
"""Tolerance of the motor angles of a found pose. It distinguishes the assembled branch from the other branch."""


class OutOfReachError(ValueError):
    """The links cannot close. ``index`` is the first such row. ``motor`` is 1 or 2; None if no single motor is the cause."""

    def __init__(self, message: str, index: int, motor: int | None = None) -> None:
        super().__init__(f"{message} (row {index})")
        self.text = message
        """The message without the row."""
        self.index = index
        self.motor = motor


class Leg(NamedTuple):
    """One motor's crank OiPi and rod PiQi. The crank turns in the plane of ``sine`` and ``cosine`` (axis 0-2, sign)."""

    oq_mm: float
    w_rad: float
    op_mm: float
    qp_mm: float
    oo_mm: tuple[float, float, float]
    sine: tuple[int, float]
    cosine: tuple[int, float]

    def board(self, phi: Floats, psi: Floats) -> Vector:
        """Return the vector OQi in mm."""
        out = self.oq_mm * np.sin(psi + self.w_rad)
        return out * np.cos(phi), out * np.sin(phi), self.oq_mm * np.cos(psi + self.w_rad)

    def crank(self, theta: Floats) -> Vector:
        """Return the vector OPi in mm."""
        point = [np.full_like(theta, along) for along in self.oo_mm]
        for (axis, sign), part in ((self.sine, np.sin(theta)), (self.cosine, np.cos(theta))):
            point[axis] += sign * self.op_mm * part
        return point[0], point[1], point[2]

    def close(self, phi: Floats, psi: Floats) -> Floats:
        """Return theta in radians on the + branch, continuous over the whole region; NaN if the leg cannot close."""
        x, y, z = self.board(phi, psi)
        v = (self.oo_mm[0] - x, self.oo_mm[1] - y, self.oo_mm[2] - z)
        a = self.sine[1] * v[self.sine[0]]
        b = self.cosine[1] * v[self.cosine[0]]
        c = (v[0] ** 2 + v[1] ** 2 + v[2] ** 2 + self.op_mm**2 - self.qp_mm**2) / (2 * self.op_mm)
        angle: Floats = np.arctan2(a, b) + np.arccos(-c / np.hypot(a, b))
        # atan2 alone may differ by a whole turn. This choice is continuous over the whole region.
        return np.where(angle > np.pi, angle - 2 * np.pi, angle)

    def reach(self, point: Vector) -> float | Floats:
        """Return the component of OP along OQ when the rod joins P and Q, in mm: (|OP|^2 + |OQ|^2 - |PQ|^2) / 2 |OQ|."""
        x, y, z = point
        return (x * x + y * y + z * z + self.oq_mm**2 - self.qp_mm**2) / (2 * self.oq_mm)


@dataclass(frozen=True)
class Linkage:
    """The dimensions of the linkage, and its kinematics. Lengths are in mm, offsets in degrees.

    Phi and psi are the body's angles on both sides. The turned apparatus measures psi with the opposite sign
    (:mod:`kata.motion.sides`).

    The paper does not publish the dimensions. These are ours, checked by a sweep of phi and psi over +-24 deg. The swing limit of
    the ball joints (+-30 deg, Table 1) is not modelled, because the orientation of their housings is not published either.
    """

    oq1_mm: float = 96.0
    w1_deg: float = 84.0
    o1p1_mm: float = 40.0
    q1p1_mm: float = 113.0
    oo1_mm: tuple[float, float, float] = (-10.0, 20.0, -7.0)
    oq2_mm: float = 70.0
    w2_deg: float = 37.0
    o2p2_mm: float = 57.0
    q2p2_mm: float = 93.0
    oo2_mm: tuple[float, float, float] = (50.0, -47.0, -55.0)

    @property
    def legs(self) -> tuple[Leg, Leg]:
        """The two legs, of motors 1 and 2."""
        return (
            Leg(self.oq1_mm, np.radians(self.w1_deg), self.o1p1_mm, self.q1p1_mm, self.oo1_mm, (0, 1.0), (1, 1.0)),
            Leg(self.oq2_mm, np.radians(self.w2_deg), self.o2p2_mm, self.q2p2_mm, self.oo2_mm, (1, 1.0), (2, -1.0)),
        )

    def inverse_deg(self, scapula_deg: ArrayLike, side: Side = CANONICAL_SIDE) -> Floats:
        """Return the motor angles theta1, theta2 that hold the scapula at phi, psi.

        :param scapula_deg: shape ``(..., 2)``, columns phi (yaw, motion 1) and psi (roll, motion 2).
        :returns: shape ``(..., 2)``, columns theta1 and theta2, degrees.
        :raises OutOfReachError: when the links cannot close for a row (Eqs. 13 and 14 have no solution).
        """
        scapula = np.asarray(scapula_deg, dtype=np.float64)
        theta = self.closed_deg(scapula, side)
        open_ = np.isnan(theta)
        if np.any(open_):
            index, (phi, psi) = _first(np.any(open_, axis=-1), scapula)
            motor = 1 if open_.reshape(-1, 2)[index, 0] else 2
            raise OutOfReachError(
                texts.SCAPULA_UNREACHABLE(motor=motor, abduction_deg=phi, rotation_deg=psi),
                index,
                motor,
            )
        return theta

    def forward_deg(self, theta_deg: ArrayLike, side: Side = CANONICAL_SIDE) -> Floats:
        """Return the scapula's phi, psi for motor angles theta1, theta2.

        :param theta_deg: shape ``(..., 2)``, columns theta1 and theta2.
        :returns: shape ``(..., 2)``, columns phi and psi in degrees. It is the only pose with both angles within ``WITHIN_DEG``.
        :raises OutOfReachError: when no such pose has the motor angles of a row.
        """
        theta = np.asarray(theta_deg, dtype=np.float64)
        with np.errstate(invalid="ignore"):
            scapula_in_apparatus = np.degrees(self._standing(np.radians(theta[..., 0]), np.radians(theta[..., 1])))
        scapula = scapula_in_apparatus * _scapula_signs(side)
        # The links also close beyond a dead point, but on the assembled branch that pose has other motor angles.
        closed_theta = self.closed_deg(scapula, side)
        closed = (np.abs(closed_theta - theta) < _CLOSED_DEG) & (np.abs(scapula) < WITHIN_DEG + _CLOSED_DEG)
        not_closed = ~np.all(closed, axis=-1)
        if np.any(not_closed):
            index, (theta1, theta2) = _first(not_closed, theta)
            raise OutOfReachError(texts.NO_SCAPULA_POSITION(angle_1_deg=theta1, angle_2_deg=theta2), index)
        return scapula

    def _standing(self, theta1: Floats, theta2: Floats) -> Floats:
        """Return the scapula's angles (..., 2) in radians at which both legs close on either branch. The values are arbitrary
        for rows that do not close.
        """
        one, two = self.legs
        p1, p2 = one.crank(theta1), two.crank(theta2)
        reach1, reach2 = np.asarray(one.reach(p1)), np.asarray(two.reach(p2))

        def leg2_psi(phi: Floats, x: Floats, y: Floats, z: Floats, reach: Floats) -> Floats:
            """Solve P2 . OQ2 / |OQ2| = reach for psi. Beyond the end of leg 2's stroke psi stays at the end."""
            out = x * np.cos(phi) + y * np.sin(phi)
            stroke = np.arccos(np.clip(reach / np.hypot(out, z), -1.0, 1.0))
            psi: Floats = np.arctan2(out, z) - stroke - two.w_rad
            return psi

        def leg1_open_mm(phi: Floats) -> Floats:
            qx, qy, qz = one.board(phi, leg2_psi(phi, *p2, reach2))
            gap: Floats = (p1[0] * qx + p1[1] * qy + p1[2] * qz) / one.oq_mm - reach1
            return gap

        # Search slightly farther than needed, because a root at the end may lie on either side of the bracket's bound.
        end = np.radians(WITHIN_DEG + 1.0)
        phi = _roots(leg1_open_mm, np.full_like(theta1, -end), np.full_like(theta1, end))
        return np.stack([phi, leg2_psi(phi, *p2, reach2)], axis=-1)

    def closed_deg(self, scapula: Floats, side: Side) -> Floats:
        """Return the angles of motors 1 and 2 in degrees for scapula angles, ``(..., 2)`` to ``(..., 2)``; NaN where a leg does not close."""
        phi, psi = _seen_rad(scapula, side)
        with np.errstate(invalid="ignore"):
            return np.degrees(np.stack([leg.close(phi, psi) for leg in self.legs], axis=-1))


def _roots(function: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """Return a root of each row between ``low`` and ``high``, arrays of any shape. Where both ends have the same sign, the value is arbitrary.

    This is the Illinois method: false position, where an end that stays counts half (Dowell and Jarratt 1971, BIT 11, 168-174).
    ``scipy.optimize.elementwise.find_root`` finds the same roots, but its import takes 14 MB in each process.
    """
    with np.errstate(all="ignore"):
        at_low, at_high = function(low), function(high)
        for _ in range(_MOST_STEPS):
            middle = high - at_high * (high - low) / (at_high - at_low)
            middle = np.where(at_high == 0.0, high, middle)
            at_middle = function(middle)
            crosses = np.sign(at_middle) != np.sign(at_high)
            low = np.where(crosses, high, low)
            at_low = np.where(crosses, at_high, at_low / 2)
            moved = np.abs(middle - high)
            high, at_high = middle, at_middle
            if not np.any(moved > _EXACT_RAD):
                break
    return high


def _scapula_signs(side: Side) -> Floats:
    return np.array(APPARATUS_SIGNS[side][:2], dtype=np.float64)


def _seen_rad(scapula_deg: Floats, side: Side) -> tuple[Floats, Floats]:
    """Return phi and psi in the coordinates of the apparatus on this side, in radians."""
    phi_sign, psi_sign = _scapula_signs(side)
    return np.radians(phi_sign * scapula_deg[..., 0]), np.radians(psi_sign * scapula_deg[..., 1])


def _first(bad: Bools, rows: Floats) -> tuple[int, Floats]:
    """Return the flat index of the first bad row, and its content."""
    index = int(np.argmax(np.ravel(bad)))
    row: Floats = np.reshape(rows, (-1, 2))[index]
    return index, row


LINKAGE: Final = Linkage()


def motor_angles_deg(pose_deg: ArrayLike, side: Side = CANONICAL_SIDE) -> Floats:
    """Return the motor angles theta of poses, both shape ``(..., 5)`` in degrees and axis order.

    Motors 3-5 turn with the body and have the body's sign on both sides. Motors 1 and 2 act through the linkage.

    :raises OutOfReachError: when the scapula's links cannot close for a pose.
    """
    pose = np.asarray(pose_deg, dtype=np.float64)
    return np.concatenate([LINKAGE.inverse_deg(pose[..., :2], side), pose[..., 2:]], axis=-1)


def pose_deg(theta_deg: ArrayLike, side: Side = CANONICAL_SIDE) -> Floats:
    """Return the poses of motor angles, both ``(..., 5)`` in degrees. This is the inverse of :func:`motor_angles_deg`.

    :raises OutOfReachError: when no pose of the scapula has these angles of motors 1 and 2.
    """
    angles = np.asarray(theta_deg, dtype=np.float64)
    return np.concatenate([LINKAGE.forward_deg(angles[..., :2], side), angles[..., 2:]], axis=-1)
