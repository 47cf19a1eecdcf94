"""What every benchmark prints and writes: on which machine, with which privileges, and its figures."""

import json
import os
import platform
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.table import Table

from kata.system.privileges import fifo_granted, kernel_preemption, memory_lock_granted

_CPU_INFO: Final = Path("/proc/cpuinfo")
_CPU_NAMES: Final = ("model name", "Model", "Hardware")
"""How x86 and various ARM kernels call it."""


@dataclass(frozen=True)
class Computer:
    """The computer, what this user is granted on it, and how busy it was before the benchmark."""

    cpu: str
    cores: int
    kernel: str
    python: str
    fifo: bool
    """SCHED_FIFO is granted."""
    memory_lock: bool
    """Locked memory is granted."""
    load: float
    """Load average of the last minute."""

    def lines(self) -> list[str]:
        """In words."""
        granted = {True: "granted", False: "not granted"}
        return [
            f"{self.cpu}, {self.cores} cores, Linux {self.kernel}, Python {self.python}",
            f"SCHED_FIFO {granted[self.fifo]}, locked memory {granted[self.memory_lock]}, load average before {self.load:.2f}",
        ]


def computer() -> Computer:
    """The one we run on, now."""
    return Computer(
        cpu=_cpu(),
        cores=len(os.sched_getaffinity(0)),
        kernel=f"{platform.release()} {kernel_preemption()}",
        python=platform.python_version(),
        fifo=fifo_granted(),
        memory_lock=memory_lock_granted(),
        load=os.getloadavg()[0],
    )


@dataclass
class Report:
    """A table for people, and figures by name for everybody else."""

    title: str
    columns: tuple[str, ...]
    on: Computer = field(default_factory=computer)
    rows: list[tuple[str, ...]] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """What a reader has to know to believe the figures."""

    def show(self, console: Console) -> None:
        """Print machine, table and notes."""
        table = Table(title=self.title)
        for n, column in enumerate(self.columns):
            table.add_column(column, justify="right" if n else "left")
        for row in self.rows:
            table.add_row(*row)
        for line in self.on.lines():
            console.print(line, highlight=False, soft_wrap=True)
        console.print(table)
        for note in self.notes:
            console.print(note, highlight=False, soft_wrap=True)

    def write(self, path: Path) -> None:
        """Write ``{"figures": {name: number}}``, and beside them the machine and the notes, as JSON."""
        told: dict[str, Any] = {"figures": self.figures, "machine": self.on.lines(), "notes": self.notes}
        path.write_text(json.dumps(told, indent=2) + "\n")


def _cpu() -> str:
    told: dict[str, str] = {}
    for line in _CPU_INFO.read_text().splitlines():
        name, _, value = line.partition(":")
        told[name.strip()] = value.strip()
    return next((told[name] for name in _CPU_NAMES if name in told), platform.machine())
