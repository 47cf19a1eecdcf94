"""A Pause ends a start that still waits for the drives' answers, as a Stop does."""

import pytest

from kata.device.ipc import QueuedCommand
from kata.device.ipc_messages import Approach, Pause, stamped
from tests.support.stepped import NEVER_NS, Stepped
from tests.support.trajectories import LOAD, a_trajectory


@pytest.mark.counted
def test_pause_ends_a_start_that_waits(stepped: Stepped) -> None:
    assert stepped.send(LOAD, a_trajectory(8.0)) is None
    stepped.apparatus.silent = {4}
    stepped.cycle()
    stepped.link.commands.append(QueuedCommand(90, stamped(Approach(), stepped.snapshot.stops, NEVER_NS)))
    stepped.cycle()
    stepped.link.commands.append(QueuedCommand(91, Pause()))
    stepped.cycle()
    stepped.apparatus.silent = set()
    stepped.forward(0.4)
    assert not stepped.torque
