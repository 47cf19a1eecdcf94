"""The acceptance test's station leaves no torque behind."""

from dataclasses import dataclass, field
from unittest import mock

import pytest

from kata.commissioning.direct_station import DirectStation, PlaybackError
from kata.device.bus.dynamixel.driver import DynamixelBus
from kata.device.bus.interface import BusError, BusSample, DriveStatus
from kata.testing.world import RecordingWorld


@dataclass
class _Drives:
    """Five drives that miss the first messages."""

    lost: int
    gone: bool = False
    torque: list[bool] = field(default_factory=lambda: [True] * 5)
    closed: bool = False

    def torque_off(self) -> None:
        if self.gone:
            raise BusError("the port is gone")
        self.lost -= 1
        if self.lost < 0:
            self.torque = [False] * 5

    def read(self) -> BusSample:
        statuses = [DriveStatus(0, axis, on, 0, watchdog_tripped=False) for axis, on in enumerate(self.torque)]
        return BusSample((None,) * 5, None, tuple(statuses))

    def close(self) -> None:
        self.closed = True


def closed(drives: _Drives) -> _Drives:
    station = DirectStation.__new__(DirectStation)
    station._bus = drives  # type: ignore[assignment]
    station.close()
    return drives


def test_lost_torque_off_is_repeated() -> None:
    drives = closed(_Drives(lost=3))
    assert (drives.torque, drives.closed) == ([False] * 5, True)


def test_port_is_closed_also_when_it_is_gone() -> None:
    assert closed(_Drives(lost=0, gone=True)).closed


@pytest.mark.parametrize("problem", ["no apparatus", "interrupted"])
def test_station_that_does_not_connect_closes_its_port(problem: str) -> None:
    world = RecordingWorld()
    closed: list[str] = []
    bus_closed = DynamixelBus.close

    def close(bus: DynamixelBus) -> None:
        closed.append("port")
        bus_closed(bus)

    def sleep(seconds: float) -> None:
        if problem == "interrupted":
            raise KeyboardInterrupt
        world.wait(seconds)

    for motor in range(1, 6):
        world.fault("off", motor)
    with mock.patch.object(DynamixelBus, "close", close), pytest.raises((PlaybackError, KeyboardInterrupt)):
        DirectStation(world.config, world.open_transport, lambda: world.t_ns, sleep)
    assert closed[-1:] == ["port"]
