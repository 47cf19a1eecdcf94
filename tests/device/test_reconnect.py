"""A lost connection is a stop, also if the port can be opened again before the next cycle."""

from pathlib import Path
from typing import Literal

import pytest
from msgspec import structs

from kata.device.bus.port import BusError
from kata.device.config import ModbusMap, simulated
from tests.support.simulated_loop import SimulatedLoop, wave


@pytest.mark.parametrize("during", ["poll", "write"])
@pytest.mark.parametrize(("protocol", "watchdog_ms"), [("dynamixel", 0), ("modbus", 1), ("modbus", -1)])
def test_loss_is_seen_although_the_computer_stood_still(
    tmp_path: Path,
    protocol: Literal["dynamixel", "modbus"],
    watchdog_ms: int,
    during: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The adapter is back before the computer continues. ``watchdog_ms`` of -1: the drives have no watchdog register."""
    modbus = ModbusMap() if watchdog_ms >= 0 else ModbusMap(watchdog_ms=-1)
    station = SimulatedLoop(tmp_path, structs.replace(simulated("memory"), protocol=protocol, modbus=modbus))
    station.play(wave(), 1.0)
    world, bus = station.world, station.loop._bus
    if during == "poll":
        world.fault("gone")
        station.loop.poll_estop()
    else:

        def lost(angles_deg: tuple[float, ...]) -> None:
            world.fault("gone")
            raise BusError("the port is gone")

        with monkeypatch.context() as patched:
            patched.setattr(bus, "write_setpoints", lost)
            station.tick()
    world.wait(0.3)
    world.faults.clear()
    station.run(3.0)
    assert "bus_lost" in station.causes()
    assert station.snapshot.mode == "stopped"
    assert any(event.code == "fault" for event in station.link.events)
