"""The arm's inertia loads the motors as MuJoCo's own inverse dynamics say, on both sides with the same ten numbers."""

import mujoco
import numpy as np
import pytest

from kata.motion.axes import APPARATUS_SIGNS, Side
from kata.motion.linkage import Floats, motor_angles_deg
from kata.motion.path import PathPoint
from kata.motion.rigid_body import ArmMotion, arm_motion, inertia_terms
from kata.simulator.independent.plant import IndependentPlant

_ROWS = 100
_STEP_S = 1e-4
_JOINTS = ("phi", "psi", "rotor3", "rotor4", "rotor5")


def movements(side: Side) -> tuple[PathPoint, Floats, Floats, Floats]:
    """Return random movements as the motors make them, and their poses, speeds and accelerations in degrees, ``(n, 5)`` each."""
    random = np.random.default_rng(3)
    pose = random.uniform((-16.0, -16.0, 5.0, -15.0, -80.0), (16.0, 16.0, 110.0, 140.0, 35.0), (_ROWS, 5))
    speed, acceleration = random.normal(0.0, 40.0, (_ROWS, 5)), random.normal(0.0, 200.0, (_ROWS, 5))
    before, now, after = (
        motor_angles_deg(pose + time * speed + time**2 / 2 * acceleration, side) for time in (-_STEP_S, 0.0, _STEP_S)
    )
    motors = PathPoint(now, (after - before) / (2 * _STEP_S), (before - 2 * now + after) / _STEP_S**2)
    return motors, pose, speed, acceleration


def independent_nm(side: Side, pose: Floats, speed: Floats, acceleration: Floats) -> Floats:
    """Return what MuJoCo's inverse dynamics need on each angle of the pose to move upper arm and forearm, weight included, ``(n, 5)``."""
    plant = IndependentPlant(turned=side == "left")
    model, data = plant.model, plant.data
    for body in range(model.nbody):
        if model.body(body).name not in ("humerus", "forearm"):
            model.body_mass[body] = 0.0
            model.body_inertia[body] = 0.0
    # MuJoCo calls a body without any inertia a mistake, and writes that into a file.
    model.dof_armature[:] = 1e-6
    for alone in (model.dof_damping, model.jnt_stiffness, model.tendon_damping):
        alone[:] = 0.0
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    signs = np.array(APPARATUS_SIGNS[side])
    angles = [model.joint(name).qposadr[0] for name in _JOINTS]
    freedoms = [model.joint(name).dofadr[0] for name in _JOINTS]
    found = []
    for row in range(_ROWS):
        data.qpos[:], data.qvel[:], data.qacc[:] = model.qpos0, 0.0, 0.0
        data.qpos[angles] = np.radians(signs * pose[row])
        data.qvel[freedoms] = np.radians(signs * speed[row])
        data.qacc[freedoms] = np.radians(signs * acceleration[row])
        mujoco.mj_inverse(model, data)
        found.append(signs * data.qfrc_inverse[freedoms])
    return np.array(found)


def of_motors(arm: ArmMotion, pose_nm: Floats) -> Floats:
    """Return the motors' torques for torques on the pose's angles."""
    torque: Floats = np.einsum("nmp,np->nm", arm.pose_slopes, pose_nm)
    return torque


def test_ten_numbers_explain_mujocos_torques_on_both_sides() -> None:
    motors, *poses = movements("right")
    arm = arm_motion(motors, "right")
    torque, terms = of_motors(arm, independent_nm("right", *poses)), inertia_terms(arm)
    inertia, *_ = np.linalg.lstsq(terms.reshape(-1, 10), torque.ravel(), rcond=None)
    # Upper arm and forearm: their mass, and their centre 0.436 and 0.682 along the bent arm.
    assert inertia[9] == pytest.approx(3.6, rel=0.01)
    down = 2.0 * 0.436 * 0.285 + 1.6 * (0.285 + 0.682 * 0.245 * np.cos(np.radians(80.0)))
    forward = 1.6 * 0.682 * 0.245 * np.sin(np.radians(80.0))
    assert inertia[[6, 7, 8]] == pytest.approx([forward, 0.0, -down], abs=0.01)
    for side in ("right", "left"):
        motors, *poses = movements(side)
        arm = arm_motion(motors, side)
        torque = of_motors(arm, independent_nm(side, *poses))
        error = torque - inertia_terms(arm) @ inertia
        size = np.sqrt(np.mean(torque**2, axis=0))
        assert np.all(size > 0.4)
        assert np.all(np.sqrt(np.mean(error**2, axis=0)) < 0.03 * size)


def test_scapula_of_motors_is_that_of_the_linkage() -> None:
    motors, pose, *_ = movements("left")
    assert np.degrees(arm_motion(motors, "left").pose_rad) == pytest.approx(pose, abs=0.25)


def test_one_movement_and_many_are_the_same() -> None:
    motors, *_ = movements("right")
    one = PathPoint(*(part[7] for part in motors))
    assert inertia_terms(arm_motion(one, "right")) == pytest.approx(inertia_terms(arm_motion(motors, "right"))[7])
