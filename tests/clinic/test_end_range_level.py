"""A resistance level that moves the arm back before the prescribed torque is reached, is reported with the level that is needed."""

import numpy as np
import pytest
from msgspec import structs

from kata.clinic.sessions.end_range import level_problem
from kata.clinic.sessions.schemas import EndRangePrescription
from kata.device.config import StationConfig, simulated
from kata.motion.arm_load import ArmLoad
from kata.motion.edit import Motion
from kata.simulator.parameters import REST_DEG

ABDUCTION, ROTATION = 4, 6
"""Numbers of motions in Table 2."""


def raised(motor: int, to_deg: float) -> Motion:
    """Return a motion of one motor away from rest."""
    postures = np.tile(np.array(REST_DEG), (100, 1))
    postures[:, motor - 1] = np.linspace(REST_DEG[motor - 1], to_deg, 100)
    return Motion(np.linspace(0.0, 10.0, 100), postures)


def problem_at(level: int, torque_nm: float, config: StationConfig) -> str | None:
    prescribed = EndRangePrescription(motion=ABDUCTION, minutes=5.0, band_deg=4.0, torque_nm=torque_nm)
    return level_problem(raised(3, 90.0), "right", config, prescribed, level)


def test_level_below_prescribed_torque_names_the_needed_one() -> None:
    config = simulated("virtual")
    # Each level of a drive with 4 Nm adds 0.157 Nm.
    assert "level 6 moves the arm back" in str(problem_at(6, 1.0, config))
    assert "level 7 or higher" in str(problem_at(6, 1.0, config))
    assert problem_at(7, 1.0, config) is None


def test_identified_load_and_friction_need_more() -> None:
    config = simulated("virtual")
    # A mass of 2 kg, 0.2 m below the shoulder of the hanging arm: 3.9 Nm at 90 deg.
    heavy = ArmLoad(inertia=(0.0,) * 8 + (-0.4, 2.0))
    assert "any resistance level" in str(problem_at(25, 1.0, structs.replace(config, arm=heavy)))
    axes = tuple(structs.replace(axis, coulomb_nm=0.3) for axis in config.axes)
    assert "level 9 or higher" in str(problem_at(7, 1.0, structs.replace(config, axes=axes)))


@pytest.mark.parametrize(("torque_nm", "possible"), [(1.9, True), (2.0, False)])
def test_weak_motor_cannot_reach_a_high_torque(torque_nm: float, possible: bool) -> None:
    prescribed = EndRangePrescription(motion=ROTATION, minutes=5.0, torque_nm=torque_nm)
    found = level_problem(raised(5, -60.0), "right", simulated("virtual"), prescribed, 25)
    assert (found is None) is possible
