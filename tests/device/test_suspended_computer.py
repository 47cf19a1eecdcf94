"""A suspended computer stops the arm when it wakes up. CLOCK_MONOTONIC does not count the time in which it was suspended."""

from pathlib import Path

import pytest
from msgspec import structs

from kata.device.config import Inputs, simulated
from kata.device.ipc_messages import Approach, stamped
from tests.support.simulated_loop import SimulatedLoop, wave
from tests.support.stepped import NEVER_NS


@pytest.fixture
def station(tmp_path: Path) -> SimulatedLoop:
    inputs = Inputs(estop_second_port=3, max_age_cycles=10)
    return SimulatedLoop(tmp_path, structs.replace(simulated("memory"), silence_ms=100, inputs=inputs))


def suspend(station: SimulatedLoop, seconds: float) -> None:
    """Suspend the computer. No drive's watchdog notices it, as with a Modbus drive that has none."""
    suspension = station.loop._suspension
    suspended_ns = suspension.read_ns() + int(seconds * 1e9)
    suspension.read_ns = lambda: suspended_ns  # type: ignore[method-assign]


def test_arm_is_not_played_on_after_a_suspension(station: SimulatedLoop) -> None:
    station.play(wave(), 1.0)
    suspend(station, 60.0)
    station.run(1.0)
    assert station.causes() == ["overrun"]
    assert station.snapshot.torque == "off"


def test_command_from_before_a_suspension_moves_nothing(station: SimulatedLoop) -> None:
    assert station.send(wave()) is None
    station.link.request(90, stamped(Approach(), station.snapshot.stops, NEVER_NS), station.config)
    suspend(station, 0.3)
    station.run(0.5)
    (refusal,) = [reply.refusal for reply in station.link.replies if reply.id == 90]
    assert refusal is not None and refusal.code == "stopped_meanwhile"
    assert station.snapshot.torque == "off"


def test_short_suspension_changes_nothing(station: SimulatedLoop) -> None:
    station.play(wave(), 0.5)
    suspend(station, 0.1)
    station.run(0.5)
    assert (station.snapshot.mode, station.causes()) == ("playing", [])
