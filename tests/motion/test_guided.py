"""A motion whose scapula follows the rhythm of the sound side."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kata.device.config import simulated
from kata.motion.axes import Side
from kata.motion.edit import EditError, Motion
from kata.motion.guided import GuidingMotion, guided
from kata.motion.linkage import Floats, motor_angles_deg, pose_deg
from kata.motion.method import reference
from kata.motion.rhythm import lead, rhythm_of_poses
from kata.motion.shoulder import humerus_direction
from tests.support.rhythm_motions import abduction, evenly, times_of, wave

SOUND = evenly(wave(12.0, 88.0, 10.0), 4.0)


def motion(poses: Floats, side: Side = "left") -> Motion:
    return Motion(times_s=times_of(poses), angles_deg=motor_angles_deg(poses, side))


def rhythm(poses: Floats, name: str = "Sound arm") -> GuidingMotion:
    return GuidingMotion(name, rhythm_of_poses(times_of(poses), poses))


def shrugging(top_deg: float = 80.0) -> Floats:
    elevation = wave(12.0, top_deg, 8.0)
    return abduction(elevation, (elevation - 12.0) / 8 + 7.0 * ((elevation - 12.0) / 20.0).clip(0.0, 1.0))


@settings(max_examples=25, deadline=None)
@given(
    ratio=st.floats(3.5, 8.0),
    lowered_more_deg=st.floats(-2.0, 2.0),
    top_deg=st.floats(50.0, 85.0),
    side=st.sampled_from(["left", "right"]),
)
def test_scapula_follows_sound_side_and_arm_moves_as_before(
    ratio: float, lowered_more_deg: float, top_deg: float, side: Side
) -> None:
    elevation = wave(12.0, 88.0, 10.0)
    scapula = (elevation - 12.0) / (1 + ratio)
    half = len(elevation) // 2
    scapula[half:] += lowered_more_deg * np.sin(np.linspace(0.0, np.pi, len(elevation) - half))
    own = shrugging(top_deg)
    made = guided(motion(own, side), side, [rhythm(abduction(elevation, scapula))])
    poses = pose_deg(made.angles_deg, side)
    assert humerus_direction(poses) == pytest.approx(humerus_direction(own), abs=1e-6)
    assert poses[0] == pytest.approx(own[0], abs=1e-6)
    assert poses[:, [0, 3, 4]] == pytest.approx(own[:, [0, 3, 4]], abs=1e-6)
    found = lead(rhythm_of_poses(made.times_s, poses), rhythm(abduction(elevation, scapula)).rhythm)
    assert found is not None
    assert abs(found.largest_deg) < 0.5
    # The station can play it like the taught motion.
    simulated("virtual").check_reference("smooth", reference("smooth", made.times_s, made.angles_deg), side)


def test_lowering_follows_the_curve_of_lowering_without_a_jump() -> None:
    elevation = wave(12.0, 88.0, 10.0)
    scapula = (elevation - 12.0) / 5
    half = len(elevation) // 2
    scapula[half:] -= 3.0 * np.sin(np.linspace(0.0, np.pi, len(elevation) - half))
    own = shrugging(70.0)
    poses = pose_deg(guided(motion(own), "left", [rhythm(abduction(elevation, scapula))]).angles_deg, "left")
    passes = {one.widest.direction: one.widest for one in rhythm_of_poses(times_of(poses), poses).rhythms}
    at_40 = [
        float(np.interp(40.0, passes[name].elevation_deg, passes[name].scapula_deg)) for name in ("raising", "lowering")
    ]
    assert at_40[0] == pytest.approx(28.0 / 5, abs=0.3)
    assert at_40[0] - at_40[1] > 2.0
    assert np.abs(np.diff(poses[:, 1])).max() < 0.25


def test_first_recording_in_the_same_plane_guides() -> None:
    flexion = SOUND.copy()
    flexion[:, [2, 3]] = flexion[:, [3, 2]]
    made = guided(motion(shrugging()), "left", [rhythm(flexion, "Forward"), rhythm(SOUND, "Sideways")])
    assert made.done == ("scapula guided by the unaffected side, Sideways",)


def test_sound_side_that_was_only_raised_guides_both_ways() -> None:
    made = guided(motion(shrugging(70.0)), "left", [rhythm(SOUND[:501])])
    poses = pose_deg(made.angles_deg, "left")
    elevation = wave(12.0, 70.0, 8.0)
    settled = elevation > 20.0
    assert poses[settled, 1] == pytest.approx((elevation[settled] - 12.0) / 5, abs=0.3)


@pytest.mark.parametrize(
    ("own", "sound", "message"),
    [
        (shrugging(35.0), [rhythm(SOUND)], "not raised or lowered by at least 30°"),
        (shrugging(), [], "none of the newest recordings"),
        (shrugging(95.0), [rhythm(SOUND, "Short")], "raised to 95°, but only to 88° in .* Short"),
    ],
)
def test_motion_that_cannot_be_guided_is_refused(own: Floats, sound: list[GuidingMotion], message: str) -> None:
    with pytest.raises(EditError, match=message):
        guided(motion(own), "left", sound)


def test_guided_motion_keeps_its_parent_unchanged() -> None:
    own = motion(shrugging())
    before = own.angles_deg.copy()
    guided(own, "left", [rhythm(SOUND)])
    assert np.array_equal(own.angles_deg, before)
