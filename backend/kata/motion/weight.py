"""The torque of weight and springs on each motor by posture: linear terms whose factors a station's identification finds.

Motors 3 to 5 turn the upper arm by ``R = Rx(-t3) Ry(-t4) Rz(-t5)`` (:mod:`kata.motion.sides`); a mass at a point p of the arm is at
the height ``(R p)_z``. Its torque on a motor is the derivative of that height, so the factors are the mass's first moments. With the
elbow bent forward they have a part forward and one downward. A tool balancer hangs above the shoulder: its cable counts like a
negative mass, and more so the nearer the arm is to it, which the terms with two heights describe. On motors 1 and 2 the arm acts with
its lever to the side, ``(R p)_y``, and the relaxed shoulder girdle like a spring.

The turned apparatus is the reflection S = diag(1, 1, -1) of the unturned one (:mod:`kata.motion.sides`). A torque about Z keeps its sign
then, one about X changes it. Motor 1 turns the board about Z mostly, motor 2 about X: what loads motor 2 without a spring, the constant
included, changes its sign, and what loads motor 1 does not. The MuJoCo model agrees (``tests/motion/test_weight_of_the_plant.py``).
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from kata.motion.axes import APPARATUS_SIGNS, N_AXES, Side
from kata.motion.linkage import LINKAGE, Floats

N_TERMS: Final = 6
"""Factors of each motor, in Nm (those of a spring in Nm/rad). Motors 3 to 5: the arm's moment forward and downward, the moment of
motor 3's own link, and three of the balancer's cable. Motors 1 and 2: the arm's moment downward, two springs, the arm's moment forward, a
constant, and one without meaning."""
_REST_DEG: Final[Floats] = LINKAGE.inverse_deg([0.0, 0.0])


def weight_terms(angles_deg: ArrayLike, side: Side) -> Floats:
    """Return the terms of postures given by motor angles, ``(..., 5)`` to ``(..., 5, N_TERMS)``.

    All terms of motor 2 but its springs change their sign when the apparatus is turned.
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
