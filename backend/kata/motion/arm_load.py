"""The arm that all five motors move, with the girdle's springs and the tool balancer, and the torque that it asks of each motor.

Torques are derivatives of energies, so the same few numbers are valid for every motor, posture and side:

* the arm's inertia and weight (:mod:`kata.motion.rigid_body`);
* the weight of motor 3's own link, which motor 4 does not turn;
* springs of the relaxed shoulder girdle about phi and psi;
* the balancer's constant pull on a cable from the arm to a point above the resting shoulder. The cable is about 1 m long, so the direction of the
  pull changes with the arm and with the scapula.
"""

from typing import Final

import msgspec
import numpy as np

from kata.motion.axes import N_AXES
from kata.motion.linkage import Floats
from kata.motion.rigid_body import N_INERTIAL, SHOULDER_M, ArmMotion, inertia_terms

N_TERMS: Final = N_INERTIAL + 4
"""Numbers that the torque is linear in: the arm's inertia, the link, two springs, the balancer's force."""


class ArmLoad(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Load that one station's motors carry besides themselves. Only zeros: it has not been identified, and no motion is refused for its torque."""

    inertia: tuple[float, float, float, float, float, float, float, float, float, float] = (0.0,) * N_INERTIAL
    """Of the arm: second moments xx, yy, zz, xy, xz, yz (kg m2), first moments x, y, z (kg m), mass (kg). x is forward, y to the left and z up,
    from the shoulder of the hanging right arm.
    """
    link_nm: float = 0.0
    """Moment of the weight of motor 3's own link, positive if it hangs upwards."""
    girdle_nm_rad: tuple[float, float] = (0.0, 0.0)
    """Springs of the shoulder girdle, about phi and psi."""
    balancer_n: float = 0.0
    """Pull of the balancer's cable."""
    balancer_m: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Place of the cable's hook, forward and up from the shoulder of the hanging arm, and height of the cable's upper end above the shoulder."""

    @property
    def known(self) -> bool:
        """True if the load has been identified."""
        return any(self.inertia)

    @property
    def factors(self) -> Floats:
        """The factors of :func:`load_terms`, ``(N_TERMS,)``."""
        return np.array([*self.inertia, self.link_nm, *self.girdle_nm_rad, self.balancer_n])


def load_terms(arm: ArmMotion, balancer_m: tuple[float, float, float] | Floats) -> Floats:
    """Return the torque of each motor for each factor of a load, ``(..., 5, N_TERMS)``.

    :param balancer_m: as in :class:`ArmLoad`.
    """
    roll, abduction = arm.pose_rad[..., np.newaxis, 1], arm.pose_rad[..., np.newaxis, 2]
    link = -np.sin(roll + abduction) * (arm.pose_slopes[..., 1] + arm.pose_slopes[..., 2])
    springs = arm.pose_slopes[..., :2] * arm.pose_rad[..., np.newaxis, :2]
    forward, up, height = balancer_m
    hook = np.array([forward, 0.0, up, 1.0])
    cable = arm.place @ hook - np.array([*SHOULDER_M[:2], SHOULDER_M[2] + height])
    cable /= np.sqrt(np.sum(cable * cable, axis=-1, keepdims=True))
    terms = np.empty((*link.shape, N_TERMS))
    terms[..., :N_INERTIAL] = inertia_terms(arm)
    terms[..., N_INERTIAL] = link
    terms[..., N_INERTIAL + 1 : -1] = springs
    terms[..., -1] = np.sum((arm.slopes @ hook) * cable[..., np.newaxis, :], axis=-1)
    assert terms.shape[-2:] == (N_AXES, N_TERMS)
    return terms
