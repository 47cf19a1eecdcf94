"""The simulated apparatus' socket, reached by the device's own transport."""

import socket
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from kata.device.bus.interface import BusError
from kata.device.bus.serial_transport import SerialTransport, SocketTransport, Transport, open_port
from kata.simulator.ports import SocketPort, TerminalPort

_BAUD = 1_000_000
_LONG_NS = 5_000_000_000


@pytest.fixture
def path() -> Iterator[Path]:
    """Return a path that is short enough for a socket."""
    with tempfile.TemporaryDirectory(prefix="kata-") as folder:
        yield Path(folder) / "port"


@pytest.fixture
def port(path: Path) -> Iterator[SocketPort]:
    port = SocketPort(path)
    yield port
    port.close()


def arrived(port: SocketPort) -> bytes:
    """Return the bytes that are there; nothing if there are none."""
    try:
        return port.read()
    except BlockingIOError:
        return b""


def received(transport: Transport) -> bytes:
    now_ns = time.monotonic_ns()
    return transport.receive(now_ns, now_ns + _LONG_NS)


def connected(port: SocketPort, path: Path) -> Transport:
    transport = open_port(str(path), _BAUD)
    assert arrived(port) == b""
    return transport


def test_bytes_go_out_and_come_in_again_and_again(port: SocketPort, path: Path) -> None:
    transport = connected(port, path)
    for n in range(20):
        transport.send(bytes([n]) * 3)
        assert arrived(port) == bytes([n]) * 3
        port.write(bytes([n]) * 30)
        assert received(transport) == bytes([n]) * 30
    transport.close()


def test_late_bytes_are_discarded_and_hide_no_answer(port: SocketPort, path: Path) -> None:
    transport = connected(port, path)
    for _ in range(5):
        port.write(b"too late")
        transport.send(b"?")
        port.write(b"answer")
        assert received(transport) == b"answer"
    transport.close()


def test_drives_learn_the_baud_rate_of_each_connection(port: SocketPort, path: Path) -> None:
    for baud in (57_600, 4_000_000):
        assert port.baud == 0
        transport = open_port(str(path), baud)
        assert arrived(port) == arrived(port) == b""
        assert port.baud == baud
        transport.close()
        assert arrived(port) == b""


def test_baud_rate_may_arrive_in_parts(port: SocketPort, path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        client.connect(str(path))
        sent = _BAUD.to_bytes(4, sys.byteorder) + b"first"
        assert arrived(port) == b""
        for part in (sent[:1], sent[1:3]):
            client.sendall(part)
            assert (arrived(port), port.baud) == (b"", 0)
        client.sendall(sent[3:])
        assert (arrived(port), port.baud) == (b"first", _BAUD)


def test_second_program_cannot_use_the_port(port: SocketPort, path: Path) -> None:
    first = connected(port, path)
    second = open_port(str(path), _BAUD)
    assert arrived(port) == arrived(port) == b""
    with pytest.raises(BusError, match="was disconnected"):
        received(second)
    first.send(b"?")
    assert arrived(port) == b"?"
    second.close()
    first.close()


def test_another_program_may_follow(port: SocketPort, path: Path) -> None:
    connected(port, path).close()
    port.write(b"lost")
    second = open_port(str(path), _BAUD)
    assert arrived(port) == arrived(port) == b""
    second.send(b"?")
    assert arrived(port) == b"?"
    second.close()


def test_pulled_adapter_is_lost_and_returns_at_its_path(path: Path) -> None:
    port = SocketPort(path)
    transport = connected(port, path)
    port.close()
    with pytest.raises(BusError, match="was disconnected"):
        received(transport)
    with pytest.raises(BusError):
        transport.send(b"?")
    transport.close()
    with pytest.raises(BusError):
        open_port(str(path), _BAUD)
    port = SocketPort(path)
    open_port(str(path), _BAUD).close()
    port.close()


def test_path_without_a_listening_simulator_is_reported(path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as closed:
        closed.bind(str(path))
    with pytest.raises(BusError, match="cannot be opened"):
        open_port(str(path), _BAUD)


def test_kind_of_the_path_chooses_the_transport(port: SocketPort, path: Path) -> None:
    opened = open_port(str(path), _BAUD)
    assert isinstance(opened, SocketTransport)
    opened.close()
    link = path.with_name("terminal")
    terminal = TerminalPort(link)
    serial = open_port(str(link), _BAUD)
    assert isinstance(serial, SerialTransport)
    assert terminal.baud == _BAUD
    serial.close()
    terminal.close()
