"""Runs a device process with a simulated apparatus and without a service. The benchmark has the service's end of the socket."""

import itertools
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import msgspec

from kata.bench.running_service import BenchError
from kata.device import config
from kata.device.ipc_messages import (
    Command,
    FromDevice,
    Heartbeat,
    Refusal,
    Reply,
    Request,
    Snapshot,
    frame,
    frames,
    frames_of,
)
from kata.simulator.process import SimulatorProcess

_HEARTBEAT_S: Final = 0.05
_ANSWER_LIMIT_S: Final = 60.0
_END_LIMIT_S: Final = 10.0


@dataclass(frozen=True)
class Answered:
    """A reply, and the time of its arrival (``time.monotonic_ns``)."""

    at_ns: int
    refusal: Refusal | None


class Device:
    """The device process and the simulator, with threads that send heartbeats and receive. The end of the ``with`` block ends them.

    Several threads may send at once. Frames never mix. As in the service, other frames may be sent between the parts of a Load.
    """

    def __init__(self, folder: Path, *, cycle_hz: int, real_time: bool, module: str = "kata.device") -> None:
        """Start both processes. ``module``: the module that runs as the device process."""
        folder.mkdir()
        self.simulator = SimulatorProcess(folder)
        self.hand = self.simulator.client()
        station = folder / "station.toml"
        simulated = config.simulated(self.simulator.port)
        self.config = msgspec.structs.replace(simulated, cycle_hz=cycle_hz, rate_hz=cycle_hz)
        config.write(self.config, station)
        self._socket, theirs = socket.socketpair()
        command = [sys.executable, "-m", module, "--station", str(station), "--journal", str(folder / "journal")]
        command += ["--socket", str(theirs.fileno()), *([] if real_time else ["--no-real-time"])]
        with theirs, (folder / "device.log").open("ab") as log_file:
            self._process = subprocess.Popen(command, pass_fds=[theirs.fileno()], stderr=log_file)
        self._numbers = itertools.count(1)
        self._sending = threading.Lock()
        self._changed = threading.Condition()
        self._answers: dict[int, Answered] = {}
        self._snapshot: Snapshot | None = None
        self._gone = False
        self._closing = threading.Event()
        self._threads = [
            threading.Thread(target=part, daemon=True) for part in (self._send_heartbeats, self._receive_messages)
        ]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.set()
        self._socket.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join()
        self._socket.close()
        try:
            self._process.wait(_END_LIMIT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self.hand.close()
        self.simulator.close()

    @property
    def snapshot(self) -> Snapshot:
        """The newest snapshot.

        :raises BenchError: when none has arrived.
        """
        if self._snapshot is None:
            raise BenchError("the device process has sent no snapshot yet")
        return self._snapshot

    def until_mode(self, mode: str) -> None:
        """Wait for a snapshot in this mode.

        :raises BenchError: when none arrives in time.
        """
        self._wait(lambda: self._snapshot and self._snapshot.mode == mode, mode)

    def send(self, command: Command) -> tuple[int, int]:
        """Send a command. Return its number and the time at which its last frame was sent (``time.monotonic_ns``)."""
        number = next(self._numbers)
        parts = frames_of(Request(id=number, command=command))
        return number, self.send_frames(parts)

    def send_frames(self, parts: Iterable[bytes]) -> int:
        """Send frames. Other threads may send frames between them. Return the time at which the last frame was sent."""
        at_ns = 0
        for part in parts:
            with self._sending:
                at_ns = time.monotonic_ns()
                self._socket.sendall(part)
        return at_ns

    def send_until_answered(self, number: int, parts: Iterable[bytes]) -> None:
        """Send a Load's frames until it is answered, as the service does. The rest of a refused Load is not sent."""
        self._answers.pop(number, None)
        for part in parts:
            if number in self._answers:
                return
            self.send_frames([part])

    def answered(self, number: int) -> bool:
        """Return True if the reply to a command has arrived."""
        return number in self._answers

    def answer(self, number: int) -> Answered:
        """Wait for the reply to a command.

        :raises BenchError: when none arrives in time.
        """
        self._wait(lambda: number in self._answers, "an answer")
        return self._answers.pop(number)

    def insist(self, command: Command) -> None:
        """Send a command that must be accepted.

        :raises BenchError: when it is refused.
        """
        refusal = self.answer(self.send(command)[0]).refusal
        if refusal:
            raise BenchError(f"{type(command).__name__}: {refusal.message} {refusal.next_step}")

    def _wait(self, condition: Callable[[], object], for_what: str) -> None:
        with self._changed:
            if not self._changed.wait_for(lambda: self._gone or condition(), _ANSWER_LIMIT_S) or self._gone:
                mode = self._snapshot.mode if self._snapshot else "not connected"
                raise BenchError(f"the device process is {'gone' if self._gone else mode}; waited for {for_what}")

    def _send_heartbeats(self) -> None:
        while not self._closing.wait(_HEARTBEAT_S):
            try:
                self.send_frames([frame(Heartbeat())])
            except OSError:
                return

    def _receive_messages(self) -> None:
        incoming = bytearray()
        decoder = msgspec.msgpack.Decoder(FromDevice)
        while data := self._receive():
            at_ns = time.monotonic_ns()
            incoming += data
            with self._changed:
                for encoded in frames(incoming):
                    self._handle(decoder.decode(encoded), at_ns)
                self._changed.notify_all()
        with self._changed:
            self._gone = True
            self._changed.notify_all()

    def _receive(self) -> bytes:
        try:
            return self._socket.recv(1 << 16)
        except OSError:
            return b""

    def _handle(self, message: FromDevice, at_ns: int) -> None:
        match message:
            case Snapshot():
                self._snapshot = message
            case Reply():
                self._answers[message.id] = Answered(at_ns, message.refusal)
