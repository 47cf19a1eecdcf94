"""Simulates the drives' side of a serial port: delivers requests and answers after their transmission times."""

import contextlib
import heapq
import time
from collections.abc import Callable

from kata.simulator.adapter import AdapterLatency
from kata.simulator.bus_answer import transmission_s
from kata.simulator.fault_injector import FaultInjector
from kata.simulator.lines import BusLine
from kata.simulator.ports import Port


class Wire:
    """The bus between the drives and a port. The port has the same path after it was unplugged, like a serial adapter's path by id."""

    def __init__(
        self,
        line: BusLine,
        faults: FaultInjector,
        open_port: Callable[[], Port],
        latency: AdapterLatency | None = None,
    ) -> None:
        """Open the port. ``latency``: latency of the adapter."""
        self._latency = latency or AdapterLatency()
        self._line = line
        self._faults = faults
        self._open_port = open_port
        self._port: Port | None = None
        self._outgoing: list[tuple[int, int, bytes]] = []
        self._order = 0
        self._plug_in()

    @property
    def sources(self) -> list[int]:
        """The file descriptors to wait for."""
        return self._port.sources if self._port else []

    @property
    def due_ns(self) -> int | None:
        """Time of the next work; None if there is none."""
        sending_ns = self._outgoing[0][0] if self._outgoing else None
        return min((due for due in (sending_ns, self._line.due_ns) if due is not None), default=None)

    def receive(self) -> None:
        """Read the received bytes."""
        if self._port is None:
            return
        with contextlib.suppress(BlockingIOError):
            data = self._port.read()
            now_ns = time.monotonic_ns()
            baud = self._port.baud
            if self._faults.has("echo"):
                self._send_at(now_ns + (int(transmission_s(len(data), baud) * 1e9) if baud else 0), data)
            self._line.receive(data, now_ns, baud)

    def serve(self, now_ns: int) -> None:
        """Execute due requests and send due answers."""
        for at_ns, answer in self._line.execute(now_ns):
            self._send_at(self._latency.arrival_ns(at_ns + int(answer.after_s * 1e9)), answer.data)
        while self._outgoing and self._outgoing[0][0] <= now_ns:
            _, _, data = heapq.heappop(self._outgoing)
            if self._port:
                # Without a reader the bytes are lost, as on a real bus.
                with contextlib.suppress(BlockingIOError):
                    self._port.write(data)
        if self._faults.has("gone") != (self._port is None):
            self._plug_in() if self._port is None else self._pull_out()

    def close(self) -> None:
        """Close the port and remove its path."""
        if self._port:
            self._pull_out()

    def _send_at(self, due_ns: int, data: bytes) -> None:
        self._order += 1
        heapq.heappush(self._outgoing, (due_ns, self._order, data))

    def _plug_in(self) -> None:
        self._port = self._open_port()

    def _pull_out(self) -> None:
        assert self._port is not None
        self._port.close()
        self._port = None
        self._outgoing.clear()
