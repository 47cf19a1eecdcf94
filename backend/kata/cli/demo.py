"""Teach a motion by hand and pedal, play it back and compare both, without a browser.

Service, database and device process are real. The apparatus is simulated behind a socket.
"""

import asyncio
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn
from rich.table import Table

from kata.audit.anchor import AnchorError
from kata.clinic.sessions.schemas import Comparison
from kata.database.engine import DatabaseError
from kata.device.config import ConfigError
from kata.device.journal import FolderInUseError
from kata.errors import ProblemError
from kata.evaluation.service_driver import ServiceDriverError, driving_service
from kata.motion.taught import Taught, TaughtError, read_csv
from kata.settings import Settings
from kata.simulator.hand import HandRefusedError
from kata.simulator.process import SimulatorError

FAILURES: Final = (
    TaughtError, HandRefusedError, ServiceDriverError, ProblemError, AnchorError, ConfigError, DatabaseError, FolderInUseError,
    SimulatorError, OSError,
)  # fmt: skip
"""Errors whose message the command prints."""


@dataclass(frozen=True)
class Result:
    """The tracking errors of the playback."""

    comparison: Comparison
    rate_hz: int

    def as_json(self) -> dict[str, Any]:
        """Return peak error, RMSE and start error of each motor, in degrees with signs."""
        columns = {"motor", "peak_deg", "rmse_deg", "start_deg"}
        return {
            "motors": [motor.model_dump(include=columns) for motor in self.comparison.motors],
            "samples": self.comparison.samples,
            "rate_hz": self.rate_hz,
        }


def demonstrate(taught: Path, settings: Settings) -> Result:
    """Teach the file's motion, play it back and print the errors.

    :raises TaughtError: when the file contains no motion.
    :raises ServiceDriverError: when a step takes too long or a stop occurs.
    :raises ProblemError: when the apparatus refuses, for example because of a limit.
    """
    console = Console()
    motion = read_csv(taught)
    result = asyncio.run(_demonstrated(motion, settings, console))
    console.print(_table(motion, result))
    return result


async def _demonstrated(motion: Taught, settings: Settings, console: Console) -> Result:
    columns = (TextColumn("{task.description:<26}"), BarColumn(), TextColumn("{task.fields[left]}"))
    with Progress(*columns, console=console) as progress:
        tasks: dict[str, TaskID] = {}

        def show(task: str, lasts_s: float, left_s: float) -> None:
            if task not in tasks:
                tasks[task] = progress.add_task(task, total=lasts_s, left="")
            progress.update(tasks[task], completed=lasts_s - left_s, left=f"{left_s:.0f} s left" if left_s else "done")

        async with driving_service(settings, show) as driver:
            run = await driver.play(await driver.teach(motion))
            driver.end()
            if run.comparison is None:
                raise ServiceDriverError("nothing was played")
            return Result(run.comparison, run.rate_hz or driver.station.info.rate_hz)


def write(result: Result, out: Path) -> None:
    """Write the figures as JSON."""
    out.write_text(json.dumps(result.as_json(), indent=2) + "\n")


def _table(motion: Taught, result: Result) -> Table:
    table = Table(
        title=f"{motion.name}: playback minus teaching, {result.comparison.samples} samples, {result.rate_hz} Hz"
    )
    for column in ("Motor", "Peak, deg", "at, s", "RMSE, deg", "Start, deg"):
        table.add_column(column, justify="right")
    for motor in result.comparison.motors:
        table.add_row(
            str(motor.motor),
            f"{motor.peak_deg:+.2f}",
            f"{motor.peak_at_s:.1f}",
            f"{motor.rmse_deg:.2f}",
            f"{motor.start_deg:+.2f}",
        )
    return table
