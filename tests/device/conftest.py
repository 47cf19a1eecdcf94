"""Shared by the device's tests."""

from pathlib import Path

import numpy as np
import pytest

from kata.device.messages import Approach, Load, Play
from kata.motion.trajectory import Trajectory
from tests.device.stepped import REST_DEG, Stepped


@pytest.fixture
def stepped(tmp_path: Path) -> Stepped:
    """An idle apparatus under a stepped clock."""
    return Stepped(tmp_path)


def a_trajectory(seconds: float = 2.0) -> Trajectory:
    """From 20 deg of flexion up and back, starting away from where the arm rests."""
    times = np.linspace(0.0, seconds, round(seconds * 100) + 1)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, 3] = 20 + 10 * (1 - np.cos(2 * np.pi * times / seconds))
    return Trajectory(times, angles)


LOAD = Load(run_id="run", recording_id="recording", times_s=b"", angles_deg=b"")


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
