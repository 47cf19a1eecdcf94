"""The scapula's parallel links."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kata.device.config import StationConfig
from kata.motion.axes import APPARATUS_SIGNS, POSE_RANGE_DEG, Side
from kata.motion.linkage import LINKAGE, WITHIN_DEG, Linkage, OutOfReachError, motor_angles_deg, pose_deg
from tests.support.examples import examples

SIDES: tuple[Side, ...] = ("right", "left")


def _motor_ranges(beyond_deg: float = 0.0) -> tuple[tuple[float, float], tuple[float, float]]:
    one, two = StationConfig().axes[:2]
    return (one.min_deg - beyond_deg, one.max_deg + beyond_deg), (two.min_deg - beyond_deg, two.max_deg + beyond_deg)


def _grid(limit_deg: float, n: int = 81) -> np.ndarray:
    phi, psi = np.meshgrid(np.linspace(-limit_deg, limit_deg, n), np.linspace(-limit_deg, limit_deg, n))
    return np.stack([phi, psi], axis=-1)


def _closes(scapula_deg: np.ndarray, side: Side = "right") -> np.ndarray:
    return np.asarray(np.all(np.isfinite(LINKAGE.closed_deg(scapula_deg, side)), axis=-1))


def _jacobian(scapula_deg: np.ndarray) -> np.ndarray:
    """Return d(theta1, theta2) / d(phi, psi) ``(..., 2, 2)`` by central differences; NaN where a leg does not close."""
    h = 1e-4
    slopes = [
        (LINKAGE.closed_deg(scapula_deg + step, "right") - LINKAGE.closed_deg(scapula_deg - step, "right")) / (2 * h)
        for step in (np.array([h, 0.0]), np.array([0.0, h]))
    ]
    return np.stack(slopes, axis=-1)


def _rod_lengths_mm(scapula_deg: np.ndarray, theta_deg: np.ndarray) -> np.ndarray:
    """Return |QiPi| computed from the points themselves: the loop closure of Eqs. 1-4, without any algebra."""
    phi, psi = np.radians(scapula_deg[..., 0]), np.radians(scapula_deg[..., 1])
    t1, t2 = np.radians(theta_deg[..., 0]), np.radians(theta_deg[..., 1])
    zero = np.zeros_like(phi)

    def board(length_mm: float, offset_deg: float) -> np.ndarray:
        tilt = psi + np.radians(offset_deg)
        return length_mm * np.stack([np.sin(tilt) * np.cos(phi), np.sin(tilt) * np.sin(phi), np.cos(tilt)], axis=-1)

    p1 = np.array(LINKAGE.oo1_mm) + LINKAGE.o1p1_mm * np.stack([np.sin(t1), np.cos(t1), zero], axis=-1)
    p2 = np.array(LINKAGE.oo2_mm) + LINKAGE.o2p2_mm * np.stack([zero, np.sin(t2), -np.cos(t2)], axis=-1)
    rod1 = np.linalg.norm(p1 - board(LINKAGE.oq1_mm, LINKAGE.w1_deg), axis=-1)
    rod2 = np.linalg.norm(p2 - board(LINKAGE.oq2_mm, LINKAGE.w2_deg), axis=-1)
    return np.stack([rod1, rod2], axis=-1)


def test_the_loops_close_over_the_whole_region() -> None:
    scapula = _grid(24.0)
    rods = _rod_lengths_mm(scapula, LINKAGE.inverse_deg(scapula))

    assert rods[..., 0] == pytest.approx(LINKAGE.q1p1_mm, abs=1e-9)
    assert rods[..., 1] == pytest.approx(LINKAGE.q2p2_mm, abs=1e-9)


def test_neighbouring_poses_have_neighbouring_motor_angles() -> None:
    theta = LINKAGE.inverse_deg(_grid(24.0))
    spacing_deg = 48 / 80
    assert np.abs(np.diff(theta, axis=0)).max() < 1.6 * spacing_deg
    assert np.abs(np.diff(theta, axis=1)).max() < 1.6 * spacing_deg


def test_default_limits_contain_the_image_of_the_scapulas_range() -> None:
    theta = LINKAGE.inverse_deg(_grid(20.0)).reshape(-1, 2)
    for n, axis in enumerate(StationConfig().axes[:2]):
        assert axis.min_deg <= theta[:, n].min() < axis.min_deg + 3
        assert axis.max_deg - 3 < theta[:, n].max() <= axis.max_deg
    for axis, (low, high) in zip(StationConfig().axes[2:], POSE_RANGE_DEG[2:], strict=True):
        assert (axis.min_deg, axis.max_deg) == (low, high)


def test_out_of_reach_names_the_row_and_the_motor() -> None:
    short = Linkage(q1p1_mm=80.0)
    with pytest.raises(OutOfReachError, match=r"motor 1 cannot reach .* -20.0° .* \(row 1\)") as caught:
        short.inverse_deg([[0.0, 0.0], [-20.0, -20.0]])
    assert (caught.value.motor, caught.value.index) == (1, 1)


def test_first_unreachable_row_is_named_whichever_motor_it_concerns() -> None:
    with pytest.raises(OutOfReachError, match=r"motor 2 .* with upward rotation -44.0° \(row 1\)") as caught:
        LINKAGE.inverse_deg([[0.0, 0.0], [0.0, -44.0], [150.0, 0.0]])
    assert (caught.value.motor, caught.value.index) == (2, 1)


def test_unreachable_pose_is_reported_as_requested_on_both_sides() -> None:
    with pytest.raises(OutOfReachError, match=r"upward rotation 44.0°"):
        motor_angles_deg([0.0, 44.0, 0.0, 0.0, 0.0], "left")


def test_motor_angles_that_no_pose_has_are_named() -> None:
    with pytest.raises(OutOfReachError, match=r"motor 1 at 170.0° and motor 2 at 100.0° \(row 2\)") as caught:
        LINKAGE.forward_deg([[10.0, 100.0], [15.0, 109.0], [170.0, 100.0]])
    assert (caught.value.motor, caught.value.index) == (None, 2)


@pytest.mark.parametrize("unknown", [np.nan, np.inf])
def test_value_that_is_no_number_is_out_of_reach(unknown: float) -> None:
    with pytest.raises(OutOfReachError):
        LINKAGE.inverse_deg([0.0, unknown])
    with pytest.raises(OutOfReachError):
        LINKAGE.forward_deg([unknown, 100.0])


@pytest.mark.parametrize("side", SIDES)
def test_both_ways_agree_over_the_whole_region(side: Side) -> None:
    scapula = _grid(WITHIN_DEG, 241).reshape(-1, 2)
    scapula = scapula[_closes(scapula, side)]
    assert len(scapula) > 0.9 * 241**2

    theta = LINKAGE.inverse_deg(scapula, side)
    assert np.radians(LINKAGE.forward_deg(theta, side)) == pytest.approx(np.radians(scapula), abs=1e-9, rel=0)


def test_every_allowed_motor_position_has_a_pose_that_reproduces_it() -> None:
    # Measured angles may exceed the range by the tolerance.
    ends = _motor_ranges(beyond_deg=StationConfig().limit_tolerance_deg)
    theta = np.stack(np.meshgrid(*(np.linspace(*end, 121) for end in ends)), axis=-1)

    scapula = LINKAGE.forward_deg(theta)
    assert scapula.shape == theta.shape
    assert np.radians(LINKAGE.inverse_deg(scapula)) == pytest.approx(np.radians(theta), abs=1e-9, rel=0)


@examples(few=30, many=300)
@given(st.floats(-WITHIN_DEG, WITHIN_DEG), st.floats(-WITHIN_DEG, WITHIN_DEG), st.sampled_from(SIDES))
def test_both_ways_agree_at_any_pose(phi: float, psi: float, side: Side) -> None:
    assume(_closes(np.array([phi, psi]), side))
    back = LINKAGE.forward_deg(LINKAGE.inverse_deg([phi, psi], side), side)
    assert np.radians(back) == pytest.approx(np.radians([phi, psi]), abs=1e-9, rel=0)


def test_linkage_has_no_singularity_within_its_reach() -> None:
    scapula = _grid(WITHIN_DEG, 181).reshape(-1, 2)
    jacobian = _jacobian(scapula[_closes(scapula)])
    jacobian = jacobian[np.all(np.isfinite(jacobian), axis=(-2, -1))]
    assert len(jacobian) > 0.9 * len(scapula)
    assert np.linalg.det(jacobian).min() > 0.5


def test_path_of_motor_angles_gives_a_scapula_path_without_jumps() -> None:
    (low1, high1), (low2, high2) = _motor_ranges(beyond_deg=StationConfig().limit_tolerance_deg)
    turn = np.linspace(0, 2 * np.pi, 4001)
    # A Lissajous figure that touches every end of both ranges.
    theta = np.stack(
        [
            (low1 + high1) / 2 + (high1 - low1) / 2 * np.sin(3 * turn),
            (low2 + high2) / 2 + (high2 - low2) / 2 * np.sin(4 * turn + 0.3),
        ],
        axis=-1,
    )
    step_deg = np.linalg.norm(np.diff(theta, axis=0), axis=-1)
    moved_deg = np.linalg.norm(np.diff(LINKAGE.forward_deg(theta), axis=0), axis=-1)
    # 1 / 0.6: the smallest singular value of the Jacobian over the motors' ranges is above 0.6.
    assert np.all(moved_deg < step_deg / 0.6)


def test_the_jacobian_is_well_conditioned_over_the_scapulas_range() -> None:
    stretch = np.linalg.svd(_jacobian(_grid(24.0)), compute_uv=False)
    assert stretch.min() == pytest.approx(0.67, abs=0.005)
    assert stretch.max() == pytest.approx(1.54, abs=0.005)


def test_motors_three_to_five_turn_with_the_body() -> None:
    pose = np.array([[5.0, -5.0, 40.0, 90.0, -30.0]])
    assert motor_angles_deg(pose)[0, 2:] == pytest.approx([40.0, 90.0, -30.0])
    assert motor_angles_deg(pose)[0, :2] == pytest.approx(LINKAGE.inverse_deg([5.0, -5.0]))


def test_the_turned_linkage_sees_upward_rotation_as_downward() -> None:
    assert motor_angles_deg([5.0, -12.0, 40.0, 90.0, -30.0], "left") == pytest.approx(
        motor_angles_deg([5.0, 12.0, 40.0, 90.0, -30.0], "right")
    )
    assert APPARATUS_SIGNS["left"][:2] == (1, -1)


@pytest.mark.parametrize("side", SIDES)
def test_poses_come_back_from_their_motor_angles(side: Side) -> None:
    lowest, highest = np.array(POSE_RANGE_DEG).T
    poses = np.random.default_rng(4).uniform(lowest, highest, size=(500, 5))
    assert pose_deg(motor_angles_deg(poses, side), side) == pytest.approx(poses, abs=1e-9)
