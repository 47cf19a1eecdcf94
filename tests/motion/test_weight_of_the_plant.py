"""The terms of motors 1 and 2 describe what the girdle of the MuJoCo model carries, on both sides with the same factors."""

import mujoco
import numpy as np
import pytest

from kata.motion.axes import APPARATUS_SIGNS, Side
from kata.motion.linkage import Floats, motor_angles_deg, pose_deg
from kata.motion.weight import weight_terms
from kata.simulator.independent.plant import IndependentPlant

_STEP_DEG = 0.05
_ENERGY = 2  # mjENBL_ENERGY


def held_nm(plant: IndependentPlant, motors_deg: Floats, side: Side) -> Floats:
    """Return the torques ``(2,)`` of motors 1 and 2 that hold a posture: the slope of the energy of weights, springs and balancer."""

    def energy(at_deg: Floats) -> float:
        pose = pose_deg(at_deg, side) * np.array(APPARATUS_SIGNS[side])
        joints = {"phi": pose[0], "psi": pose[1], "rotor1": at_deg[0], "rotor2": at_deg[1]}
        joints |= {f"rotor{n}": pose[n - 1] for n in (3, 4, 5)}
        plant.data.qpos[:] = plant.model.qpos0
        for name, angle_deg in joints.items():
            plant.data.qpos[plant.model.joint(name).qposadr[0]] = np.radians(angle_deg)
        mujoco.mj_forward(plant.model, plant.data)
        girdle = float(np.dot(plant._constant[:2], np.radians(pose[:2])))
        cable = plant._constant[2] * float(plant.data.ten_length[plant.model.tendon("balancer").id])
        return float(plant.data.energy[0]) - girdle - cable

    found = []
    for motor in (0, 1):
        step = np.zeros(5)
        step[motor] = _STEP_DEG
        found.append((energy(motors_deg + step) - energy(motors_deg - step)) / (2 * np.radians(_STEP_DEG)))
    return np.array(found)


def measured(side: Side, poses: Floats, *, relaxed: bool) -> tuple[Floats, Floats]:
    """Return torques ``(n, 2)`` and terms ``(n, 2, N_TERMS)``. ``relaxed``: the girdle itself carries what hangs on it at rest."""
    plant = IndependentPlant(turned=side == "left")
    plant.model.opt.enableflags |= _ENERGY
    if not relaxed:
        plant._constant[:2] = [0.0, 0.0]
    motors = motor_angles_deg(poses, side)
    torques = np.array([held_nm(plant, row, side) for row in motors])
    return torques, weight_terms(motors, side)[:, :2]


@pytest.mark.parametrize(("relaxed", "motor"), [(True, 1), (True, 2), (False, 2)])
def test_factors_of_one_side_hold_the_girdle_of_the_other(relaxed: bool, motor: int) -> None:
    """Where the girdle does not carry what hangs on it, nearly all of motor 2's torque is the constant; motor 1's is small then."""
    random = np.random.default_rng(5)
    poses = random.uniform((-14.0, -14.0, 5.0, -10.0, -60.0), (14.0, 14.0, 100.0, 120.0, 30.0), (60, 5))
    right_nm, right = measured("right", poses, relaxed=relaxed)
    left_nm, left = measured("left", poses, relaxed=relaxed)
    factors, *_ = np.linalg.lstsq(right[:, motor - 1], right_nm[:, motor - 1], rcond=None)
    size = np.sqrt(np.mean(left_nm[:, motor - 1] ** 2))
    assert np.sqrt(np.mean((left[:, motor - 1] @ factors - left_nm[:, motor - 1]) ** 2)) < 0.3 * size
