"""Scapulohumeral rhythm of the apparatus' links: known ratios are found, and every reason against a ratio is given."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kata.motion.axes import Side
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.rhythm import (
    AHEAD_DEG,
    LEAST_SCAPULA_DEG,
    BandRatio,
    MotionRhythm,
    Rhythm,
    lead,
    rhythm_of,
    rhythm_of_poses,
)
from kata.motion.shoulder import humerus_direction
from tests.support.rhythm_motions import RATE_HZ, abduction, evenly, times_of, wave

_ENCODER_STEP_DEG = 360 / 4096


def raising(motion: MotionRhythm) -> Rhythm:
    """Return the motion's only rhythm of raising."""
    (found,) = [rhythm for rhythm in motion.rhythms if rhythm.widest.direction == "raising"]
    return found


def band(poses: Floats, number: int = 0) -> BandRatio:
    """Return a band's ratio while the arm is raised."""
    return raising(rhythm_of_poses(times_of(poses), poses)).bands[number]


@settings(max_examples=60, deadline=None)
@given(
    ratio=st.floats(0.8, 30 / LEAST_SCAPULA_DEG - 1.2),
    top_deg=st.floats(65.0, 112.0),
    lasts_s=st.floats(4.0, 30.0),
    side=st.sampled_from(["left", "right"]),
)
def test_known_ratio_is_found_at_encoder_resolution(ratio: float, top_deg: float, lasts_s: float, side: Side) -> None:
    top_deg = min(top_deg, 12.0 + 19.0 * (1 + ratio))
    poses = evenly(wave(12.0, top_deg, lasts_s), ratio)
    motors = np.round(motor_angles_deg(poses, side) / _ENCODER_STEP_DEG) * _ENCODER_STEP_DEG
    found = rhythm_of(times_of(poses), motors, side)
    assert {rhythm.widest.direction for rhythm in found.rhythms} == {"raising", "lowering"}
    for rhythm in found.rhythms:
        given_ratios = [band.ratio for band in (*rhythm.bands, rhythm.whole) if band.ratio is not None]
        covered = sum(top_deg > high for _, high in ((30, 60), (60, 90), (90, 120)))
        if 12.0 + 18.0 * (1 + ratio) > 62.0:
            assert len(given_ratios) >= min(covered, 1)
        assert given_ratios == pytest.approx([ratio] * len(given_ratios), abs=0.2)


def test_ratio_of_each_phase_is_its_own() -> None:
    elevation = wave(10.0, 100.0, 10.0)
    scapula = np.interp(elevation, [10, 30, 60, 90, 100], [0, 0, 5, 15, 16])
    found = raising(rhythm_of_poses(times_of(evenly(elevation, 1.0)), abduction(elevation, scapula)))
    assert [ratio.ratio for ratio in found.bands[:2]] == pytest.approx([5.0, 2.0], abs=0.2)
    assert (found.bands[2].ratio, found.bands[2].reason) == (None, "not_covered")


def test_flexion_has_the_ratio_of_its_joint() -> None:
    joint = wave(5.0, 95.0, 10.0)
    zero = np.zeros_like(joint)
    poses = np.column_stack([zero, (joint - 5.0) / 5.5, zero, joint, zero])
    found = raising(rhythm_of_poses(times_of(poses), poses))
    assert found.widest.plane == "flexion"
    assert found.whole.ratio == pytest.approx(5.5, abs=0.2)
    assert found.reference is not None and (found.reference.source, found.reference.ratio) == ("giphart_2013", 1.1)


def test_elevation_in_the_joint_ignores_the_scapula() -> None:
    random = np.random.default_rng(3)
    poses = random.uniform([0, 0, 0, -20, -90], [0, 0, 120, 120, 40], (200, 5))
    by_direction = np.degrees(np.arccos(-humerus_direction(poses)[:, 2]))
    assert by_direction == pytest.approx(np.degrees(np.arccos(np.prod(np.cos(np.radians(poses[:, 2:4])), axis=1))))


def test_band_beyond_the_pass_is_not_covered() -> None:
    assert band(evenly(wave(10.0, 50.0, 5.0), 2.0)).reason == "not_covered"


def test_scapula_at_its_limit_gives_no_ratio() -> None:
    elevation = wave(10.0, 100.0, 10.0)
    poses = abduction(elevation, np.minimum((elevation - 10.0) / 3, 20.0))
    found = raising(rhythm_of_poses(times_of(poses), poses))
    assert [ratio.reason for ratio in found.bands] == [None, "at_limit", "not_covered"]
    assert found.whole.ratio == pytest.approx(2.0, abs=0.2)
    assert found.whole.to_deg < 70.0


@pytest.mark.parametrize(
    ("scapula_end_deg", "reason"), [(2.0, "scapula_still"), (-9.0, "scapula_reversed"), (19.0, None)]
)
def test_still_or_reversed_scapula_gives_a_reason(scapula_end_deg: float, reason: str | None) -> None:
    elevation = wave(25.0, 62.0, 5.0)
    poses = abduction(elevation, (elevation - 25.0) / 37.0 * scapula_end_deg)
    assert band(poses).reason == reason


def test_joint_that_turns_back_gives_a_reason() -> None:
    elevation = wave(28.0, 60.5, 5.0)
    poses = abduction(elevation, (elevation - 28.0) * 1.1 - 18.0)
    assert band(poses).reason == "joint_reversed"


def test_frozen_joint_has_a_ratio_near_zero() -> None:
    elevation = wave(28.0, 62.0, 5.0)
    poses = abduction(elevation, (elevation - 28.0) * 0.95 - 15.0)
    assert band(poses).ratio == pytest.approx(0.05, abs=0.05)


def test_hesitating_hand_does_not_split_a_pass() -> None:
    elevation = wave(12.0, 80.0, 10.0) + 3.0 * np.sin(np.linspace(0, 40, 1001))
    found = rhythm_of_poses(times_of(evenly(elevation, 2.0)), abduction(elevation, (elevation - 12.0) / 4))
    assert [(rhythm.widest.direction, rhythm.passes) for rhythm in found.rhythms] == [("raising", 1), ("lowering", 1)]


def test_ratio_of_repetitions_is_their_median() -> None:
    poses = np.concatenate([evenly(wave(12.0, 80.0, 6.0), ratio) for ratio in (2.8, 3.0, 6.0)])
    found = raising(rhythm_of_poses(times_of(poses), poses))
    assert (found.passes, found.bands[0].passes) == (3, 3)
    assert found.bands[0].ratio == pytest.approx(3.0, abs=0.1)


def test_gap_without_samples_ends_a_pass() -> None:
    poses = evenly(wave(12.0, 80.0, 10.0), 2.0)
    kept = np.r_[0:250, 400:1001]
    found = rhythm_of_poses(times_of(poses)[kept], poses[kept])
    assert all(
        rhythm.widest.direction == "lowering" or np.ptp(rhythm.widest.elevation_deg) < 45 for rhythm in found.rhythms
    )


def test_shrug_without_a_raised_arm_has_no_rhythm() -> None:
    scapula = wave(0.0, 15.0, 3.0)
    found = rhythm_of_poses(times_of(scapula), abduction(np.full_like(scapula, 16.0), scapula))
    assert found.rhythms == ()
    assert found.scapula_range_deg == pytest.approx((0.0, 15.0))


@settings(max_examples=30, deadline=None)
@given(shrug_deg=st.floats(0.0, 12.0), ends_deg=st.floats(20.0, 35.0))
def test_scapula_that_runs_ahead_is_found(shrug_deg: float, ends_deg: float) -> None:
    elevation = wave(12.0, 70.0, 8.0)
    sound = (elevation - 12.0) / 10.0
    own = sound + shrug_deg * np.clip((elevation - 12.0) / (ends_deg - 12.0), 0.0, 1.0)
    times = np.arange(len(elevation)) / RATE_HZ
    found = lead(rhythm_of_poses(times, abduction(elevation, own)), rhythm_of_poses(times, abduction(elevation, sound)))
    assert found is not None
    assert found.largest_deg == pytest.approx(shrug_deg, abs=0.2)
    assert (found.ahead_from_deg is not None) == (found.largest_deg > AHEAD_DEG)
    if shrug_deg > AHEAD_DEG + 0.5:
        assert found.ahead_from_deg == pytest.approx(12.0 + AHEAD_DEG / shrug_deg * (ends_deg - 12.0), abs=2.0)


def test_lead_ignores_where_the_board_was_fitted() -> None:
    elevation = wave(12.0, 70.0, 8.0)
    times = np.arange(len(elevation)) / RATE_HZ
    scapula = (elevation - 12.0) / 6.0
    own, sound = (rhythm_of_poses(times, abduction(elevation, scapula + off)) for off in (5.0, -2.0))
    found = lead(own, sound)
    assert found is not None and found.largest_deg == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize(
    "sound",
    [
        pytest.param(evenly(wave(40.0, 90.0, 8.0), 4.0), id="starts raised"),
        pytest.param(evenly(wave(12.0, 45.0, 8.0), 4.0), id="too little in common"),
        pytest.param(
            np.column_stack([*np.zeros((2, 801)), np.zeros(801), wave(12.0, 70.0, 8.0), np.zeros(801)]),
            id="other plane",
        ),
    ],
)
def test_motions_that_differ_are_not_compared(sound: Floats) -> None:
    own = evenly(wave(22.0, 70.0, 8.0), 4.0)
    assert lead(rhythm_of_poses(times_of(own), own), rhythm_of_poses(times_of(sound), sound)) is None


def test_reference_fits_plane_and_direction() -> None:
    joint = wave(5.0, 95.0, 10.0)
    turned = np.radians((joint - 5.0) / 90.0 * 85.0)
    # The plane of elevation turns from the side to the front.
    away = np.sin(np.radians(joint))
    flexion = np.degrees(np.arcsin(away * np.sin(turned)))
    sideways = np.degrees(np.arctan2(away * np.cos(turned), np.cos(np.radians(joint))))
    zero = np.zeros_like(joint)
    changing = np.column_stack([zero, joint / 8, sideways - joint / 8, flexion, zero])
    sources = {
        rhythm.widest.direction: rhythm.reference for rhythm in rhythm_of_poses(times_of(changing), changing).rhythms
    }
    assert {name: found and (found.source, found.ratio) for name, found in sources.items()} == {
        "raising": ("braman_2009", 2.3),
        "lowering": ("braman_2009", 2.7),
    }
    plain = rhythm_of_poses(times_of(changing), evenly(wave(12.0, 80.0, 10.0), 4.0))
    assert {rhythm.widest.direction: rhythm.reference and rhythm.reference.ratio for rhythm in plain.rhythms} == {
        "raising": 2.0,
        "lowering": None,
    }
