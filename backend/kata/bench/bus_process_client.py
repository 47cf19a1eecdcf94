"""Starts and controls :mod:`kata.bench.bus_process`. It is a separate module, because that module imports as little as possible."""

import select
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import msgspec

from kata.bench.bus_cycle import CycleFigures, CycleOrder
from kata.bench.running_service import BenchError

_ANSWER_LIMIT_S: Final = 120.0
_END_LIMIT_S: Final = 5.0


class BusProcess:
    """A process that drives the bus and has its port open."""

    def __init__(self, child: "subprocess.Popen[bytes]") -> None:
        """Wait until the port is open.

        :raises BenchError: when the process could not open it.
        """
        self._child = child
        self.real_time = self._line() == b"real time"
        """True if the process has SCHED_FIFO."""

    def measure(self, order: CycleOrder) -> CycleFigures:
        """Measure the ordered cycles. Return their figures.

        :raises BenchError: when the process does not answer.
        """
        assert self._child.stdin is not None
        self._child.stdin.write(msgspec.json.encode(order) + b"\n")
        self._child.stdin.flush()
        return msgspec.json.decode(self._line(), type=CycleFigures)

    def _line(self) -> bytes:
        assert self._child.stdout is not None and self._child.stderr is not None
        ready, _, _ = select.select([self._child.stdout], [], [], _ANSWER_LIMIT_S)
        if not ready:
            raise BenchError("the process that drives the bus hangs")
        line = self._child.stdout.readline()
        if not line:
            lines = self._child.stderr.read().decode(errors="replace").splitlines()
            raise BenchError(f"the process that drives the bus has ended: {lines[-1] if lines else 'no reason given'}")
        return line.rstrip()


@contextmanager
def bus_process(name: str, station: Path, *, real_time: bool) -> Iterator[BusProcess]:
    """Run a process with the port open during the block."""
    command = [sys.executable, "-m", "kata.bench.bus_process", "--name", name, "--station", str(station)]
    if not real_time:
        command.append("--no-real-time")
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as child:
        assert child.stdin is not None
        try:
            yield BusProcess(child)
            child.stdin.close()
            child.wait(_END_LIMIT_S)
        finally:
            child.kill()
