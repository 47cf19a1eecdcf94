"""A fast motion that ends just inside a limit is played to its end: the setpoint brakes before the limit."""

from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from msgspec import structs

from kata.device.config import simulated
from tests.support.simulated_loop import START_DEG, SimulatedLoop, load_of


# The brake does not depend on the protocol. In every run each speed once, and both protocols.
@pytest.mark.parametrize(
    ("protocol", "speed_deg_s", "slack_deg"),
    [
        pytest.param(
            protocol, speed, slack, marks=[pytest.mark.campaign] if (protocol == "modbus") != (speed == 60) else []
        )
        for protocol in ("dynamixel", "modbus")
        for speed, slack in ((40.0, 0.1), (50.0, 1.0), (60.0, 0.5), (80.0, 3.0))
    ],
)
def test_accepted_recording_is_played_up_to_a_doctors_limit(
    tmp_path: Path, protocol: Literal["dynamixel", "modbus"], speed_deg_s: float, slack_deg: float
) -> None:
    """Motor 5 reaches full speed in 0.3 s and rest in 0.1 s."""
    station = SimulatedLoop(tmp_path, structs.replace(simulated("memory"), protocol=protocol))
    times = np.arange(0.0, 3.001, 0.01)
    speed = speed_deg_s * np.clip(np.minimum(times / 0.3, (0.8 - times) / 0.1), 0.0, 1.0)
    angles = np.tile(START_DEG, (len(times), 1))
    angles[:, 4] -= np.cumsum(speed) * 0.01
    limits = [(-180.0, 190.0)] * 5
    limits[4] = (float(angles[:, 4].min()) - slack_deg, float(angles[:, 4].max()) + 5.0)
    station.play(load_of(times, angles, limits_deg=tuple(limits)), 2.5)
    assert station.causes() == []
    assert station.snapshot.torque == "on"
    assert min(goal for goal in station.world.goals(5)) == pytest.approx(limits[4][0], abs=slack_deg + 0.1)
