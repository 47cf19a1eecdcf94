"""Torque is switched on at the angles that the drives have just reported, and never for a drive that has just restarted."""

from pathlib import Path
from typing import Literal

import pytest
from msgspec import structs

from kata.device.config import Inputs, StationConfig, simulated
from kata.device.ipc_messages import Approach
from kata.simulator.fault_injector import FaultKind
from tests.support.simulated_loop import SimulatedLoop, wave


def _station(protocol: Literal["dynamixel", "modbus"], cycle_hz: int = 100) -> StationConfig:
    inputs = Inputs(estop_second_port=3, max_age_cycles=min(10, 3 * cycle_hz // 10))
    return structs.replace(
        simulated("memory"), protocol=protocol, cycle_hz=cycle_hz, rate_hz=cycle_hz, silence_ms=300, inputs=inputs
    )


@pytest.mark.parametrize("protocol", ["dynamixel", "modbus"])
@pytest.mark.parametrize("after_s", [0.02, 0.08, 0.25])
def test_approach_is_refused_while_a_drive_does_not_answer(
    tmp_path: Path, protocol: Literal["dynamixel", "modbus"], after_s: float
) -> None:
    """Meanwhile a hand turns the motor with 100 deg/s."""
    station = SimulatedLoop(tmp_path, _station(protocol))
    assert station.send(wave()) is None
    station.run(0.5)
    station.world.fault("silent", 5)
    station.run(after_s)
    station.world.place(5, station.world.angles_deg[4] - 100.0 * after_s)
    refusal = station.send(Approach())
    assert refusal is not None
    assert refusal.code == "angles_not_current"
    assert "Motor 5" in refusal.message
    station.world.faults.clear()
    station.run(0.5)
    assert station.snapshot.torque == "off"
    assert station.send(Approach()) is None


@pytest.mark.parametrize("cycle_hz", [100, 50, 20])
@pytest.mark.parametrize("kind", ["reboot", "exchanged"])
def test_restarted_drive_gets_no_torque_before_its_configuration(
    tmp_path: Path, kind: FaultKind, cycle_hz: int
) -> None:
    """The encoder's wrap is inside the range: motor 4 at 60 deg counts 4196, and 100 after a restart."""
    config = _station("dynamixel", cycle_hz)
    axes = tuple(structs.replace(axis, zero_count=3513) if n == 3 else axis for n, axis in enumerate(config.axes))
    station = SimulatedLoop(tmp_path, structs.replace(config, axes=axes))
    assert station.send(wave()) is None
    station.world.place(4, 60.0)
    station.run(0.5)
    station.world.fault(kind, 4)
    refusal = station.send(Approach())
    assert refusal is not None
    assert refusal.code == "angles_not_current"
    for _ in range(cycle_hz):
        station.tick()
        assert not station.world.torque[3]
