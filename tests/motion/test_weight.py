"""The terms of weight are those of a mass on the arm, a spring at the girdle and a balancer's cable."""

import numpy as np
import pytest

from kata.motion.linkage import LINKAGE
from kata.motion.weight import N_TERMS, weight_terms

REST_DEG = LINKAGE.inverse_deg([0.0, 0.0])
POSTURES_DEG = [(40.0, 30.0, -20.0), (90.0, 10.0, 30.0), (10.0, 120.0, -60.0)]


def turned_about(axis: int, angle: float) -> np.ndarray:
    """Return the rotation by an angle (rad) about X, Y or Z."""
    c, s = np.cos(angle), np.sin(angle)
    one, two = ((1, 2), (2, 0), (0, 1))[axis]
    matrix = np.eye(3)
    matrix[one, one] = matrix[two, two] = c
    matrix[one, two], matrix[two, one] = -s, s
    return matrix


def place(angles_rad: np.ndarray, point: tuple[float, float, float]) -> np.ndarray:
    """Return where motors 3 to 5 take a point of the hanging arm: about -X, -Y and -Z."""
    t3, t4, t5 = -angles_rad
    there: np.ndarray = turned_about(0, t3) @ turned_about(1, t4) @ turned_about(2, t5) @ np.array(point)
    return there


@pytest.mark.parametrize("posture_deg", POSTURES_DEG)
@pytest.mark.parametrize(("point", "term"), [((1.0, 0.0, 0.0), 0), ((0.0, 0.0, 1.0), 1)])
def test_terms_of_a_mass_are_the_derivatives_of_its_height(
    posture_deg: tuple[float, float, float], point: tuple[float, float, float], term: int
) -> None:
    angles = np.radians(posture_deg)
    terms = weight_terms([*REST_DEG, *posture_deg], "right")
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-6
        slope = (place(angles + step, point)[2] - place(angles - step, point)[2]) / 2e-6
        assert terms[axis + 2, term] == pytest.approx(slope, abs=1e-8)


def test_a_short_cable_above_the_shoulder_is_described() -> None:
    """The torque of a constant pull towards a point 1 m above, at every posture, within a twentieth of the largest."""
    rng = np.random.default_rng(1)
    hook, top = (0.04, 0.0, -0.30), np.array([0.0, 0.0, 1.0])
    postures = rng.uniform((5.0, -15.0, -80.0), (110.0, 150.0, 35.0), (200, 3))
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-6
        slopes = [
            (np.linalg.norm(top - place(q + step, hook)) - np.linalg.norm(top - place(q - step, hook))) / 2e-6
            for q in np.radians(postures)
        ]
        rows = np.column_stack([np.tile(REST_DEG, (200, 1)), postures])
        terms = weight_terms(rows, "right")[:, axis + 2]
        factors, *_ = np.linalg.lstsq(terms, np.array(slopes), rcond=None)
        assert np.abs(terms @ factors - slopes).max() < 0.05 * max(np.abs(slopes).max(), 0.3)


def test_arm_loads_motors_1_and_2_by_side() -> None:
    posture = [*(REST_DEG + np.array([5.0, -3.0])), 60.0, 40.0, -20.0]
    right, left = weight_terms(posture, "right"), weight_terms(posture, "left")
    assert right.shape == (5, N_TERMS)
    assert left[0] == pytest.approx(right[0])
    assert left[1, [0, 3, 4]] == pytest.approx(-right[1, [0, 3, 4]])
    assert left[1, [1, 2, 5]] == pytest.approx(right[1, [1, 2, 5]])
    assert left[2:] == pytest.approx(right[2:])
    assert right[0, 0] == pytest.approx(place(np.radians([60.0, 40.0, -20.0]), (0.0, 0.0, 1.0))[1])
