"""Torque is switched on at the angles that the drives have just reported, and never for a drive that has just restarted."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pytest
from msgspec import structs

from kata.device.config import Inputs, StationConfig, simulated
from kata.device.ipc_messages import Acknowledge, Approach, stamped
from kata.simulator.fault_injector import FaultKind
from tests.support.simulated_loop import SimulatedLoop, wave
from tests.support.stepped import NEVER_NS

Protocol = Literal["dynamixel", "modbus"]


def _station(protocol: Protocol, cycle_hz: int = 100) -> StationConfig:
    inputs = Inputs(estop_second_port=3, max_age_cycles=min(10, 3 * cycle_hz // 10))
    return structs.replace(
        simulated("memory"), protocol=protocol, cycle_hz=cycle_hz, rate_hz=cycle_hz, silence_ms=300, inputs=inputs
    )


Loaded = Callable[[Protocol], SimulatedLoop]


@pytest.fixture(scope="module")
def loaded_once(tmp_path_factory: pytest.TempPathFactory) -> Loaded:
    """Return the station of a protocol in which a recording is loaded. Tests use copies of it."""

    @cache
    def made(protocol: Protocol) -> SimulatedLoop:
        station = SimulatedLoop(tmp_path_factory.mktemp("loaded"), _station(protocol))
        assert station.send(wave()) is None
        station.run(0.5)
        return station

    return made


@pytest.fixture
def loaded(loaded_once: Loaded, tmp_path: Path) -> Loaded:
    """Return a station of a protocol in which a recording is loaded."""
    return lambda protocol: loaded_once(protocol).copied(tmp_path)


@pytest.fixture(scope="module")
def played_before(tmp_path_factory: pytest.TempPathFactory) -> SimulatedLoop:
    """Return a Modbus station whose drives have goals of a stopped run, and in which a recording is loaded again. Tests use copies of it."""
    station = SimulatedLoop(tmp_path_factory.mktemp("played"), _station("modbus"))
    station.play(wave(), 1.5)
    station.link.request_stop()
    station.until("stopped")
    station.run(1.0)
    assert station.send(Acknowledge()) is None
    station.place(np.array(station.world.angles_deg) - 4.0)
    assert station.send(wave()) is None
    station.run(0.5)
    return station


_NOT_STARTED: Final = {"angles_not_current", "stopped_meanwhile"}


def _refused_start(station: SimulatedLoop, motor: int) -> str:
    """Press Approach. Return the refusal's code; the motor gets no torque within a second."""
    refusal = station.send(Approach())
    assert refusal is not None
    for _ in range(station.config.cycle_hz):
        station.tick()
    seen = station.world.seen
    assert not [one for one in seen if one.motor == motor and one.what == "torque" and one.value]
    return refusal.code


@pytest.mark.parametrize("protocol", ["dynamixel", "modbus"])
@pytest.mark.parametrize("after_s", [0.02, 0.08, 0.25])
def test_approach_is_refused_while_a_drive_does_not_answer(loaded: Loaded, protocol: Protocol, after_s: float) -> None:
    """Meanwhile a hand turns the motor with 100 deg/s."""
    station = loaded(protocol)
    station.world.fault("silent", 5)
    station.run(after_s)
    station.world.place(5, station.world.angles_deg[4] - 100.0 * after_s)
    assert _refused_start(station, 5) in _NOT_STARTED


@pytest.mark.parametrize("protocol", ["dynamixel", "modbus"])
def test_approach_waits_for_a_lost_answer(loaded: Loaded, protocol: Protocol) -> None:
    """It begins at the angle to which a hand has turned the motor meanwhile."""
    station = loaded(protocol)
    station.world.fault("silent", 5)
    station.tick()
    station.world.place(5, station.world.angles_deg[4] - 10.0)
    turned_deg = station.world.angles_deg[4]
    replies = len(station.link.replies)
    station.link.request(replies, stamped(Approach(), station.snapshot.stops, NEVER_NS), station.config)
    station.tick()
    assert len(station.link.replies) == replies
    station.world.faults.clear()
    station.until("approaching")
    station.run(0.05)
    assert station.world.goals(5)[0] == pytest.approx(turned_deg, abs=1.0)


# In every run each request is lost alone and as one of three.
@pytest.mark.parametrize(
    ("after", "lost"),
    [
        pytest.param(after, lost, marks=[pytest.mark.campaign] if lost == 3 and after % 3 else [])
        for after in range(6, 15)
        for lost in (1, 3)
    ],
)
def test_modbus_drive_never_turns_to_an_old_goal(
    tmp_path: Path, played_before: SimulatedLoop, after: int, lost: int
) -> None:
    """One or three of the requests around the start do not reach the drives. Each drive has a goal of the run before."""
    station = played_before.copied(tmp_path)
    held_deg = station.world.angles_deg
    station.world.lose_requests(lost, after)
    station.link.request(99, stamped(Approach(), station.snapshot.stops, NEVER_NS), station.config)
    for _ in range(30):
        station.tick()
        assert station.world.angles_deg == pytest.approx(held_deg, abs=0.5)


def test_stop_ends_a_start_that_waits(loaded: Loaded) -> None:
    station = loaded("dynamixel")
    station.world.fault("silent", 5)
    station.tick()
    station.link.request(99, stamped(Approach(), station.snapshot.stops, NEVER_NS), station.config)
    station.tick()
    station.link.request_stop()
    station.tick()
    station.world.faults.clear()
    station.run(0.5)
    assert [reply.refusal.code for reply in station.link.replies if reply.id == 99 and reply.refusal] == [
        "stopped_meanwhile"
    ]
    assert station.snapshot.torque == "off"


@pytest.mark.parametrize("cycle_hz", [100, pytest.param(50, marks=pytest.mark.campaign), 20])
@pytest.mark.parametrize("kind", ["reboot", "exchanged"])
@pytest.mark.parametrize("cycles_before", [0, 1, 2, 3])
def test_restarted_drive_gets_no_torque_before_its_configuration(
    tmp_path: Path, cycles_before: int, kind: FaultKind, cycle_hz: int
) -> None:
    """The encoder's wrap is inside the range: motor 4 at 60 deg counts 4196, and 100 after a restart."""
    config = _station("dynamixel", cycle_hz)
    axes = tuple(structs.replace(axis, zero_count=3513) if n == 3 else axis for n, axis in enumerate(config.axes))
    station = SimulatedLoop(tmp_path, structs.replace(config, axes=axes))
    assert station.send(wave()) is None
    station.world.place(4, 60.0)
    station.run(0.5)
    station.world.fault(kind, 4)
    for _ in range(cycles_before):
        station.tick()
    assert _refused_start(station, 4) in _NOT_STARTED | {"is_stopped"}
