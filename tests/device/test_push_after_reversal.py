"""A push that lasts after a reversal is answered at once where the arm no longer moves back."""

from pathlib import Path

import msgspec
import pytest

from kata.device.ipc_messages import Approach, Pause, Play
from kata.motion.trajectory import Trajectory
from tests.device.test_end_feel import AXIS, CHOSEN_NM, ONCE, SPEED_DEG_S, TIMES_S, Shoulder, way
from tests.device.test_resistance import PUSHED, THRESHOLD_NM, at_the_start
from tests.support.stepped import Stepped
from tests.support.trajectories import LOAD

_ANSWERED_S = 0.2
"""0.1 s of push, the ramp of a turn, and two cycles."""


def _reversed(folder: Path, playing_s: float) -> Stepped:
    """Push until the arm turns back, and go on pushing."""
    station = at_the_start(Stepped(folder))
    assert station.send(Play()) is None
    station.forward(playing_s)
    station.apparatus.torques_nm[PUSHED] = 1.1 * THRESHOLD_NM
    for _ in range(15):
        if not any(event.code == "load_reversal" for event in station.link.events):
            station.cycle()
    assert station.link.events[-1].code == "load_reversal"
    return station


def test_pause_during_a_reversal_still_yields_to_the_push(tmp_path: Path) -> None:
    station = _reversed(tmp_path, 3.0)
    assert station.send(Pause()) is None
    station.until("paused", 0.2)
    station.forward(_ANSWERED_S)
    assert station.causes() == ["load_while_held"]


def test_play_after_pause_does_not_ignore_a_lasting_push(tmp_path: Path) -> None:
    station = _reversed(tmp_path, 3.0)
    assert station.send(Pause()) is None
    station.until("paused", 0.2)
    reversals = [event.code for event in station.link.events].count("load_reversal")
    assert station.send(Play()) is None
    station.forward(2 * _ANSWERED_S)
    again = [event.code for event in station.link.events].count("load_reversal") > reversals
    assert again or station.causes()


def test_reversal_that_ends_at_the_start_yields_further(tmp_path: Path) -> None:
    station = _reversed(tmp_path, 0.3)
    station.until("paused", 1.0)
    station.forward(_ANSWERED_S)
    assert station.causes() == ["load_while_held"]


@pytest.mark.parametrize("resting", [0, 2])
def test_resistance_of_a_resting_motor_stops_the_way_back(stepped: Stepped, resting: int) -> None:
    """On the way back of an end-feel test; the test's motor moves, another one meets resistance."""
    load = msgspec.structs.replace(LOAD, end_feel=ONCE, load_level=15)
    assert stepped.send(load, Trajectory(TIMES_S, way())) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None
    shoulder = Shoulder(stepped)
    while shoulder.largest_nm < CHOSEN_NM - 0.35:
        shoulder.cycle()
    shoulder.forward(2.0)
    before_deg = stepped.apparatus.angles_deg[AXIS]
    stepped.apparatus.torques_nm[resting] = 2.6
    shoulder.forward(0.5)
    assert stepped.causes() == ["load_on_the_way"]
    assert stepped.apparatus.angles_deg[AXIS] > before_deg - 0.5 * SPEED_DEG_S
