"""Fixtures of the device tests."""

from pathlib import Path

import pytest

from kata.device.ipc_messages import Approach, Play
from tests.support.stepped import Stepped
from tests.support.trajectories import LOAD, a_trajectory


@pytest.fixture
def stepped(tmp_path: Path) -> Stepped:
    """Return an idle apparatus with a stepped clock."""
    return Stepped(tmp_path)


@pytest.fixture(scope="session")
def began_playing(tmp_path_factory: pytest.TempPathFactory) -> Stepped:
    """Return an apparatus that has played a recording for half a second. Tests use copies of it."""
    stepped = Stepped(tmp_path_factory.mktemp("playing"))
    assert stepped.send(LOAD, a_trajectory()) is None
    assert stepped.send(Approach()) is None
    stepped.until("paused")
    assert stepped.send(Play()) is None
    stepped.forward(0.5)
    assert stepped.mode == "playing"
    assert stepped.torque
    return stepped


@pytest.fixture
def playing(began_playing: Stepped, tmp_path: Path) -> Stepped:
    """Return an apparatus that has played a recording for half a second."""
    return began_playing.copied(tmp_path)
