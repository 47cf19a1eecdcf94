"""The upper arm's direction, and the effect of motor 4 on it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kata.motion.axes import BASIC_MOTIONS, POSE_RANGE_DEG, Side
from kata.motion.shoulder import humerus_direction, motion_of_motor_4

FORWARD, LEFTWARD, UP = np.eye(3)


@pytest.mark.parametrize(("side", "outward"), [("right", -LEFTWARD), ("left", LEFTWARD)])
def test_the_three_positions_of_the_paper(side: Side, outward: np.ndarray) -> None:
    hanging, lifted_sideways, lifted_forward = [0, 0, 0, 0, 0], [0, 0, 90, 0, 0], [0, 0, 0, 90, 0]

    assert humerus_direction(hanging, side) == pytest.approx(-UP)
    assert humerus_direction(lifted_sideways, side) == pytest.approx(outward)
    assert humerus_direction(lifted_forward, side) == pytest.approx(FORWARD)
    assert humerus_direction([0, 0, 90, 90, 0], side) == pytest.approx(FORWARD)


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_scapula_carries_the_arm(side: Side) -> None:
    assert humerus_direction([20, 0, 90, 0, 0], side) @ FORWARD == pytest.approx(np.sin(np.radians(20)))
    assert humerus_direction([0, 20, 90, 0, 0], side) @ UP == pytest.approx(np.sin(np.radians(20)))


def test_direction_matches_the_links_turned_one_after_another() -> None:
    lowest, highest = np.array(POSE_RANGE_DEG).T
    poses = np.random.default_rng(2).uniform(lowest, highest, size=(200, 5))
    # Each axis' direction on a right shoulder: forward is about +Z, up and away about -X, forward again about -Y.
    turned = (
        Rotation.from_rotvec(poses[:, [0]] * UP, degrees=True)
        * Rotation.from_rotvec(-poses[:, [1]] * FORWARD, degrees=True)
        * Rotation.from_rotvec(-poses[:, [2]] * FORWARD, degrees=True)
        * Rotation.from_rotvec(-poses[:, [3]] * LEFTWARD, degrees=True)
    )
    directions = humerus_direction(poses, "right")

    assert directions == pytest.approx(turned.apply(-UP), abs=1e-12)
    assert humerus_direction(poses, "left") == pytest.approx(directions * [1, -1, 1], abs=1e-12)
    assert np.linalg.norm(directions, axis=-1) == pytest.approx(1.0)


@pytest.mark.parametrize("abduction_deg", [0.0, 20.0, 44.0, 46.0, 70.0, 90.0, 120.0])
def test_motor_4_is_named_after_its_plane_of_motion(abduction_deg: float) -> None:
    number = int(motion_of_motor_4(abduction_deg))

    by_motor_4 = humerus_direction([0, 0, abduction_deg, 10, 0]) - humerus_direction([0, 0, abduction_deg, -10, 0])
    before = humerus_direction([0, 0, abduction_deg, 0, 0])
    axis = np.cross(before, by_motor_4)
    upright = abs(axis @ UP) > abs(axis @ LEFTWARD)
    assert BASIC_MOTIONS[number - 1].name.startswith("Horizontal flexion" if upright else "Flexion")
    assert BASIC_MOTIONS[number - 1].motors == (4,)


def test_a_whole_motion_is_named_row_by_row() -> None:
    assert motion_of_motor_4([0.0, 44.9, 45.0, 90.0]).tolist() == [5, 5, 3, 3]
