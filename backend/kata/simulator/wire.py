"""Simulates the drives' side of the pseudo-terminal: delivers requests and answers after their transmission times."""

import contextlib
import fcntl
import heapq
import os
import struct
import time
import tty
from pathlib import Path
from typing import Final

from kata.simulator.adapter import AdapterLatency
from kata.simulator.bus_answer import transmission_s
from kata.simulator.fault_injector import FaultInjector
from kata.simulator.lines import BusLine

_GET_TERMIOS_2: Final = 0x802C542A
"""TCGETS2. Unlike termios it returns the rate as a number, even if the rate was set as a number (as Rust libraries do)."""
_TERMIOS_2: Final = struct.Struct("@4I20s2I")
"""Format of four sets of flags, line discipline and control characters, and input and output rate."""


class Wire:
    """A pseudo-terminal with a constant path, like a serial adapter's path by id. The path stays the same after unplugging."""

    def __init__(self, line: BusLine, faults: FaultInjector, path: Path, latency: AdapterLatency | None = None) -> None:
        """Open the pseudo-terminal. ``path``: becomes a link to it. ``latency``: latency of the adapter."""
        self._latency = latency or AdapterLatency()
        self._line = line
        self._faults = faults
        self._path = path
        self._fd: int | None = None
        self._slave = -1
        self._outgoing: list[tuple[int, int, bytes]] = []
        self._order = 0
        self._plug_in()

    @property
    def sources(self) -> list[int]:
        """The file descriptors to wait for."""
        return [] if self._fd is None else [self._fd]

    @property
    def due_ns(self) -> int | None:
        """Time of the next work; None if there is none."""
        sending_ns = self._outgoing[0][0] if self._outgoing else None
        return min((due for due in (sending_ns, self._line.due_ns) if due is not None), default=None)

    def receive(self) -> None:
        """Read the received bytes."""
        if self._fd is None:
            return
        with contextlib.suppress(BlockingIOError):
            data = os.read(self._fd, 4096)
            now_ns = time.monotonic_ns()
            baud = _baud(self._slave)
            if self._faults.has("echo"):
                self._send_at(now_ns + (int(transmission_s(len(data), baud) * 1e9) if baud else 0), data)
            self._line.receive(data, now_ns, baud)

    def serve(self, now_ns: int) -> None:
        """Execute due requests and send due answers."""
        for at_ns, answer in self._line.execute(now_ns):
            self._send_at(self._latency.arrival_ns(at_ns + int(answer.after_s * 1e9)), answer.data)
        while self._outgoing and self._outgoing[0][0] <= now_ns:
            _, _, data = heapq.heappop(self._outgoing)
            if self._fd is not None:
                # Without a reader the bytes are lost, as on a real bus.
                with contextlib.suppress(BlockingIOError):
                    os.write(self._fd, data)
        if self._faults.has("gone") != (self._fd is None):
            self._plug_in() if self._fd is None else self._pull_out()

    def close(self) -> None:
        """Close the pseudo-terminal and remove the link."""
        if self._fd is not None:
            self._pull_out()

    def _send_at(self, due_ns: int, data: bytes) -> None:
        self._order += 1
        heapq.heappush(self._outgoing, (due_ns, self._order, data))

    def _plug_in(self) -> None:
        self._fd, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._fd, False)
        self._path.unlink(missing_ok=True)
        self._path.symlink_to(os.ttyname(self._slave))

    def _pull_out(self) -> None:
        assert self._fd is not None
        self._path.unlink(missing_ok=True)
        os.close(self._slave)
        os.close(self._fd)
        self._fd = None
        self._outgoing.clear()


def _baud(terminal: int) -> int:
    """Return the terminal's baud rate; 0 if none is set."""
    settings = fcntl.ioctl(terminal, _GET_TERMIOS_2, bytes(_TERMIOS_2.size))
    return int(_TERMIOS_2.unpack(settings)[5])
