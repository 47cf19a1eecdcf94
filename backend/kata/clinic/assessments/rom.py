"""Range of motion: the measured motions, the arm's position, plausible angles and the reference of a healthy shoulder.

Reference angles are those of the Japanese Orthopaedic Association and the Japanese Association of Rehabilitation Medicine, "Indication and
measurement of the range of motion of joints" (1995, revised 2022): Jpn J Rehabil Med 32, 207-217 and 58, 1188-1200. The reference of
rotation with the arm raised sideways is from its section on other methods. Rotation with the arm raised forward has no reference there; its
value is that of the apparatus' motion 6 (Sun et al., Robotics 2025, 14, 12, Table 2).

The bounds detect typing errors. The upper bound lies beyond the most supple shoulder. The lower bound is as far below zero as a contracture
can keep an arm from neutral.
"""

from dataclasses import dataclass
from typing import Final, Literal, get_args

from kata.clinic import texts

MotionId = Literal[
    "flexion",
    "extension",
    "abduction",
    "adduction",
    "external_rotation",
    "internal_rotation",
    "horizontal_flexion",
    "horizontal_extension",
    "scapular_flexion",
    "scapular_extension",
    "scapular_elevation",
    "scapular_depression",
]
Position = Literal["", "at_side", "abducted_90", "flexed_90"]
Kind = Literal["active", "passive"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)


@dataclass(frozen=True)
class Loinc:
    """LOINC codes of one motion. They do not state the side or the position of the arm."""

    active: str
    """Empty if we have verified none without a side."""
    passive: str


@dataclass(frozen=True)
class Measure:
    """One motion with the arm in one position, for either side, active or passive."""

    motion: MotionId
    position: Position
    """Empty if the position does not matter."""
    english: str
    japanese: str
    lowest_deg: float
    highest_deg: float
    reference_deg: float
    loinc: Loinc | None = None

    def loinc_of(self, kind: str) -> str:
        """Return the LOINC code of ``active`` or ``passive``; empty if we have verified none."""
        if self.loinc is None:
            return ""
        return self.loinc.active if kind == "active" else self.loinc.passive


_EXTERNAL: Final = Loinc("41387-2", "41388-0")
_INTERNAL: Final = Loinc("41391-4", "41392-2")
_HORIZONTAL_ADDUCTION: Final = Loinc("", "56046-6")
"""Horizontal flexion is LOINC's horizontal adduction: 56046-6, Shoulder Horizontal adduction Passive Range of Motion. Of the active codes we
have verified only the right shoulder's (56044-1)."""

MEASURES: Final = (
    Measure("flexion", "", texts.ROM_FLEXION(), "屈曲", -20, 200, 180, Loinc("41389-8", "41390-6")),
    Measure("extension", "", texts.ROM_EXTENSION(), "伸展", -30, 90, 50, Loinc("41385-6", "41386-4")),
    Measure("abduction", "", texts.ROM_ABDUCTION(), "外転", -20, 200, 180, Loinc("41381-5", "41382-3")),
    Measure("adduction", "", texts.ROM_ADDUCTION(), "内転", -60, 90, 0),
    Measure("external_rotation", "at_side", texts.ROM_EXTERNAL_ROTATION_1(), "外旋(1st)", -60, 120, 60, _EXTERNAL),
    Measure("internal_rotation", "at_side", texts.ROM_INTERNAL_ROTATION_1(), "内旋(1st)", -60, 120, 80, _INTERNAL),
    Measure("external_rotation", "abducted_90", texts.ROM_EXTERNAL_ROTATION_2(), "外旋(2nd)", -60, 130, 90, _EXTERNAL),
    Measure("internal_rotation", "abducted_90", texts.ROM_INTERNAL_ROTATION_2(), "内旋(2nd)", -60, 120, 70, _INTERNAL),
    Measure("external_rotation", "flexed_90", texts.ROM_EXTERNAL_ROTATION_3(), "外旋(3rd)", -60, 130, 25, _EXTERNAL),
    Measure("internal_rotation", "flexed_90", texts.ROM_INTERNAL_ROTATION_3(), "内旋(3rd)", -60, 120, 80, _INTERNAL),
    Measure("horizontal_flexion", "", texts.ROM_HORIZONTAL_FLEXION(), "水平屈曲", -30, 170, 135, _HORIZONTAL_ADDUCTION),
    Measure("horizontal_extension", "", texts.ROM_HORIZONTAL_EXTENSION(), "水平伸展", -60, 90, 30),
    Measure("scapular_flexion", "", texts.ROM_SCAPULAR_FLEXION(), "肩甲帯 屈曲", -20, 60, 20),
    Measure("scapular_extension", "", texts.ROM_SCAPULAR_EXTENSION(), "肩甲帯 伸展", -20, 60, 20),
    Measure("scapular_elevation", "", texts.ROM_SCAPULAR_ELEVATION(), "肩甲帯 挙上", -20, 60, 20),
    Measure("scapular_depression", "", texts.ROM_SCAPULAR_DEPRESSION(), "肩甲帯 引き下げ", -20, 60, 10),
)
"""In the order in which the form asks for them."""

_BY_KEY: Final[dict[tuple[str, str], Measure]] = {(measure.motion, measure.position): measure for measure in MEASURES}
_PLACES: Final[dict[tuple[str, str], int]] = {key: place for place, key in enumerate(_BY_KEY)}


def measure_of(motion: str, position: str) -> Measure | None:
    """Return the measure of a motion with the arm in a position, None if there is none."""
    return _BY_KEY.get((motion, position))


def positions_of(motion: MotionId) -> tuple[Position, ...]:
    """Return the positions of the arm in which a motion is measured. Only the empty one if the position does not matter."""
    return tuple(measure.position for measure in MEASURES if measure.motion == motion)


def place_of(motion: str, position: str) -> int:
    """Return the place in :data:`MEASURES`. The end for a measure that only an older version knew."""
    return _PLACES.get((motion, position), len(MEASURES))
