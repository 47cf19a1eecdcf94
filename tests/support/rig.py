"""The real processes without a service: a simulated apparatus, the device process and the test at its socket."""

import select
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import msgspec

from kata.device import config
from kata.device.ipc_messages import (
    Command,
    Event,
    FromDevice,
    Guarded,
    Heartbeat,
    JournalClosed,
    Refusal,
    Reply,
    Request,
    Snapshot,
    frame,
    frames,
)
from kata.device.refusals import ANGLES_NOT_CURRENT
from kata.simulator.apparatus import SimulatorEvent
from kata.simulator.process import SimulatorProcess

_EXPIRES_NS = 20_000_000_000
"""As long as the time-out of an answer, so that no command expires in these tests."""
_AGAIN = frozenset({"not_verified", ANGLES_NOT_CURRENT})
"""Refusals after which a command is sent again."""
_AGAIN_S = 20.0


class Rig:
    """Starts both processes in a folder; every wait is for an event and has a limit."""

    def __init__(
        self, folder: Path, protocol: Literal["dynamixel", "modbus"] = "dynamixel", **settings: object
    ) -> None:
        self.folder = folder
        self.config = msgspec.structs.replace(config.simulated("not yet known"), protocol=protocol, **settings)
        self.simulator = SimulatorProcess(folder, protocol=protocol, baud=self.config.baud)
        self.hand = self.simulator.client()
        self.config = msgspec.structs.replace(self.config, port=self.simulator.port)
        station = folder / "station.toml"
        config.write(self.config, station)
        self.journals = folder / "journal"
        ours, theirs = socket.socketpair()
        self._log = (folder / "device.log").open("ab")
        self.device = subprocess.Popen(
            [sys.executable, "-m", "kata.device", "--station", str(station), "--journal", str(self.journals),
             "--socket", str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            stderr=self._log,
        )  # fmt: skip
        theirs.close()
        self._socket = ours
        self._incoming = bytearray()
        self._decoder = msgspec.msgpack.Decoder(FromDevice)
        self._requests = 0
        self._replies: dict[int, Reply] = {}
        self.heartbeats = True
        self.believed: str | None = None
        """Run id in the heartbeats."""
        self.snapshots: list[Snapshot] = []
        self.events: list[Event] = []
        self.closed: list[Path] = []

    @property
    def snapshot(self) -> Snapshot:
        return self.snapshots[-1]

    @property
    def answered(self) -> bool:
        """True if every command has been answered."""
        return len(self._replies) == self._requests

    def pump(self) -> None:
        """Send a heartbeat and receive messages for 20 ms."""
        if self.heartbeats:
            self._send(Heartbeat(run_id=self.believed))
        readable, _, _ = select.select([self._socket], [], [], 0.02)
        if not readable:
            return
        data = self._socket.recv(1 << 20)
        if not data:
            raise AssertionError("the device process is gone:\n" + (self.folder / "device.log").read_text())
        self._incoming += data
        for encoded in frames(self._incoming):
            message = self._decoder.decode(encoded)
            match message:
                case Snapshot():
                    self.snapshots.append(message)
                case Event():
                    self.events.append(message)
                case JournalClosed():
                    self.closed.append(Path(message.path))
                case Reply():
                    self._replies[message.id] = message

    def until(self, condition: Callable[[], object], within_s: float = 20.0) -> None:
        """Pump until a condition holds."""
        limit = time.monotonic() + within_s
        while not condition():
            assert time.monotonic() < limit, f"not within {within_s} s; {self.snapshots[-1:]}"
            self.pump()

    def until_mode(self, mode: str, within_s: float = 60.0) -> None:
        """Pump until the apparatus is in this mode."""
        self.until(lambda: self.snapshots and self.snapshot.mode == mode, within_s)

    def send(self, command: Command) -> Refusal | None:
        """Send and wait for the answer; send again, like a person who presses again, after a lost answer of a drive, as on a busy computer.

        The drive's angles are then not current for a cycle, and its settings are checked once more.
        """
        limit = time.monotonic() + _AGAIN_S
        refusal = self._refusal_of(command)
        while refusal is not None and refusal.code in _AGAIN and time.monotonic() < limit:
            self.until(lambda: all(refusal.code != "not_verified" for refusal in self.snapshot.refusals.values()))
            refusal = self._refusal_of(command)
        return refusal

    def happened(self, what: str) -> list[SimulatorEvent]:
        """Return the simulator's events."""
        return [event for event in self.hand.state().events if event.what == what]

    def hang_up(self) -> None:
        """Close the socket, like a dead service."""
        self._socket.close()

    def close(self) -> None:
        self._socket.close()
        try:
            self.device.wait(5.0)
        finally:
            self.device.kill()
            self.device.wait()
            self.hand.close()
            self.simulator.close()
            self._log.close()

    def _refusal_of(self, command: Command) -> Refusal | None:
        """Send and wait for the answer. A guarded command is based on the newest snapshot."""
        if isinstance(command, Guarded):
            expires_ns = time.monotonic_ns() + _EXPIRES_NS
            command = msgspec.structs.replace(command, stops=self.snapshot.stops, expires_ns=expires_ns)
        self._requests += 1
        number = self._requests
        self._send(Request(id=number, command=command))
        self.until(lambda: number in self._replies)
        return self._replies[number].refusal

    def _send(self, message: Request | Heartbeat) -> None:
        self._socket.sendall(frame(message))
