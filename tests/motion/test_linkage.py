"""The scapula's parallel links."""

import numpy as np
import pytest

from kata.device.config import StationConfig
from kata.motion.axes import POSE_RANGE_DEG
from kata.motion.linkage import LINKAGE, Linkage, OutOfReachError, motor_angles_deg


def _grid(limit_deg: float, n: int = 81) -> np.ndarray:
    phi, psi = np.meshgrid(np.linspace(-limit_deg, limit_deg, n), np.linspace(-limit_deg, limit_deg, n))
    return np.stack([phi, psi], axis=-1)


def _rod_lengths_mm(scapula_deg: np.ndarray, theta_deg: np.ndarray) -> np.ndarray:
    """|QiPi| worked out from the points themselves: the loop closure of Eqs. 1-4, without any algebra."""
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


def test_the_stations_default_limits_hold_the_image_of_the_scapulas_range() -> None:
    theta = LINKAGE.inverse_deg(_grid(20.0)).reshape(-1, 2)
    for n, axis in enumerate(StationConfig().axes[:2]):
        assert axis.min_deg <= theta[:, n].min() < axis.min_deg + 3
        assert axis.max_deg - 3 < theta[:, n].max() <= axis.max_deg
    for axis, (low, high) in zip(StationConfig().axes[2:], POSE_RANGE_DEG[2:], strict=True):
        assert (axis.min_deg, axis.max_deg) == (low, high)


def test_out_of_reach_names_the_row_and_the_motor() -> None:
    short = Linkage(q1p1_mm=80.0)
    with pytest.raises(OutOfReachError, match=r"motor 1 cannot reach .* -20.0 deg .* \(row 1\)") as caught:
        short.inverse_deg([[0.0, 0.0], [-20.0, -20.0]])
    assert (caught.value.motor, caught.value.index) == (1, 1)


def test_motors_three_to_five_turn_with_the_body() -> None:
    pose = np.array([[5.0, -5.0, 40.0, 90.0, -30.0]])
    assert motor_angles_deg(pose)[0, 2:] == pytest.approx([40.0, 90.0, -30.0])
    assert motor_angles_deg(pose)[0, :2] == pytest.approx(LINKAGE.inverse_deg([5.0, -5.0]))
