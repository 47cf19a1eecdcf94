"""The serial transport on a pseudo-terminal of the kernel."""

import os
import select
import termios
import time
import tty
from collections.abc import Iterator

import pytest
import serial

from kata.device.bus.interface import BusError
from kata.device.bus.serial_transport import SerialTransport

_SOON_NS = 2_000_000
_LONG_NS = 5_000_000_000


@pytest.fixture
def terminal() -> Iterator[tuple[int, str]]:
    """Return the drives' end, and the port's name."""
    drives, port = os.openpty()
    tty.setraw(port)
    yield drives, os.ttyname(port)
    os.close(port)
    os.close(drives)


@pytest.fixture
def line(terminal: tuple[int, str]) -> Iterator[SerialTransport]:
    line = SerialTransport(terminal[1], 1_000_000)
    yield line
    line.close()


def received(line: SerialTransport, wait_ns: int = _LONG_NS) -> bytes:
    now_ns = time.monotonic_ns()
    return line.receive(now_ns, now_ns + wait_ns)


def test_bytes_go_out_and_come_in_again_and_again(terminal: tuple[int, str], line: SerialTransport) -> None:
    for n in range(20):
        line.send(bytes([n]) * 3)
        assert os.read(terminal[0], 10) == bytes([n]) * 3
        os.write(terminal[0], bytes([n]) * 30)
        assert received(line) == bytes([n]) * 30


def test_late_bytes_are_discarded_and_hide_no_answer(terminal: tuple[int, str], line: SerialTransport) -> None:
    for _ in range(5):
        os.write(terminal[0], b"too late")
        select.select([line._fd], [], [])
        line.send(b"?")
        os.write(terminal[0], b"answer")
        assert received(line) == b"answer"


def test_nothing_comes_until_the_deadline(line: SerialTransport) -> None:
    for _ in range(20):
        began_ns = time.monotonic_ns()
        assert received(line, _SOON_NS) == b""
        assert time.monotonic_ns() - began_ns >= _SOON_NS


def test_port_that_was_hung_up_is_lost() -> None:
    drives, port = os.openpty()
    tty.setraw(port)
    line = SerialTransport(os.ttyname(port), 1_000_000)
    os.close(port)
    os.close(drives)
    with pytest.raises(BusError, match="was disconnected"):
        received(line)
    with pytest.raises(BusError, match="was disconnected"):
        line.send(b"?")
    line.close()


def test_adapter_is_asked_for_low_latency(terminal: tuple[int, str], monkeypatch: pytest.MonkeyPatch) -> None:
    requests: list[bool] = []
    monkeypatch.setattr(serial.Serial, "set_low_latency_mode", lambda port, wanted: requests.append(wanted))
    SerialTransport(terminal[1], 1_000_000).close()
    assert requests == [True]


def test_adapter_pulled_out_while_opened_is_a_bus_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """pyserial passes this error of the terminal through; it is no OSError."""

    def pulled_out(*args: object, **options: object) -> None:
        raise termios.error(5, "Input/output error")

    monkeypatch.setattr("kata.device.bus.serial_transport.serial.Serial", pulled_out)
    with pytest.raises(BusError, match="/dev/gone"):
        SerialTransport("/dev/gone", 1_000_000)
