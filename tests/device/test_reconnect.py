"""A lost connection is a stop, also if the port can be opened again before the next cycle."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Literal

import pytest
from msgspec import structs

from kata.device.bus.interface import BusError
from kata.device.config import ModbusMap, simulated
from tests.support.simulated_loop import SimulatedLoop, wave

Protocol = Literal["dynamixel", "modbus"]


@pytest.fixture(scope="module")
def played_once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Protocol, int], SimulatedLoop]:
    """Return the station of a protocol and a watchdog register that has played for a second. Tests use copies of it."""

    @cache
    def made(protocol: Protocol, watchdog_ms: int) -> SimulatedLoop:
        config = structs.replace(simulated("memory"), protocol=protocol, modbus=ModbusMap(watchdog_ms=watchdog_ms))
        station = SimulatedLoop(tmp_path_factory.mktemp("played"), config)
        station.play(wave(), 1.0)
        return station

    return made


@pytest.mark.parametrize("during", ["poll", "write"])
@pytest.mark.parametrize(
    ("protocol", "watchdog_ms"), [("dynamixel", -1), ("modbus", ModbusMap().watchdog_ms), ("modbus", -1)]
)
def test_loss_is_seen_although_the_computer_stood_still(
    tmp_path: Path,
    played_once: Callable[[Protocol, int], SimulatedLoop],
    protocol: Protocol,
    watchdog_ms: int,
    during: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The adapter is back before the computer continues. ``watchdog_ms`` of -1: the drives have no watchdog register."""
    station = played_once(protocol, watchdog_ms).copied(tmp_path)
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
