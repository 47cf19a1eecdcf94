"""Shared by the device's tests."""

from pathlib import Path

import pytest

from kata.device.messages import Approach, Play
from tests.support.stepped import Stepped
from tests.support.trajectories import LOAD, a_trajectory


@pytest.fixture
def stepped(tmp_path: Path) -> Stepped:
    """An idle apparatus under a stepped clock."""
    return Stepped(tmp_path)


@pytest.fixture
def playing(stepped: Stepped) -> Stepped:
    """A recording is playing, half a second in."""
    assert stepped.send(LOAD, a_trajectory()) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None
    stepped.forward(0.5)
    assert stepped.mode == "playing"
    assert stepped.torque
    return stepped
