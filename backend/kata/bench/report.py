"""Builds the report of a benchmark: computer, privileges, table, figures and notes."""

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
"""Names of the field with the processor's name on x86 and on various ARM kernels."""


@dataclass(frozen=True)
class Computer:
    """The computer, this user's privileges on it, and its load before the benchmark."""

    cpu: str
    cores: int
    kernel: str
    python: str
    fifo: bool
    """True if SCHED_FIFO is granted."""
    memory_lock: bool
    """True if locked memory is granted."""
    load: float
    """Load average of the last minute."""

    def lines(self) -> list[str]:
        """Return the description as lines of text."""
        granted = {True: "granted", False: "not granted"}
        return [
            f"{self.cpu}, {self.cores} cores, Linux {self.kernel}, Python {self.python}",
            f"SCHED_FIFO {granted[self.fifo]}, locked memory {granted[self.memory_lock]}, load average before {self.load:.2f}",
        ]


def computer() -> Computer:
    """Return the description of this computer now."""
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
    """A table for people, and figures by name for programs."""

    title: str
    columns: tuple[str, ...]
    on: Computer = field(default_factory=computer)
    rows: list[tuple[str, ...]] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """Facts that a reader needs to interpret the figures."""

    def show(self, console: Console) -> None:
        """Print the computer, the table and the notes."""
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
        """Write ``{"figures": {name: number}, "machine": lines, "notes": lines}`` as JSON."""
        content: dict[str, Any] = {"figures": self.figures, "machine": self.on.lines(), "notes": self.notes}
        path.write_text(json.dumps(content, indent=2) + "\n")


def _cpu() -> str:
    fields: dict[str, str] = {}
    for line in _CPU_INFO.read_text().splitlines():
        name, _, value = line.partition(":")
        fields[name.strip()] = value.strip()
    return next((fields[name] for name in _CPU_NAMES if name in fields), platform.machine())
