"""The kernel switches an adapter between sending and receiving by RTS, if the station's file says so."""

import array
import fcntl
import os
import pty
import termios
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from kata.cli import doctor
from kata.device.bus.factory import make_bus
from kata.device.bus.interface import BusError
from kata.device.config import StationConfig
from kata.settings import Settings

ENABLED, RTS_ON_SEND, RTS_AFTER_SEND = 0x01, 0x02, 0x04
"""Flags of struct serial_rs485 in linux/serial.h."""
TIOCGRS485, TIOCSRS485 = 0x542E, 0x542F


@pytest.fixture
def port() -> Iterator[str]:
    """Return the path of a terminal whose kernel driver knows no RS-485 mode."""
    ours, theirs = pty.openpty()
    yield os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


@pytest.fixture
def flags(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Let the kernel accept the RS-485 mode. Return the flags of each request."""
    accepted: list[int] = []
    real = fcntl.ioctl

    def ioctl(fd: int, request: int, *arguments: Any) -> Any:
        if request == TIOCSRS485:
            (settings,) = arguments
            assert isinstance(settings, array.array)
            accepted.append(settings[0])
            return 0
        return 0 if request == TIOCGRS485 else real(fd, request, *arguments)

    monkeypatch.setattr("serial.serialposix.fcntl.ioctl", ioctl)
    return accepted


def station(port: str, **fields: object) -> StationConfig:
    return structs.replace(StationConfig(port=port), **fields)


@pytest.mark.parametrize(
    ("rts_direction", "expected"), [("high", ENABLED | RTS_ON_SEND), ("low", ENABLED | RTS_AFTER_SEND)]
)
def test_rts_has_the_configured_level_while_sending(
    rts_direction: str, expected: int, port: str, flags: list[int]
) -> None:
    bus = make_bus(station(port, rts_direction=rts_direction))
    bus.open()
    bus.close()
    assert set(flags) == {expected}


def test_the_kernel_mode_stays_unchanged_by_default(port: str, flags: list[int]) -> None:
    bus = make_bus(station(port))
    bus.open()
    bus.close()
    assert flags == []


def test_an_adapter_pulled_out_while_it_is_switched_is_named(port: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """pyserial passes this error of the terminal through; it is no OSError."""
    real = fcntl.ioctl

    def ioctl(fd: int, request: int, *arguments: Any) -> Any:
        if request == TIOCGRS485:
            raise termios.error(5, "Input/output error")
        return real(fd, request, *arguments)

    monkeypatch.setattr("serial.serialposix.fcntl.ioctl", ioctl)
    with pytest.raises(BusError, match=f"the adapter at {port} cannot be switched"):
        make_bus(station(port, rts_direction="high")).open()


def test_an_adapter_that_cannot_be_switched_is_named(port: str) -> None:
    bus = make_bus(station(port, rts_direction="high"))
    with pytest.raises(BusError, match=f"the adapter at {port} cannot be switched"):
        bus.open()
    # The port is free again.
    open_bus = make_bus(station(port))
    open_bus.open()
    open_bus.close()


@pytest.mark.parametrize(
    ("rts_direction", "state", "message"),
    [
        ("off", "ok", "by itself"),
        ("high", "problem", "cannot be switched between sending and receiving by RTS"),
    ],
)
def test_the_doctor_says_who_switches_the_adapter(
    rts_direction: str, state: str, message: str, port: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "_drives", lambda station: iter(()))
    file = tmp_path / "station.toml"
    file.write_text(f'port = "{port}"\nrts_direction = "{rts_direction}"\n')
    settings = Settings(data=tmp_path, database_url="", station=file)
    (found,) = [finding for finding in doctor._station(settings) if finding.name == "Adapter's direction"]
    assert found.state == state and message in found.message


def test_the_doctor_names_the_level(port: str, flags: list[int]) -> None:
    found = doctor._direction(station(port, rts_direction="low"))
    assert (found.state, found.message) == ("ok", "The kernel switches it by RTS, which is low while Kata sends.")
