"""The reachable set and a doctor's limits of the arm, over a motion and for one setpoint."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kata.device.config import StationConfig
from kata.motion.axes import Side
from kata.motion.builtin import built_in_motions
from kata.motion.linkage import LINKAGE, motor_angles_deg
from kata.motion.method import reference
from kata.motion.pose_gate import PoseGate
from kata.motion.reach import ArmLimits, doctors_set, nearest, reachable_set
from kata.motion.scapula_fit import BALL_JOINT_DEG, FITTED_DEG, ball_joint_swing_deg, scapula_of
from kata.motion.trajectory import TrajectoryError
from tests.support.examples import examples
from tests.support.poses import DOCTORS, margin_of, random_limits, random_poses, true_beyond_deg

CONFIG = StationConfig()
SIDES: tuple[Side, Side] = ("right", "left")


def reach_deg(pose: Sequence[float], side: Side = "right") -> float:
    """Return the margin of one pose to the reachable set."""
    return nearest(motor_angles_deg([pose], side), lambda rows: reachable_set(rows, side)).margin_deg


def doctors_deg(pose: Sequence[float], limits: ArmLimits) -> float:
    return nearest(motor_angles_deg([pose]), lambda rows: doctors_set(rows, "right", limits)).margin_deg


# -- the scapula ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", SIDES)
def test_fitted_scapula_is_that_of_the_links(side: Side) -> None:
    poses = np.random.default_rng(1).uniform(-22.0, 22.0, (2000, 2))
    found = scapula_of(LINKAGE.inverse_deg(poses, side), side)
    assert np.column_stack(found[:2]) == pytest.approx(poses, abs=0.01)
    seen = poses * ([1.0, -1.0] if side == "left" else [1.0, 1.0])
    largest = ball_joint_swing_deg(seen).max(axis=1)
    far = largest > 25.0
    assert found.swing_deg[far] == pytest.approx(largest[far], abs=0.05)


def test_fit_never_takes_an_unreachable_scapula_for_a_reachable_one() -> None:
    (low_1, high_1), (low_2, high_2) = ((axis.min_deg - 10, axis.max_deg + 10) for axis in CONFIG.axes[:2])
    motors = np.random.default_rng(2).uniform([low_1, low_2], [high_1, high_2], (20_000, 2))
    found = scapula_of(motors, "right")
    inside = np.maximum(np.abs(found.phi_deg), np.abs(found.psi_deg)) < 22.0
    assert 0.2 < np.mean(inside) < 0.8
    back = LINKAGE.inverse_deg(np.column_stack(found[:2])[inside])
    assert back == pytest.approx(motors[inside], abs=0.02)
    assert FITTED_DEG > 22.0


def test_ball_joints_exceed_their_limit_only_in_the_corners() -> None:
    line = np.linspace(-20.0, 20.0, 41)
    square = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    swing = ball_joint_swing_deg(square)
    assert ball_joint_swing_deg(np.zeros((1, 2))) == pytest.approx(0.0, abs=1e-5)
    beyond = square[swing.max(axis=1) > BALL_JOINT_DEG]
    assert 0 < len(beyond) < 30
    assert np.all(np.abs(beyond).min(axis=1) > 16.5)


# -- the reachable set ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pose", "reached"),
    [
        ([0, 0, 90, 130, 0], True),
        ([0, 0, 90, 133, 0], False),
        ([0, 0, 90, 185, 0], False),
        ([0, 0, 90, -20, 0], True),
        ([0, 0, 0, 190, 0], True),
        ([0, 0, 10, 189, 0], True),
        ([0, 0, 0, -20, 0], True),
        ([0, 0, 46, 160, 0], False),
        ([0, 0, 120, 0, 0], True),
        ([0, 0, 120, 185, 0], False),
        ([20, 0, 10, 0, 0], True),
        ([23, 0, 10, 0, 0], False),
        ([0, -23, 10, 0, 0], False),
        ([20, -20, 10, 0, 0], True),
    ],
)
@pytest.mark.parametrize("side", SIDES)
def test_rows_of_the_table_are_reachable_to_their_ends_only(pose: list[float], reached: bool, side: Side) -> None:
    assert (reach_deg(pose, side) >= -CONFIG.pose_tolerance_deg) is reached


def test_margin_is_how_far_the_arm_may_still_turn() -> None:
    assert reach_deg([0, 0, 90, 100, 0]) == pytest.approx(min(30.0, 20.0), abs=0.01)
    assert reach_deg([15, 0, 90, 100, 0]) == pytest.approx(5.0, abs=0.01)
    assert reach_deg([0, 0, 90, 125, 0]) == pytest.approx(5.0, abs=0.01)


def test_built_in_motions_are_reachable() -> None:
    for side in SIDES:
        for taught in built_in_motions():
            path = reference("smooth", taught.times_s, motor_angles_deg(taught.poses_deg, side))
            CONFIG.check_reference("smooth", path, side)


def test_refusal_names_motor_angle_time_and_limit() -> None:
    times = np.arange(0.0, 8.001, 0.01)
    poses = np.tile([0.0, 0.0, 90.0, 0.0, 0.0], (len(times), 1))
    poses[:, 3] = 185.0 / 2 * (1 - np.cos(np.pi * times / 4))
    path = reference("smooth", times, motor_angles_deg(poses))
    with pytest.raises(TrajectoryError) as refused:
        CONFIG.check_reference("smooth", path, "right")
    assert str(refused.value) == (
        "motor 4 would go to 185.0° at 4.0 s; in this pose the plane of elevation would be 185.0°, and its limit is 130.0°"
    )
    assert refused.value.motor == 4
    assert refused.value.at_s == pytest.approx(4.0, abs=0.02)


# -- a doctor's limits ------------------------------------------------------------------------------------------------

BOTH = ArmLimits(side_deg=90.0, front_deg=90.0)


def test_elevation_counts_whichever_motor_raises_the_arm() -> None:
    for pose in ([0, 0, 44, 160, 0], [0, 0, 46, 160, 0], [0, 0, 0, 95, 0], [0, 0, 95, 0, 0], [0, 5, 88, 0, 0]):
        assert doctors_deg(pose, BOTH) < -2.0, pose
    for pose in ([0, 0, 89, 0, 0], [0, 0, 30, 88, 0], [0, 0, 91, 100, 0], [0, 0, 0, -20, 0], [0, -5, 92, 0, 0]):
        assert doctors_deg(pose, BOTH) > 0.0, pose


def test_elevation_limit_changes_in_proportion_between_the_planes() -> None:
    limits = ArmLimits(side_deg=60.0, front_deg=120.0)
    # Elevation 80.3 in the plane of 30 deg, where 80 are allowed.
    lifted = math.degrees(
        math.atan2(math.sin(math.radians(80.0)) * math.cos(math.radians(30.0)), math.cos(math.radians(80.0)))
    )
    flexion = math.degrees(math.asin(math.sin(math.radians(80.0)) * math.sin(math.radians(30.0))))
    assert doctors_deg([0, 0, lifted, flexion, 0], limits) == pytest.approx(0.0, abs=0.02)


def test_plane_limit_is_free_for_the_hanging_arm() -> None:
    limits = ArmLimits(plane_deg=(0.0, 60.0))
    for pose in ([0, 0, 0, -20, 0], [0, -10, 2, -15, 0], [0, 0, 10, 15, 0], [0, 0, 90, 55, 0]):
        assert doctors_deg(pose, limits) > 0.0, pose
    for pose in ([0, 0, 90, 65, 0], [0, 0, 10, 60, 0], [0, 0, 90, -5, 0], [10, 0, 90, 55, 0]):
        assert doctors_deg(pose, limits) < -3.0, pose


def test_extension_limit_widens_to_the_level_arm() -> None:
    limits = ArmLimits(flexion_from_deg=(0.0, -20.0))
    assert doctors_deg([0, 0, 0, -5, 0], limits) == pytest.approx(-5.0)
    assert doctors_deg([0, 0, 45, -5, 0], limits) == pytest.approx(5.0)
    assert doctors_deg([0, 0, 90, -15, 0], limits) == pytest.approx(5.0)


# -- properties -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", SIDES)
def test_bounds_agree_with_the_direction_of_the_arm(side: Side) -> None:
    rng = np.random.default_rng(3)
    for _ in range(4):
        poses, limits = random_poses(rng, 500), random_limits(rng)
        motors = motor_angles_deg(poses, side)
        assert margin_of(motors, side, None) == pytest.approx(-true_beyond_deg(poses, side, None), abs=0.05)
        assert margin_of(motors, side, limits) == pytest.approx(-true_beyond_deg(poses, side, limits), abs=0.05)


@examples(few=30, many=300)
@given(st.integers(0, 2**32 - 1), st.sampled_from(SIDES), st.booleans())
def test_gate_says_the_same_as_the_check_of_a_motion(seed: int, side: Side, with_doctor: bool) -> None:
    rng = np.random.default_rng(seed)
    limits = random_limits(rng) if with_doctor else None
    motors = motor_angles_deg(random_poses(rng, 20), side)
    gate = PoseGate(side, limits, CONFIG.pose_tolerance_deg)
    expected = -margin_of(motors, side, None) - CONFIG.pose_tolerance_deg
    if limits:
        expected = np.maximum(expected, -margin_of(motors, side, limits))
    assert [gate.beyond_deg(row) for row in motors.tolist()] == pytest.approx(expected, abs=1e-6)


@examples(few=30, many=300)
@given(st.integers(0, 2**32 - 1), st.sampled_from(SIDES))
def test_setpoint_beyond_a_limit_is_held_beside_it(seed: int, side: Side) -> None:
    rng = np.random.default_rng(seed)
    limits = random_limits(rng)
    gate = PoseGate(side, limits, CONFIG.pose_tolerance_deg)
    low, high = np.array(CONFIG.mechanism_deg).T
    inside = [row for row in motor_angles_deg(random_poses(rng, 40), side) if gate.beyond_deg(row) <= 0.0]
    for row in inside:
        ahead = np.clip(row + rng.uniform(-6.0, 6.0, 5), low, high)
        held = gate.held(ahead.tolist(), 0.0, low.tolist(), high.tolist())
        assert gate.beyond_deg(held) <= 0.1
        beyond = gate.beyond_deg(ahead)
        assert np.array_equal(held, ahead) is bool(beyond <= 0.0)
        assert np.all((low <= held) & (held <= high))


@pytest.mark.parametrize("limits", DOCTORS)
def test_arm_at_rest_is_inside_of_every_doctors_limits(limits: ArmLimits) -> None:
    assert doctors_deg([0, 0, 10, 0, 0], limits) > 0.0
