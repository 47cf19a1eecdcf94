"""Inverse kinematics of the scapula's parallel links (Section 3.2, Eqs. 1-20, two misprints mended).

The printed Eqs. (1) and (2) contradict the paper's own Eqs. (15)-(20); what is built here is the reading that
agrees with the latter:

    OQi  = |OQi| (sin(psi+wi) cos phi, sin(psi+wi) sin phi, cos(psi+wi))
    O1P1 = |O1P1| (sin t1, cos t1, 0)        O2P2 = |O2P2| (0, sin t2, -cos t2)
    |OOi - OQi + OiPi| = |QiPi|

which gives ``A sin t1 + B cos t1 + C = 0`` and ``D sin t2 + E cos t2 + F = 0``, closed by
``t = atan2(A, B) + acos(-C / hypot(A, B))``. The + branch is the assembled one over the whole region.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class OutOfReachError(ValueError):
    """The links cannot close at this pose. ``index`` is the first offending row, ``motor`` is 1 or 2."""

    def __init__(self, index: int, motor: int, phi_deg: float, psi_deg: float) -> None:
        super().__init__(
            f"motor {motor} cannot reach scapular abduction {phi_deg:.1f} deg with upward rotation "
            f"{psi_deg:.1f} deg (row {index})"
        )
        self.index = index
        self.motor = motor


@dataclass(frozen=True)
class Linkage:
    """Lengths in mm, offsets in degrees.

    The paper does not publish them; these are ours, checked by a sweep of phi and psi over +-24 deg.
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

    def inverse_deg(self, scapula_deg: ArrayLike) -> Floats:
        """Motor angles theta1, theta2 that hold the scapula at phi, psi.

        :param scapula_deg: shape ``(..., 2)``, columns phi (yaw, motion 1) and psi (roll, motion 2).
        :returns: shape ``(..., 2)``, columns theta1 and theta2, degrees.
        :raises OutOfReachError: where the links cannot close (Eqs. 13 and 14 have no solution).
        """
        scapula = np.asarray(scapula_deg, dtype=np.float64)
        phi, psi = np.radians(scapula[..., 0]), np.radians(scapula[..., 1])

        s1, c1 = np.sin(psi + np.radians(self.w1_deg)), np.cos(psi + np.radians(self.w1_deg))
        x1, y1, z1 = self.oo1_mm
        a = 2 * self.o1p1_mm * (x1 - self.oq1_mm * s1 * np.cos(phi))
        b = 2 * self.o1p1_mm * (y1 - self.oq1_mm * s1 * np.sin(phi))
        c = (
            _squares(self.oo1_mm, self.oq1_mm, self.o1p1_mm, self.q1p1_mm)
            - 2 * self.oq1_mm * (x1 * s1 * np.cos(phi) + y1 * s1 * np.sin(phi) + z1 * c1)
        )  # fmt: skip

        s2, c2 = np.sin(psi + np.radians(self.w2_deg)), np.cos(psi + np.radians(self.w2_deg))
        x2, y2, z2 = self.oo2_mm
        d = 2 * self.o2p2_mm * (y2 - self.oq2_mm * s2 * np.sin(phi))
        e = 2 * self.o2p2_mm * (-z2 + self.oq2_mm * c2)
        f = (
            _squares(self.oo2_mm, self.oq2_mm, self.o2p2_mm, self.q2p2_mm)
            - 2 * self.oq2_mm * (x2 * s2 * np.cos(phi) + y2 * s2 * np.sin(phi) + z2 * c2)
        )  # fmt: skip

        theta = np.stack([self._close(1, scapula, a, b, c), self._close(2, scapula, d, e, f)], axis=-1)
        return np.degrees(theta)

    @staticmethod
    def _close(motor: int, scapula: Floats, sine: Floats, cosine: Floats, constant: Floats) -> Floats:
        """Solve ``sine sin t + cosine cos t + constant = 0`` for t in radians, + branch."""
        ratio = -constant / np.hypot(sine, cosine)
        beyond = np.abs(ratio) > 1.0
        if np.any(beyond):
            index = int(np.argmax(np.ravel(beyond)))
            phi, psi = np.reshape(scapula, (-1, 2))[index]
            raise OutOfReachError(index, motor, float(phi), float(psi))
        angle: Floats = np.arctan2(sine, cosine) + np.arccos(ratio)
        # One continuous representative over the whole region; atan2 alone may differ by a turn.
        return (angle + np.pi) % (2 * np.pi) - np.pi


def _squares(oo: tuple[float, float, float], oq: float, op: float, qp: float) -> float:
    return sum(x * x for x in oo) + oq * oq + op * op - qp * qp


LINKAGE: Final = Linkage()


def motor_angles_deg(pose_deg: ArrayLike) -> Floats:
    """Motor angles theta for poses, both shape ``(..., 5)`` in degrees and axis order.

    Motors 3-5 turn with the body; 1 and 2 through the linkage.

    :raises OutOfReachError: where the scapula's links cannot close.
    """
    pose = np.asarray(pose_deg, dtype=np.float64)
    return np.concatenate([LINKAGE.inverse_deg(pose[..., :2]), pose[..., 2:]], axis=-1)
