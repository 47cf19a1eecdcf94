"""What may be commanded and measured of each axis: the tighter of mechanism and patient, and the way from where the arm is."""

import msgspec
import numpy as np
import pytest

from kata.device.messages import Approach, Play, Unload
from tests.device.conftest import LOAD, a_trajectory
from tests.device.stepped import REST_DEG, Stepped

MECHANISM = ((-21.0, 45.0), (86.0, 131.0))
"""Of the first two axes: the range and half of the tolerance of 4 deg."""
MOVING = 3
"""The axis that goes from 20 to 40 deg and back in these recordings, from 0 where the arm rests."""


def limits(low: float, high: float) -> tuple[tuple[float, float], ...]:
    """The patient's, for the axis that moves; wide for the others."""
    wide = [(-180.0, 180.0)] * 5
    wide[MOVING] = (low, high)
    return tuple(wide)


def load(stepped: Stepped, low: float, high: float) -> None:
    assert stepped.send(msgspec.structs.replace(LOAD, limits_deg=limits(low, high)), a_trajectory()) is None


def test_without_a_patient_the_limits_are_the_mechanisms(stepped: Stepped) -> None:
    assert stepped.loop._machine.limits_deg[:2] == MECHANISM
    assert stepped.send(LOAD, a_trajectory()) is None
    assert stepped.loop._machine.limits_deg == stepped.config.mechanism_deg


def test_the_tighter_of_mechanism_and_patient_counts_at_each_end(stepped: Stepped) -> None:
    load(stepped, 5.0, 42.0)
    of_run = stepped.loop._machine.limits_deg
    assert of_run[:2] == MECHANISM
    assert of_run[MOVING] == (5.0, 42.0)

    assert stepped.send(Unload()) is None
    assert stepped.loop._machine.limits_deg == stepped.config.mechanism_deg


def test_an_arm_outside_the_patients_limits_may_be_fetched_from_there_and_brought_back(stepped: Stepped) -> None:
    load(stepped, 5.0, 42.0)
    assert stepped.send(Approach()) is None
    assert stepped.loop._machine.limits_deg[MOVING] == (0.0, 42.0)
    stepped.until("paused")
    stepped.send(Play())
    stepped.until("idle")

    assert stepped.causes() == []
    assert stepped.apparatus.angles_deg == pytest.approx(REST_DEG, abs=0.01)


def test_and_so_from_above(stepped: Stepped) -> None:
    stepped.apparatus.angles_deg[MOVING] = 60.0
    stepped.forward(0.05)
    load(stepped, 5.0, 42.0)
    assert stepped.send(Approach()) is None
    assert stepped.loop._machine.limits_deg[MOVING] == (5.0, 60.0)
    assert stepped.loop._machine.limits_deg[:2] == MECHANISM


def test_a_setpoint_beyond_the_patients_limits_is_never_sent(stepped: Stepped) -> None:
    """The service has checked the recording against them; this is for when it has not."""
    load(stepped, 0.0, 35.0)
    stepped.send(Approach())
    stepped.until("paused")
    stepped.send(Play())
    stepped.until("stopped")

    assert stepped.causes() == ["setpoint_limit"]
    assert not stepped.torque
    assert np.array(stepped.apparatus.written)[:, MOVING].max() <= 35.0


def test_an_arm_pushed_beyond_the_patients_limits_is_a_fault(stepped: Stepped) -> None:
    """Half of the tolerance stands between what may be commanded and what may be measured."""
    load(stepped, 0.0, 40.5)
    stepped.send(Approach())
    stepped.until("paused")
    stepped.apparatus.drift_deg_s[MOVING] = -50.0
    stepped.until("stopped")

    assert stepped.causes() == ["position_limit"]
    assert stepped.apparatus.angles_deg[MOVING] == pytest.approx(-2.0 - 0.25, abs=0.26)


@pytest.mark.parametrize(("angle_deg", "refused"), [(-23.0, False), (-23.1, True), (47.0, False), (47.1, True)])
def test_torque_is_not_switched_on_where_the_arm_stands_out_of_its_range_by_more_than_the_tolerance(
    stepped: Stepped, angle_deg: float, refused: bool
) -> None:
    stepped.apparatus.angles_deg[0] = angle_deg
    assert stepped.send(LOAD, a_trajectory()) is None
    stepped.forward(0.1)
    refusal = stepped.send(Approach())
    stepped.forward(0.1)

    assert (refusal is not None) == refused
    assert stepped.torque == (not refused)
    assert stepped.causes() == []
    if refusal:
        assert refusal.message == f"Motor 1 stands at {angle_deg:.0f} deg, outside its range."
