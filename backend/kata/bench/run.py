"""Runs one benchmark as a command: progress, report, JSON file and errors."""

import logging
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer
from rich.console import Console

from kata.system.console import fail

if TYPE_CHECKING:
    from kata.bench.report import Report

Json = Annotated[Path | None, typer.Option("--json", help="Write the figures to this JSON file.")]
_FILE_WIDTH: Final = 160
"""Width of a table in a file, in characters. With the usual 80, words would be broken."""


def run_benchmark(benchmark: Callable[[Callable[[str], None]], "Report"], json_out: Path | None) -> None:
    """Run a benchmark, print its report and write its figures. After an expected error, print a sentence and end the command."""
    from kata.bench.running_service import BenchError
    from kata.simulator.process import SimulatorError

    # Exit normally at SIGTERM, so that the processes that the benchmark has started are ended too.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    # Suppress warnings about privileges, because the report names those that are not granted.
    logging.basicConfig(level=logging.ERROR)
    console = Console()
    if not console.is_terminal:
        console = Console(width=_FILE_WIDTH)
    try:
        with _progress() as progress:
            report = benchmark(progress)
    except (BenchError, SimulatorError, OSError) as error:
        fail(str(error))
    report.show(console)
    if json_out:
        report.write(json_out)


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Show the present step on standard error. Standard output has only the table."""
    with Console(stderr=True).status("Preparing ...") as status:
        yield lambda step: status.update(f"{step} ...")
