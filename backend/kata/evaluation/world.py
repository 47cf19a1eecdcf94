"""Provides the simulated apparatus without its process: drives, mechanics and bus with a stepped clock.

A driver uses a :class:`MemoryLine` instead of a serial port. Bytes take their transmission time, and waiting for them advances the clock.
"""

import heapq

from kata.device.bus.interface import BusError
from kata.device.config import StationConfig
from kata.simulator.adapter import AdapterLatency
from kata.simulator.apparatus import DriveCallback, SimulatedApparatus
from kata.simulator.drives import SIMULATED_DRIVES, MakeDrives
from kata.simulator.mechanics import MakeMechanics
from kata.simulator.plant import Plant


class MemoryLine:
    """A :class:`kata.device.bus.serial_transport.Transport` that is connected to a world."""

    def __init__(self, world: "World", baud: int) -> None:
        self._world = world
        self._baud = baud
        self._waiting: list[tuple[int, int, bytes]] = []
        self._number = 0
        self._busy_until_ns = 0
        self._times_gone = world.faults.times_gone
        self.carried = 0
        """Number of bytes sent in both directions."""

    def now_ns(self) -> int:
        """See :class:`~kata.device.bus.serial_transport.Transport`."""
        return self._world.t_ns

    def send(self, data: bytes) -> None:
        """See :class:`~kata.device.bus.serial_transport.Transport`."""
        self._check()
        world = self._world
        self.pump(world.t_ns)
        while self._waiting and self._waiting[0][0] <= world.t_ns:
            heapq.heappop(self._waiting)
        self.carried += len(data)
        self._busy_until_ns = max(self._busy_until_ns, world.t_ns) + len(data) * 10_000_000_000 // self._baud
        if world.faults.has("echo"):
            self._queue_answer(self._busy_until_ns, data)
        world.line.receive(data, world.t_ns, self._baud)

    def receive(self, earliest_ns: int, deadline_ns: int) -> bytes:
        """See :class:`~kata.device.bus.serial_transport.Transport`."""
        self._check()
        world = self._world
        # A transport may sleep until the earliest time, but need not.
        until_ns = max(world.t_ns, 0 if world.byte_by_byte else min(earliest_ns, deadline_ns))
        self.pump(until_ns)
        if not (self._waiting and self._waiting[0][0] <= until_ns):
            while (due_ns := world.line.due_ns) is not None and due_ns <= deadline_ns:
                self.pump(due_ns)
            first_ns = self._waiting[0][0] if self._waiting else deadline_ns
            until_ns = max(world.t_ns, min(first_ns, deadline_ns))
        world.t_ns = until_ns
        received = b""
        while self._waiting and self._waiting[0][0] <= until_ns:
            received += heapq.heappop(self._waiting)[2]
        self.carried += len(received)
        return received

    def close(self) -> None:
        """See :class:`~kata.device.bus.serial_transport.Transport`."""
        self._waiting.clear()

    def pump(self, until_ns: int) -> None:
        """Deliver sent bytes to the drives when they are due."""
        line = self._world.line
        while (due_ns := line.due_ns) is not None and due_ns <= until_ns:
            for at_ns, answer in line.execute(due_ns):
                self._queue_answer(self._world.latency.arrival_ns(at_ns + int(answer.after_s * 1e9)), answer.data)

    def _queue_answer(self, at_ns: int, data: bytes) -> None:
        """Queue an answer. ``at_ns``: time of its last byte. With ``byte_by_byte`` each byte is queued separately, as by a real adapter."""
        if not self._world.byte_by_byte:
            if data:
                self._number += 1
                heapq.heappush(self._waiting, (at_ns, self._number, data))
            return
        byte_ns = 10_000_000_000 // self._baud
        for end in range(1, len(data) + 1):
            self._number += 1
            heapq.heappush(self._waiting, (at_ns - (len(data) - end) * byte_ns, self._number, data[end - 1 : end]))

    def _check(self) -> None:
        # As on a real port, replugging the adapter does not revive the connection.
        if self._world.faults.times_gone != self._times_gone:
            raise BusError("the port is gone")


class World:
    """The simulated apparatus at the serial port, and its clock."""

    def __init__(
        self,
        config: StationConfig,
        seed: int | None = None,
        on_drive_event: DriveCallback | None = None,
        *,
        turned: bool = False,
        make_mechanics: MakeMechanics = Plant,
        make_drives: MakeDrives | None = None,
    ) -> None:
        """Create the apparatus. ``make_drives``: makes drives of a protocol that the simulator does not have. For ``seed``,
        ``on_drive_event``, ``turned`` and ``make_mechanics`` see :class:`~kata.simulator.apparatus.SimulatedApparatus`.
        """
        self.config = config
        self.t_ns = 1_000_000_000_000
        self.apparatus = SimulatedApparatus(
            seed, self.t_ns, on_drive_event=on_drive_event, turned=turned, make_mechanics=make_mechanics
        )
        make_drives = make_drives or SIMULATED_DRIVES[config.protocol]
        self.line, self.faults, self.drives = make_drives(self.apparatus, config.baud)
        self.opened: MemoryLine | None = None
        self.latency = AdapterLatency()
        self.byte_by_byte = False
        """True if answers arrive byte by byte. False: each answer arrives as a whole."""

    def open_transport(self, port: str, baud: int) -> MemoryLine:
        """Open the transport, like a serial port."""
        if self.faults.has("gone"):
            raise BusError(f"{port} cannot be opened")
        self.opened = MemoryLine(self, baud)
        return self.opened

    def sleep(self, seconds: float) -> None:
        """Advance the clock without bus traffic. The mechanics follow at the next request."""
        self.t_ns += round(seconds * 1e9)
        if self.opened:
            self.opened.pump(self.t_ns)

    def wait(self, seconds: float) -> None:
        """Advance the clock and the mechanics."""
        self.sleep(seconds)
        self.apparatus.advance(self.t_ns)
