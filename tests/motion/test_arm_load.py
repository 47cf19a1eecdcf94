"""The torque of an arm, its girdle and its balancer is the derivative of their energy, as MuJoCo's model of them says."""

from functools import cache

import mujoco
import numpy as np
import pytest

from kata.motion.arm_load import N_TERMS, ArmLoad, load_terms
from kata.motion.axes import APPARATUS_SIGNS, Side
from kata.motion.linkage import LINKAGE, Floats, motor_angles_deg, pose_deg
from kata.motion.method import LoadModel
from kata.motion.path import PathPoint
from kata.motion.rigid_body import arm_motion
from kata.simulator.independent.plant import IndependentPlant

_STEP_DEG = 0.05
_ENERGY = 2  # mjENBL_ENERGY


def standing(motors_deg: Floats) -> PathPoint:
    """Return postures at rest."""
    still = np.zeros_like(motors_deg)
    return PathPoint(motors_deg, still, still)


def held_nm(plant: IndependentPlant, motors_deg: Floats, side: Side) -> Floats:
    """Return the torques ``(5,)`` that hold a posture: the slope of the energy of weights, springs and balancer."""

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

    steps = np.eye(5) * _STEP_DEG
    return np.array(
        [(energy(motors_deg + step) - energy(motors_deg - step)) / (2 * np.radians(_STEP_DEG)) for step in steps]
    )


@cache
def carried(side: Side) -> tuple[Floats, Floats]:
    """Return random postures ``(n, 5)`` and the torques that hold them."""
    plant = IndependentPlant(turned=side == "left")
    plant.model.opt.enableflags |= _ENERGY
    random = np.random.default_rng(5)
    poses = random.uniform((-14.0, -14.0, 5.0, -10.0, -60.0), (14.0, 14.0, 100.0, 120.0, 30.0), (60, 5))
    motors = motor_angles_deg(poses, side)
    return motors, np.array([held_nm(plant, row, side) for row in motors])


@pytest.mark.campaign
def test_one_load_holds_the_plants_arm_on_both_sides() -> None:
    """Fitted to the right side. The cable holds the forearm, 80 deg bent, at 0.4 of its 0.245 m; its end is 1 m above the shoulder."""
    bent = np.radians(80.0)
    balancer_m = (0.098 * np.sin(bent), -0.285 - 0.098 * np.cos(bent), 1.0)
    motors, torque = carried("right")
    terms = load_terms(arm_motion(standing(motors), "right"), balancer_m)
    factors, *_ = np.linalg.lstsq(terms.reshape(-1, N_TERMS), torque.ravel(), rcond=1e-6)
    assert factors[-1] == pytest.approx(2.0 * 9.81, rel=0.05)
    for side in ("right", "left"):
        motors, torque = carried(side)
        error = load_terms(arm_motion(standing(motors), side), balancer_m) @ factors - torque
        size = np.sqrt(np.mean(torque**2, axis=0))
        assert np.all(size > 0.2)
        assert np.all(np.sqrt(np.mean(error**2, axis=0)) < 0.08 * size)


@pytest.mark.parametrize("side", ["right", "left"])
def test_link_and_springs_load_motors_by_hand(side: Side) -> None:
    """Through the linkage's own slopes: upward rotation lifts the link as abduction does, because both turn about X."""
    pose = np.array([5.0, -8.0, 60.0, 0.0, 0.0])
    terms = load_terms(arm_motion(standing(motor_angles_deg(pose, side)), side), (0.0, 0.0, 1.0))
    theta = LINKAGE.inverse_deg(pose[:2], side)
    steps = 1e-4 * np.eye(2)
    of_phi, of_psi = ((LINKAGE.forward_deg(theta + steps, side) - LINKAGE.forward_deg(theta - steps, side)) / 2e-4).T
    link = -np.sin(np.radians(-8.0 + 60.0))
    assert terms[:, -4] == pytest.approx([*(link * of_psi), link, 0.0, 0.0], abs=0.02)
    assert terms[:, -3] == pytest.approx([*(np.radians(5.0) * of_phi), 0.0, 0.0, 0.0], abs=0.01)
    assert terms[:, -2] == pytest.approx([*(np.radians(-8.0) * of_psi), 0.0, 0.0, 0.0], abs=0.01)


def test_known_load_is_one_that_has_an_inertia() -> None:
    assert not ArmLoad().known
    assert ArmLoad(inertia=(0.0,) * 9 + (3.6,)).known
    assert not LoadModel().torque_nm(standing(motor_angles_deg(np.zeros(5)))).any()
