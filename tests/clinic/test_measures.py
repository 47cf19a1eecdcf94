"""The tables of measurements, and the score of the SPADI by worked examples."""

import pytest

from kata.clinic.assessments import rom, spadi
from kata.clinic.assessments.spadi import SpadiScore


@pytest.mark.parametrize(
    ("motion", "position", "reference_deg"),
    [
        ("flexion", "", 180),
        ("extension", "", 50),
        ("abduction", "", 180),
        ("adduction", "", 0),
        ("external_rotation", "at_side", 60),
        ("internal_rotation", "at_side", 80),
        ("external_rotation", "abducted_90", 90),
        ("internal_rotation", "abducted_90", 70),
        ("external_rotation", "flexed_90", 25),
        ("internal_rotation", "flexed_90", 80),
        ("horizontal_flexion", "", 135),
        ("horizontal_extension", "", 30),
        ("scapular_elevation", "", 20),
        ("scapular_depression", "", 10),
    ],
)
def test_healthy_shoulder_reaches_the_reference_values(motion: str, position: str, reference_deg: float) -> None:
    measure = rom.measure_of(motion, position)
    assert measure is not None
    assert measure.reference_deg == reference_deg


def test_every_measure_has_both_names_and_a_plausible_range() -> None:
    for names in ({measure.english for measure in rom.MEASURES}, {measure.japanese for measure in rom.MEASURES}):
        assert len(names) == len(rom.MEASURES)
    for measure in rom.MEASURES:
        # A supple shoulder goes further than the reference, a stiff one does not reach neutral.
        assert measure.lowest_deg < 0 <= measure.reference_deg < measure.highest_deg, measure


def test_only_rotation_asks_where_the_arm_was() -> None:
    for motion in {measure.motion for measure in rom.MEASURES}:
        rotation = motion in ("external_rotation", "internal_rotation")
        assert rom.positions_of(motion) == (("at_side", "abducted_90", "flexed_90") if rotation else ("",))
    assert rom.measure_of("flexion", "at_side") is None
    assert rom.measure_of("external_rotation", "") is None


def test_the_codes_are_those_of_the_motion_whatever_the_position() -> None:
    codes = {(measure.motion, measure.loinc.active, measure.loinc.passive) for measure in rom.MEASURES if measure.loinc}
    assert codes == {
        ("flexion", "41389-8", "41390-6"),
        ("extension", "41385-6", "41386-4"),
        ("abduction", "41381-5", "41382-3"),
        ("external_rotation", "41387-2", "41388-0"),
        ("internal_rotation", "41391-4", "41392-2"),
        ("horizontal_flexion", "", "56046-6"),
    }


@pytest.mark.parametrize(
    ("pain", "disability", "expected"),
    [
        ([0] * 5, [0] * 8, SpadiScore(0, 0, 0)),
        ([10] * 5, [10] * 8, SpadiScore(100, 100, 100)),
        # 30 of 50 points, 24 of 80: both subscales have the same weight, independent of their number of items.
        ([8, 7, 6, 5, 4], [3] * 8, SpadiScore(60, 30, 45)),
        # One answer is missing: 24 of 40 points.
        ([8, None, 6, 6, 4], [3] * 8, SpadiScore(60, 30, 45)),
        ([None, 6, 6, 6, 6], [None, 4, 4, 4, 3, 2, 2, 2], SpadiScore(60, 30, 45)),
        ([None, None, 6, 6, 6], [3] * 8, SpadiScore(60, 30, 45)),
        ([None, None, 6, 6, 6], [None] + [3] * 7, SpadiScore(None, None, None)),
        ([6] * 5, [None, None, None, 3, 3, 3, 3, 3], SpadiScore(None, None, None)),
        ([None] * 5, [None] * 8, SpadiScore(None, None, None)),
    ],
)
def test_score_is_the_mean_of_both_answered_subscales(
    pain: list[int | None], disability: list[int | None], expected: SpadiScore
) -> None:
    assert spadi.score(pain + disability) == expected


def test_five_pain_and_eight_disability_items_exist_in_both_languages() -> None:
    assert [item.subscale for item in spadi.ITEMS] == ["pain"] * 5 + ["disability"] * 8
    assert len({item.english for item in spadi.ITEMS} | {item.japanese for item in spadi.ITEMS}) == 26
