"""A motion of one shoulder on the other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from kata.device.config import StationConfig
from kata.motion.axes import APPARATUS_SIGNS, POSE_RANGE_DEG, Side
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import motor_angles_deg, pose_deg
from kata.motion.sides import mirrored_deg
from kata.motion.taught import Taught
from kata.motion.trajectory import AxisLimits, Trajectory, TrajectoryError
from tests.support.examples import examples

FORWARD, LEFTWARD, UP = np.eye(3)
OUTWARD: dict[Side, np.ndarray] = {"right": -LEFTWARD, "left": LEFTWARD}
SIDES = st.sampled_from(("right", "left"))
POSES = arrays(
    np.float64,
    st.tuples(st.integers(1, 5), st.just(5)),
    elements=st.floats(0, 1),
).map(lambda share: np.array(POSE_RANGE_DEG)[:, 0] + share * np.ptp(POSE_RANGE_DEG, axis=1))


def _limits() -> list[AxisLimits]:
    return [AxisLimits(axis.min_deg, axis.max_deg, axis.max_speed_deg_s) for axis in StationConfig().axes]


@examples(few=30, many=300)
@given(POSES, SIDES, SIDES)
def test_mirroring_twice_changes_nothing(poses: np.ndarray, here: Side, there: Side) -> None:
    theta = motor_angles_deg(poses, here)
    back = mirrored_deg(mirrored_deg(theta, here, there), there, here)
    assert back == pytest.approx(theta, abs=1e-9, rel=0)


@examples(few=30, many=300)
@given(POSES, SIDES, SIDES)
def test_other_shoulder_takes_the_same_pose(poses: np.ndarray, here: Side, there: Side) -> None:
    mirrored = mirrored_deg(motor_angles_deg(poses, here), here, there)
    assert pose_deg(mirrored, there) == pytest.approx(poses, abs=1e-9, rel=0)
    # Motors 3-5 have the body's sign.
    assert mirrored[:, 2:] == pytest.approx(poses[:, 2:])


@pytest.mark.parametrize("motion", built_in_motions(), ids=lambda motion: motion.name)
@pytest.mark.parametrize(("here", "there"), [("right", "left"), ("left", "right")])
def test_built_in_motion_of_one_side_plays_on_the_other(motion: Taught, here: Side, there: Side) -> None:
    mirrored = mirrored_deg(motor_angles_deg(motion.poses_deg, here), here, there)
    Trajectory(motion.times_s, mirrored).check(_limits(), 0.0)


def test_limits_are_checked_after_mirroring() -> None:
    # Given a motion into a corner of what the right side's motors may do: motor 2 at its lower end, psi near +26 deg,
    times_s = np.linspace(0.0, 5.0, 51)
    start, end = motor_angles_deg([0.0, 0.0, 10.0, 0.0, 0.0]), np.array([30.0, 88.5, 10.0, 0.0, 0.0])
    taught = start + (end - start) * (times_s[:, np.newaxis] / 5.0)
    Trajectory(times_s, taught).check(_limits(), 0.0)

    # when it is mirrored, then the other side's motor 2 would have to go beyond its upper end, and that is refused.
    with pytest.raises(TrajectoryError, match=r"motor 2 would go to 13\d\.\d° .* its range is 88 to 129°"):
        Trajectory(times_s, mirrored_deg(taught, "right", "left")).check(_limits(), 0.0)


def _anatomical_axes(side: Side) -> np.ndarray:
    """Return the axes in space about which the five angles of a pose grow, (5, 3), from the effect of each on a part of
    the body.

    ``cross(part, where it goes)`` is the axis about which the part moves there.
    """
    outward = OUTWARD[side]
    return np.array(
        [
            np.cross(outward, FORWARD),  # abduction of the scapula moves the shoulder forward
            np.cross(outward, UP),  # upward rotation lifts it
            np.cross(-UP, outward),  # abduction lifts the hanging arm sideways
            np.cross(-UP, FORWARD),  # flexion lifts it forward
            np.cross(FORWARD, outward),  # external rotation moves the bent forearm, which points forward, outward
        ]
    )


def test_signs_follow_from_anatomy() -> None:
    # The apparatus has made half a turn about X: its view of the left body is that of the right one, or its opposite.
    turn = Rotation.from_rotvec(180 * FORWARD, degrees=True)
    right = _anatomical_axes("right")
    left = turn.inv().apply(_anatomical_axes("left"))
    signs = np.sum(right * left, axis=-1)

    assert np.abs(signs) == pytest.approx(1.0)
    assert signs == pytest.approx(np.array(APPARATUS_SIGNS["left"]) / np.array(APPARATUS_SIGNS["right"]))


@examples(few=30, many=300)
@given(arrays(np.float64, 5, elements=st.floats(-170, 170)))
def test_signs_follow_from_rotation_matrices(angles_deg: np.ndarray) -> None:
    # Given the arm's rotation on the right, link after link, reflected in the sagittal plane and seen from the turned
    # apparatus,
    axes = _anatomical_axes("right")
    mirror, turn = np.diag([1.0, -1.0, 1.0]), Rotation.from_rotvec(180 * FORWARD, degrees=True).as_matrix()
    seen = turn.T @ mirror @ _chain(axes, angles_deg) @ mirror @ turn

    # then it is the same links' rotation with the signs turned.
    assert _chain(axes, angles_deg * np.array(APPARATUS_SIGNS["left"])) == pytest.approx(seen, abs=1e-12)


def _chain(axes: np.ndarray, angles_deg: np.ndarray) -> np.ndarray:
    rotation = Rotation.identity()
    for axis, angle in zip(axes, angles_deg, strict=True):
        rotation = rotation * Rotation.from_rotvec(angle * axis, degrees=True)
    return rotation.as_matrix()
