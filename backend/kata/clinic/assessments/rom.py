"""Range of motion: the measured motions, the positions of the arm, plausible angles, and the reference angles of a healthy shoulder.

Reference angles are those of the Japanese Orthopaedic Association and the Japanese Association of Rehabilitation Medicine, "Indication and
measurement of the range of motion of joints" (1995, revised 2022): Jpn J Rehabil Med 32, 207-217 and 58, 1188-1200. The reference for
rotation with the arm raised sideways is from the section on other methods. For rotation with the arm raised forward the publication has no
reference, so its value is that of the apparatus's motion 6 (Sun et al., Robotics 2025, 14, 12, Table 2).

For rotation with the arm at the side and with the arm raised sideways, zero is that of the Association: the forearm points forward, along
its basic axis, the perpendicular to the frontal plane. With the arm raised forward that axis is the upper arm itself, so the Association's
table defines no zero. Kata then uses the Association's zero with the arm at the side, raised forward without rotation: the elbow is bent to
90 deg and the forearm points straight up. We infer that Table 2 uses the same zero: Section 2.2 of the article gives about 10 deg of
external rotation with the arm raised sideways, where the Association counts 90 deg for the forearm that points up. Another zero is also in
use. It raises the arm sideways and then moves it forward: the forearm is level across the chest, and every angle differs by 90 deg
(:class:`OtherZero`).

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


_JOA: Final = "JOA and JARM 1995, revised 2022"
_JOA_OTHER: Final = "JOA and JARM 1995, revised 2022: other methods"
_TABLE_2: Final = "Sun et al. 2025, Table 2, motion 6"


@dataclass(frozen=True)
class Loinc:
    """LOINC codes of one motion. They do not state the side or the position of the arm."""

    active: str
    """Code of active motion; empty if we have not verified a code without a side."""
    passive: str


@dataclass(frozen=True)
class OtherZero:
    """A second zero that is also in use for the same measurement."""

    adds_deg: float
    """An angle that is counted from the second zero is larger by this."""
    fits_from_deg: float
    """An angle beyond this, in the direction of the second zero's angles, fits the second zero better."""


@dataclass(frozen=True)
class Measure:
    """One motion with the arm in one position, for either side, active or passive."""

    motion: MotionId
    position: Position
    """Position of the arm; empty if it makes no difference."""
    english: str
    japanese: str
    lowest_deg: float
    highest_deg: float
    reference_deg: float
    loinc: Loinc | None = None
    source: str = _JOA
    """Source of the reference."""
    other_zero: OtherZero | None = None

    def loinc_of(self, kind: str) -> str:
        """Return the LOINC code of ``active`` or ``passive`` motion; empty if we have verified none."""
        if self.loinc is None:
            return ""
        return self.loinc.active if kind == "active" else self.loinc.passive


_EXTERNAL: Final = Loinc("41387-2", "41388-0")
_INTERNAL: Final = Loinc("41391-4", "41392-2")
_HORIZONTAL_ADDUCTION: Final = Loinc("", "56046-6")
"""Horizontal flexion is LOINC's horizontal adduction: 56046-6, Shoulder Horizontal adduction Passive Range of Motion. Of the active codes we
have verified only the right shoulder's (56044-1)."""
_LEVEL_FOREARM_OUT: Final = OtherZero(adds_deg=90.0, fits_from_deg=45.0)
"""20 deg beyond the reference. We chose this margin, because a stiff shoulder does not turn farther outwards than a healthy one."""
_LEVEL_FOREARM_IN: Final = OtherZero(adds_deg=-90.0, fits_from_deg=35.0)
"""From this angle on, an angle is nearer to the reference of the other zero (-10) than to Kata's (80). A stiff shoulder can also have
such an angle.
"""

MEASURES: Final = (
    Measure("flexion", "", texts.ROM_FLEXION(), "屈曲", -20, 200, 180, Loinc("41389-8", "41390-6")),
    Measure("extension", "", texts.ROM_EXTENSION(), "伸展", -30, 90, 50, Loinc("41385-6", "41386-4")),
    Measure("abduction", "", texts.ROM_ABDUCTION(), "外転", -20, 200, 180, Loinc("41381-5", "41382-3")),
    Measure("adduction", "", texts.ROM_ADDUCTION(), "内転", -60, 90, 0),
    Measure("external_rotation", "at_side", texts.ROM_EXTERNAL_ROTATION_1(), "外旋(1st)", -60, 120, 60, _EXTERNAL),
    Measure("internal_rotation", "at_side", texts.ROM_INTERNAL_ROTATION_1(), "内旋(1st)", -60, 120, 80, _INTERNAL),
    Measure("external_rotation", "abducted_90", texts.ROM_EXTERNAL_ROTATION_2(), "外旋(2nd)", -60, 130, 90, _EXTERNAL, _JOA_OTHER),
    Measure("internal_rotation", "abducted_90", texts.ROM_INTERNAL_ROTATION_2(), "内旋(2nd)", -60, 120, 70, _INTERNAL, _JOA_OTHER),
    Measure(
        "external_rotation", "flexed_90", texts.ROM_EXTERNAL_ROTATION_3(), "外旋(3rd)", -60, 130, 25,
        _EXTERNAL, _TABLE_2, _LEVEL_FOREARM_OUT,
    ),
    Measure(
        "internal_rotation", "flexed_90", texts.ROM_INTERNAL_ROTATION_3(), "内旋(3rd)", -60, 120, 80,
        _INTERNAL, _TABLE_2, _LEVEL_FOREARM_IN,
    ),
    Measure("horizontal_flexion", "", texts.ROM_HORIZONTAL_FLEXION(), "水平屈曲", -30, 170, 135, _HORIZONTAL_ADDUCTION),
    Measure("horizontal_extension", "", texts.ROM_HORIZONTAL_EXTENSION(), "水平伸展", -60, 90, 30),
    Measure("scapular_flexion", "", texts.ROM_SCAPULAR_FLEXION(), "肩甲帯 屈曲", -20, 60, 20),
    Measure("scapular_extension", "", texts.ROM_SCAPULAR_EXTENSION(), "肩甲帯 伸展", -20, 60, 20),
    Measure("scapular_elevation", "", texts.ROM_SCAPULAR_ELEVATION(), "肩甲帯 挙上", -20, 60, 20),
    Measure("scapular_depression", "", texts.ROM_SCAPULAR_DEPRESSION(), "肩甲帯 引き下げ", -20, 60, 10),
)  # fmt: skip
"""All measures, in the order of the form."""

_BY_KEY: Final[dict[tuple[str, str], Measure]] = {(measure.motion, measure.position): measure for measure in MEASURES}
_PLACES: Final[dict[tuple[str, str], int]] = {key: place for place, key in enumerate(_BY_KEY)}


def measure_of(motion: str, position: str) -> Measure | None:
    """Return the measure of a motion with the arm in a position, or None if there is none."""
    return _BY_KEY.get((motion, position))


def positions_of(motion: MotionId) -> tuple[Position, ...]:
    """Return the positions of the arm in which a motion is measured. If the position makes no difference, return one empty position."""
    return tuple(measure.position for measure in MEASURES if measure.motion == motion)


def place_of(motion: str, position: str) -> int:
    """Return the index in :data:`MEASURES`, or its length for a measure that only an older version knew."""
    return _PLACES.get((motion, position), len(MEASURES))
