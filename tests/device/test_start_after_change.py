"""A start is refused if its sender looked before the arm was taken back from resistance, or before a recording was loaded."""

import pytest

from kata.device.ipc_messages import Approach, Play, Unload, stamped
from tests.support.stepped import NEVER_NS, Stepped
from tests.support.trajectories import LOAD, a_trajectory

AXIS = 3
PUSH_NM = 4.0


def test_play_from_before_a_reversal_is_refused(stepped: Stepped) -> None:
    """A second press of Play is delayed. Meanwhile the arm meets resistance and is taken back."""
    assert stepped.send(LOAD, a_trajectory(8.0)) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    stops = stepped.snapshot.stops
    delayed = stamped(Play(), stops, NEVER_NS)
    assert stepped.send(Play()) is None
    stepped.forward(1.0)
    stepped.apparatus.torques_nm[AXIS] = PUSH_NM
    stepped.forward(0.2)
    assert [event.code for event in stepped.link.events].count("load_reversal") == 1
    assert stepped.snapshot.stops == stops + 1
    stepped.apparatus.torques_nm[AXIS] = 0.0
    stepped.until("paused")
    refusal = stepped.send_as_it_is(delayed)
    assert refusal is not None and refusal.code == "stopped_meanwhile"
    assert stepped.mode == "paused"
    assert stepped.send(Play()) is None


@pytest.mark.counted
def test_approach_from_before_a_load_is_refused(stepped: Stepped) -> None:
    """An Approach is delayed. Meanwhile its recording is unloaded, and another one is loaded."""
    assert stepped.send(LOAD, a_trajectory(8.0)) is None
    delayed = stamped(Approach(), stepped.snapshot.stops, NEVER_NS)
    assert stepped.send(Unload()) is None
    assert stepped.send(LOAD, a_trajectory(4.0)) is None
    refusal = stepped.send_as_it_is(delayed)
    assert refusal is not None and refusal.code == "stopped_meanwhile"
    assert not stepped.torque
    assert stepped.send(Approach()) is None
