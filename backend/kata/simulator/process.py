"""The simulator's process: the pseudo-terminal, the control socket, and one loop that serves both; and its parent's side."""

import argparse
import contextlib
import gc
import heapq
import json
import logging
import os
import select
import signal
import subprocess
import sys
import tempfile
import termios
import time
import tty
from pathlib import Path
from typing import Final

from kata.simulator.apparatus import Apparatus
from kata.simulator.bus import ServoBus
from kata.simulator.client import SimulatorClient
from kata.simulator.control import ControlServer
from kata.simulator.protocol import Instruction, InstructionParser

log = logging.getLogger(__name__)

_TICK_S: Final = 0.02
_PRIORITY: Final = 50
_START_LIMIT_S: Final = 20.0
_BYTE_GAP_NS: Final = 5_000_000
"""A packet whose next bytes stay away for longer is given up: its length was damaged, or its sender has gone."""
_BAUD_OF_SPEED: Final = {
    getattr(termios, name): int(name[1:]) for name in dir(termios) if name[0] == "B" and name[1:].isdigit()
}


class Wire:
    """The pseudo-terminal's drive side: instructions come when their bytes have passed, and so do the answers."""

    def __init__(self, apparatus: Apparatus) -> None:
        self._apparatus = apparatus
        self._bus = ServoBus(apparatus)
        self.fd, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self.fd, False)
        self.port = os.ttyname(self._slave)
        self._parser = InstructionParser()
        self._coming: list[tuple[int, int, Instruction]] = []
        self._going: list[tuple[int, int, bytes]] = []
        self._order = 0
        self._busy_until_ns = 0
        self._heard_ns = 0

    def receive(self) -> None:
        """Bytes have come."""
        with contextlib.suppress(BlockingIOError):
            data = os.read(self.fd, 4096)
            now_ns = time.monotonic_ns()
            if now_ns - self._heard_ns > _BYTE_GAP_NS:
                self._parser.forget()
            self._heard_ns = now_ns
            baud = self._baud()
            for instruction in self._parser.feed(data):
                self._busy_until_ns = max(self._busy_until_ns, now_ns) + self._span_ns(instruction.size, baud)
                heapq.heappush(self._coming, (self._busy_until_ns, self._next(), instruction))

    def due_s(self, now_ns: int) -> float:
        """How long until something is due; not longer than a tick."""
        first = min((queue[0][0] for queue in (self._coming, self._going) if queue), default=None)
        return _TICK_S if first is None else min(_TICK_S, max(0, first - now_ns) / 1e9)

    def serve(self, now_ns: int) -> None:
        """Carry out and send what is due."""
        while self._coming and self._coming[0][0] <= now_ns:
            at_ns, _, instruction = heapq.heappop(self._coming)
            for answer in self._bus.carry_out(instruction, self._baud(), at_ns):
                due_ns = at_ns + int(answer.after_s * 1e9)
                self._busy_until_ns = max(self._busy_until_ns, due_ns)
                heapq.heappush(self._going, (due_ns, self._next(), answer.data))
        while self._going and self._going[0][0] <= now_ns:
            # Nobody reads: the bytes are lost, as on a real wire.
            with contextlib.suppress(BlockingIOError):
                os.write(self.fd, heapq.heappop(self._going)[2])

    def _baud(self) -> int:
        return _BAUD_OF_SPEED.get(termios.tcgetattr(self._slave)[4], 0)

    def _span_ns(self, size: int, baud: int) -> int:
        return int(size * self._bus.byte_s(baud) * 1e9) if baud else 0

    def _next(self) -> int:
        self._order += 1
        return self._order


def main() -> int:
    """Entry of ``python -m kata.simulator``."""
    parser = argparse.ArgumentParser(prog="python -m kata.simulator", description=__doc__)
    parser.add_argument("--control", type=Path, required=True, help="path of the control socket")
    parser.add_argument("--seed", type=int, default=None, help="vary inertia, friction and weight by up to 30 %%")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s simulator %(levelname)s %(message)s")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    apparatus = Apparatus(arguments.seed)
    wire = Wire(apparatus)
    control = ControlServer(arguments.control, apparatus)
    with contextlib.suppress(OSError):  # best effort: on a busy computer the drives would else seem to stutter
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    gc.collect()
    gc.freeze()
    sys.stdout.write(json.dumps({"port": wire.port}) + "\n")
    sys.stdout.flush()
    try:
        _serve(apparatus, wire, control)
    finally:
        control.close()
    return 0


def _serve(apparatus: Apparatus, wire: Wire, control: ControlServer) -> None:
    """Until the parent's end of our standard input is gone."""
    stdin = sys.stdin.fileno()
    while True:
        sources = [wire.fd, stdin, *control.sockets]
        readable, _, _ = select.select(sources, [], [], wire.due_s(time.monotonic_ns()))
        if wire.fd in readable:
            wire.receive()
        now_ns = time.monotonic_ns()
        wire.serve(now_ns)
        apparatus.advance(now_ns)
        control.serve(readable)
        if stdin in readable and not os.read(stdin, 4096):
            return


class SimulatorError(Exception):
    """The simulator could not be started; the message says why."""


class SimulatorProcess:
    """A simulator running as a child process; ends when it is closed, or with us."""

    def __init__(self, folder: Path, seed: int | None = None) -> None:
        """Start it and wait until it is ready; its log goes to ``folder``.

        :raises SimulatorError: when it does not come up.
        """
        # A path of its own for each start, and short: a socket's path may have 107 bytes.
        self._socket_folder = tempfile.TemporaryDirectory(prefix="kata-", ignore_cleanup_errors=True)
        self._control = Path(self._socket_folder.name) / "simulator.sock"
        command = [sys.executable, "-m", "kata.simulator", "--control", str(self._control)]
        if seed is not None:
            command += ["--seed", str(seed)]
        self._log = (folder / "simulator.log").open("ab")
        self._child = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, start_new_session=True
        )
        self.port = self._wait_until_ready(folder)

    def client(self) -> SimulatorClient:
        """A connection to hand, pedal and switch."""
        return SimulatorClient(self._control)

    @property
    def pid(self) -> int:
        """Its process."""
        return self._child.pid

    def close(self) -> None:
        """End it."""
        assert self._child.stdin is not None and self._child.stdout is not None
        self._child.stdin.close()
        try:
            self._child.wait(2.0)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._child.stdout.close()
        self._log.close()
        self._socket_folder.cleanup()

    def _wait_until_ready(self, folder: Path) -> str:
        assert self._child.stdout is not None
        readable, _, _ = select.select([self._child.stdout], [], [], _START_LIMIT_S)
        line = self._child.stdout.readline() if readable else b""
        try:
            return str(json.loads(line)["port"])
        except (ValueError, KeyError) as error:
            self._child.kill()
            self.close()
            tail = (folder / "simulator.log").read_text(errors="replace")[-500:].strip()
            raise SimulatorError(f"the simulated apparatus did not start: {tail or 'no answer'}") from error
