"""Calculates the torque of weight and springs on each motor by posture: linear terms whose factors are identified at each station.

Motors 3 to 5 turn the upper arm by ``R = Rx(-t3) Ry(-t4) Rz(-t5)`` (:mod:`kata.motion.sides`). A mass at a point p of the arm has the
height ``(R p)_z``. Its torque on a motor is the derivative of this height, so the factors are the first moments of mass. With the elbow
bent forward they have a forward and a downward component. A tool balancer hangs above the shoulder. Its cable acts like a negative mass,
and its effect increases as the arm comes nearer; the terms with two heights describe this. On motors 1 and 2 the arm acts with its
sideways lever, ``(R p)_y``, and the relaxed shoulder girdle acts like a spring.

The turned apparatus is the reflection S = diag(1, 1, -1) of the unturned one (:mod:`kata.motion.sides`). A torque about Z then keeps its
sign, and a torque about X changes it. Motor 1 turns the board mostly about Z, motor 2 about X. The terms of motor 2 except its springs,
the constant included, therefore change their sign; those of motor 1 do not. The MuJoCo model agrees
(``tests/motion/test_weight_of_the_plant.py``).
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.axes import APPARATUS_SIGNS, N_AXES, Side
from kata.motion.linkage import LINKAGE, Floats

N_TERMS: Final = 6
"""Number of factors of each motor, in Nm (those of a spring in Nm/rad). Motors 3 to 5: the arm's forward and downward moment, the moment
of motor 3's own link, and three for the balancer's cable. Motors 1 and 2: the arm's downward moment, two springs, the arm's forward
moment, a constant, and one unused factor."""
_REST_DEG: Final[Floats] = LINKAGE.inverse_deg([0.0, 0.0])


def weight_terms(angles_deg: ArrayLike, side: Side) -> Floats:
    """Return the weight terms ``(..., 5, N_TERMS)`` of postures, which are given as motor angles ``(..., 5)``.

    All terms of motor 2 except its springs change their sign when the apparatus is turned.
    """
    angles = np.asarray(angles_deg, dtype=np.float64)
    one, two = np.moveaxis(np.radians(angles[..., :2] - _REST_DEG), -1, 0)
    (s3, s4, s5), (c3, c4, c5) = (np.moveaxis(part(np.radians(angles[..., 2:])), -1, 0) for part in (np.sin, np.cos))
    none, always = np.zeros_like(s3), np.ones_like(s3)
    forward, down = c3 * s4 * c5 + s3 * s5, c3 * c4
    slopes = (
        (c3 * s5 - s3 * s4 * c5, -s3 * c4, -s3),
        (c3 * c4 * c5, -c3 * s4, none),
        (s3 * c5 - c3 * s4 * s5, none, none),
    )
    turned = APPARATUS_SIGNS[side][1]
    aside, forward_aside = s3 * c4, s3 * s4 * c5 - c3 * s5
    yaw = (aside, one, two, forward_aside, always, none)
    roll = (turned * aside, one, two, turned * forward_aside, turned * always, none)
    arm = [
        (of_forward, of_down, link, down * of_down, down * of_forward + forward * of_down, forward * of_forward)
        for of_forward, of_down, link in slopes
    ]
    terms: Floats = np.stack([np.stack(row, axis=-1) for row in (yaw, roll, *arm)], axis=-2)
    assert terms.shape[-2:] == (N_AXES, N_TERMS)
    return terms
