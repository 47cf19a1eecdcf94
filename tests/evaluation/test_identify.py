"""The lag of drives is identified from a measured movement."""

import math

import pytest

from kata.device.config import simulated
from kata.evaluation.excitation import exercise, identify_station
from kata.simulator.parameters import DRIVES, GOAL_SMOOTHING_S, JOINTS

pytestmark = pytest.mark.campaign


@pytest.mark.parametrize("seed", [None, 3])
def test_lag_of_simulated_drives_depends_only_on_their_control(seed: int | None) -> None:
    found = identify_station(simulated("virtual"), exercise(15.0), seed).axes
    for axis, drive, joint in zip(found, DRIVES, JOINTS, strict=True):
        # Friction at the reversals reduces the identified lag a little.
        assert axis.lag_s == pytest.approx(drive.d_nm_s_rad / drive.p_nm_rad + GOAL_SMOOTHING_S, rel=0.12)
        assert 0.0 < axis.lag2_s2 < 0.01
        coulomb_deg = math.degrees((joint.rotor_coulomb_nm + joint.arm_coulomb_nm) / drive.p_nm_rad)
        assert 0.0 < axis.friction_deg < 1.5 * coulomb_deg
        assert axis.residual_deg < 0.25


def test_the_simulated_station_knows_the_lag_of_its_drives() -> None:
    for axis, found in zip(
        simulated("virtual").axes,
        identify_station(simulated("virtual"), exercise(15.0, 6), None).axes,
        strict=True,
    ):
        assert axis.lag_s == pytest.approx(found.lag_s, abs=0.003)
        assert axis.lag2_s2 == pytest.approx(found.lag2_s2, abs=0.0005)
        assert axis.friction_deg == pytest.approx(found.friction_deg, abs=0.05)
