"""The five axes of the apparatus and the six basic motions (Section 2.2 and Table 2 of Sun et al. 2025).

Two sets of five numbers describe an arm. Both are in degrees and in axis order 1-5:

* a **pose** describes the body: scapular abduction (phi), scapular upward rotation (psi), shoulder abduction, shoulder
  flexion, external rotation;
* the **motor angles** (theta) describe the motors. Motors 3-5 turn with the body. Motors 1 and 2 move the scapula through
  the parallel links (:mod:`kata.motion.linkage`).
"""

from dataclasses import dataclass
from typing import Final, Literal

from kata.messages import Text
from kata.motion import texts

N_AXES: Final = 5
AXES: Final = (1, 2, 3, 4, 5)
"""Motor numbers, as the paper and the therapist count them."""

POSE_COLUMNS: Final = (
    "scapula_abduction",
    "scapula_upward_rotation",
    "shoulder_abduction",
    "shoulder_flexion",
    "external_rotation",
)
"""Names of a pose's five angles, in axis order. A CSV file of a taught motion has the same column names."""

POSE_RANGE_DEG: Final = ((-20.0, 20.0), (-20.0, 20.0), (0.0, 120.0), (-20.0, 190.0), (-90.0, 40.0))
"""The apparatus' range of motion for each angle of a pose (Table 2). Axis 4 performs motions 3 and 5; its range here is the
wider one of the two.
"""

Side = Literal["left", "right"]
"""The shoulder that is treated."""
OPPOSITE: Final[dict[Side, Side]] = {"left": "right", "right": "left"}
"""The other shoulder of each one."""

CANONICAL_SIDE: Final[Side] = "right"
"""The side of the apparatus when it is not turned.

This is our choice, because the paper refers to its references [12, 13] for the side. The paper's coordinates are those of a
right shoulder: X points forward, Z up, and the arm lifted sideways lies along -Y (Section 2.1), to the patient's right.
"""

APPARATUS_SIGNS: Final[dict[Side, tuple[int, ...]]] = {"right": (1, 1, 1, 1, 1), "left": (1, -1, -1, -1, 1)}
"""The sign of each angle of a pose as seen by the apparatus on this side (:mod:`kata.motion.sides` derives it)."""


@dataclass(frozen=True)
class BasicMotion:
    """One row of Table 2: a basic motion, its axis, its motors and its ranges of motion in degrees.

    ``range_deg`` is the range of the apparatus, ``reference_deg`` the range of a healthy shoulder.
    """

    number: int
    name: Text
    axis: int
    motors: tuple[int, ...]
    range_deg: tuple[float, float]
    reference_deg: tuple[float, float]


BASIC_MOTIONS: Final = (
    BasicMotion(1, texts.MOTION_1(), 1, (1, 2), (-20.0, 20.0), (-20.0, 20.0)),
    BasicMotion(2, texts.MOTION_2(), 2, (1, 2), (-20.0, 20.0), (-10.0, 20.0)),
    BasicMotion(3, texts.MOTION_3(), 4, (4,), (-20.0, 130.0), (-30.0, 135.0)),
    BasicMotion(4, texts.MOTION_4(), 3, (3,), (0.0, 120.0), (0.0, 180.0)),
    BasicMotion(5, texts.MOTION_5(), 4, (4,), (-20.0, 190.0), (-50.0, 180.0)),
    BasicMotion(6, texts.MOTION_6(), 5, (5,), (-90.0, 40.0), (-80.0, 25.0)),
)
