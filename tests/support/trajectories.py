"""A short trajectory and the command that loads it."""

import numpy as np

from kata.device.ipc_messages import Load
from kata.motion.trajectory import Trajectory
from tests.support.stepped import REST_DEG


def a_trajectory(seconds: float = 2.0) -> Trajectory:
    """A movement from 20 deg of flexion up and back, which does not start at the rest pose."""
    times = np.linspace(0.0, seconds, round(seconds * 100) + 1)
    angles = np.tile(np.array(REST_DEG), (len(times), 1))
    angles[:, 3] = 20 + 10 * (1 - np.cos(2 * np.pi * times / seconds))
    return Trajectory(times, angles)


LOAD = Load(run_id="run", recording_id="recording", times_s=b"", angles_deg=b"")
