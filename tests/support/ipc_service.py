"""The service end of the link to the device process."""

import queue
import socket
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec

from kata.device.config import StationConfig
from kata.device.ipc import SocketServiceLink
from kata.device.ipc_messages import (
    Command,
    FromDevice,
    Load,
    LoadPart,
    Reply,
    Request,
    ToDevice,
    frame,
    frames,
    parts_of,
)
from kata.device.journal import JournalDisk
from kata.device.journal_set import JournalSet
from kata.device.loader import Result
from kata.device.references import Reference, build
from tests.support.load_messages import message

LIMIT_S = 10.0


def until(condition: Callable[[], object]) -> None:
    limit = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < limit
        time.sleep(0.001)


class FakeLoader:
    """A builder that answers when the test lets it, or never."""

    def __init__(self) -> None:
        self.sent: list[Request | LoadPart] = []
        self._results: queue.SimpleQueue[tuple[int, Result]] = queue.SimpleQueue()

    def send(self, message: Request | LoadPart) -> None:
        self.sent.append(message)

    def results(self) -> Iterator[tuple[int, Result]]:
        while not self._results.empty():
            yield self._results.get()

    def answer(self, number: int, result: Result) -> None:
        self._results.put((number, result))


class Service:
    """The service's end of the socket, and a link whose threads only run when they are started."""

    def __init__(self, folder: Path, files: JournalDisk | None = None) -> None:
        self._socket, self._device = socket.socketpair()
        self._socket.settimeout(LIMIT_S)
        self._incoming = bytearray()
        self._heard: deque[Any] = deque()
        self._decoder = msgspec.msgpack.Decoder(FromDevice)
        self.loader = FakeLoader()
        self.link = SocketServiceLink(StationConfig(), self._device, JournalSet(folder, files), self.loader)

    def send(self, message: ToDevice) -> None:
        self._socket.sendall(frame(message))

    def ask(self, number: int, command: Command) -> None:
        self.send(Request(id=number, command=command))

    def deliver(self, number: int, command: Command) -> None:
        """Do the I/O thread's work in this thread."""
        parts = parts_of(number, command) if isinstance(command, Load) else [Request(id=number, command=command)]
        for part in parts:
            self.take(part)

    def take(self, message: ToDevice) -> None:
        self.link._decode(msgspec.msgpack.encode(message))

    def hear(self) -> Any:
        """Wait for the next message."""
        while not self._heard:
            data = self._socket.recv(1 << 20)
            assert data
            self._incoming += data
            self._heard += [self._decoder.decode(found) for found in frames(self._incoming)]
        return self._heard.popleft()

    def answers(self) -> list[tuple[int, str | None]]:
        """Return all answers so far, without running threads: id and the refusal's code."""
        self.link.wake()
        letters = self.link._outbound_messages
        found = [letter for letter in letters if isinstance(letter, Reply)]
        letters.clear()
        return [(reply.id, reply.refusal.code if reply.refusal else None) for reply in found]

    def close(self) -> None:
        self._socket.close()
        self._device.close()


def a_reference() -> Reference:
    built = build(message(), StationConfig())
    assert isinstance(built, Reference)
    return built
