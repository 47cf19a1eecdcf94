"""Refusals of commands whose rules depend on one number or on one drive."""

from typing import cast

import msgspec
import numpy as np
import pytest

from kata.device import refusals
from kata.device.cycle_state import CycleState
from kata.device.ipc_messages import Approach, TorqueState
from kata.device.run import Run
from kata.motion.method import reference
from tests.support.playback import MOVING, load
from tests.support.stepped import REST_DEG, Stepped


@pytest.fixture
def state(stepped: Stepped) -> CycleState:
    return stepped.loop._state_builder.build(0, None, stepped.loop._loop_context(0, 0.0))


@pytest.mark.parametrize("motor", [1, 3, 5])
def test_refusal_names_the_motor_that_did_not_answer(state: CycleState, motor: int) -> None:
    unbroken = tuple(n != motor for n in range(1, 6))
    refusal = refusals.angles_not_current(msgspec.structs.replace(state, unbroken=unbroken))
    assert refusal is not None
    assert refusal.message.startswith(f"Motor {motor} ")
    assert refusals.angles_not_current(msgspec.structs.replace(state, unbroken=(True,) * 5)) is None


@pytest.mark.parametrize(
    ("inherited", "torque", "refused"),
    [(True, "on", False), (True, "unknown", False), (True, "off", True), (False, "on", True)],
)
def test_only_torque_from_before_the_port_was_opened_is_released(
    state: CycleState, inherited: bool, torque: TorqueState, refused: bool
) -> None:
    found = msgspec.structs.replace(
        state,
        bus_ok=True,
        torque=("off", "off", torque, "off", "off"),
        context=msgspec.structs.replace(state.context, torque_inherited=inherited),
    )
    refusal = refusals.no_torque_found(found)
    assert (refusal is not None) is refused


@pytest.mark.parametrize(("excess_deg", "refused"), [(0.05, False), (0.0501, True)])
def test_approach_may_exceed_limits_by_the_tolerance(
    state: CycleState, monkeypatch: pytest.MonkeyPatch, excess_deg: float, refused: bool
) -> None:
    monkeypatch.setattr(refusals, "approach_path", lambda run, here_deg: (None, excess_deg))
    assert (refusals.path_leaves_limits(state, cast(Run, None)) is not None) is refused


@pytest.mark.parametrize(("away_deg", "refused"), [(3.4, False), (3.6, True)])
def test_paper_start_leaves_half_a_degree_to_yield(stepped: Stepped, away_deg: float, refused: bool) -> None:
    """At 20 deg/s and 10 Hz the setpoint gate allows 4 deg."""
    stepped.apparatus.angles_deg[MOVING] = 30.0 + away_deg
    stepped.forward(0.1)
    times = np.arange(0.0, 4.001, 0.01)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, MOVING] = 30.0 + times
    trajectory = reference("paper", times, angles)
    assert stepped.send(load("paper", max_speed_deg_s=20.0), trajectory) is None
    refusal = stepped.send(Approach())
    assert (refusal is not None and refusal.code == "too_far_from_start") is refused
