"""The benchmark's end of a process that drives a bus: see :mod:`kata.bench.bus_process`, which imports as little as it can."""

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
    """One such process, its port open."""

    def __init__(self, child: "subprocess.Popen[bytes]") -> None:
        """:raises BenchError: when it could not open the port."""
        self._child = child
        self.real_time = self._line() == b"real time"
        """SCHED_FIFO was granted to it."""

    def measure(self, order: CycleOrder) -> CycleFigures:
        """:raises BenchError: when it does not answer."""
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
            told = self._child.stderr.read().decode(errors="replace").strip()
            raise BenchError(
                f"the process that drives the bus has ended: {told.splitlines()[-1] if told else 'unsaid'}"
            )
        return line.rstrip()


@contextmanager
def bus_process(name: str, station: Path, *, real_time: bool) -> Iterator[BusProcess]:
    """A process with the port open, while the block lasts."""
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
