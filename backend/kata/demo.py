"""The main job without a browser: teach a motion by hand and pedal, play it back, compare.

Everything is the real thing except the apparatus: the service with its database, the device process, and the simulated
apparatus behind a pseudo-terminal.
"""

import asyncio
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from fastapi import FastAPI
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table

from kata.clinic.patients import service as patients
from kata.clinic.patients.schemas import PatientCreate
from kata.clinic.recordings import service as recordings
from kata.clinic.sessions import service as sessions
from kata.clinic.sessions.schemas import Comparison, Run
from kata.device.messages import Mode
from kata.motion.taught import Taught, read_csv
from kata.settings import Settings
from kata.simulator.apparatus import State
from kata.station.schemas import Live
from kata.web import station as commands
from kata.web.app import create_app

_SPARE_S: Final = 30.0
"""Every wait ends this long after it should have been over."""


class DemoError(Exception):
    """The demonstration could not go on; the message says why."""


@dataclass(frozen=True)
class Result:
    """What came out."""

    comparison: Comparison
    rate_hz: int

    def as_json(self) -> dict[str, Any]:
        """Peak, RMSE and start error per motor in degrees, with their signs."""
        kept = {"motor", "peak_deg", "rmse_deg", "start_deg"}
        return {
            "motors": [motor.model_dump(include=kept) for motor in self.comparison.motors],
            "samples": self.comparison.samples,
            "rate_hz": self.rate_hz,
        }


def demonstrate(taught: Path, settings: Settings, console: Console) -> Result:
    """Teach the file, play it back, print what came of it.

    :raises TaughtError: when the file holds no motion.
    :raises DemoError: when something does not come about in time, or a stop comes.
    :raises ProblemError: when the apparatus refuses, because of a limit for example.
    """
    motion = read_csv(taught)
    result = asyncio.run(_Demo(motion, settings, console).run())
    console.print(_table(motion, result))
    return result


class _Demo:
    def __init__(self, motion: Taught, settings: Settings, console: Console) -> None:
        self._motion = motion
        self._settings = settings
        self._console = console

    async def run(self) -> Result:
        app = create_app(self._settings)
        with Progress(
            TextColumn("{task.description:<24}"), BarColumn(), TextColumn("{task.fields[left]}"), console=self._console
        ) as progress:
            self._progress = progress
            async with app.router.lifespan_context(app):
                return await self._teach_and_play(app)

    async def _teach_and_play(self, app: FastAPI) -> Result:
        station, database, hand = app.state.station, app.state.database, app.state.simulation.process.client()
        await self._until_mode(app, {"idle"}, "Connecting", _SPARE_S)

        with database.write() as session:
            patient = patients.create(
                session, PatientCreate(clinic_number="DEMO-1", name="Demonstration", affected_side="left")
            )
        wanted = commands.TeachRequest(patient_id=patient.id, name=self._motion.name)
        await commands.teach(station, database, wanted)
        started: State = hand.guide(self._motion)
        await self._until(
            "Teaching by hand and pedal",
            started.hand.left_s,
            lambda: hand.state().hand.left_s,
            lambda: hand.state().hand.phase == "away",
        )
        await commands.finish_teaching(station)
        recording = await self._saved(lambda: self._recording(app, patient.id))

        with database.write() as session:
            visit = sessions.begin(session, patient.id)
        run = await commands.load(
            station, database, commands.LoadRequest(session_id=visit.id, recording_id=recording.id)
        )
        await commands.approach(station)
        await self._until_mode(app, {"paused"}, "Moving to the start", _SPARE_S)
        await commands.play(station)
        await self._until_mode(app, {"returning", "idle"}, "Playing back", recording.duration_s)
        await self._until_mode(app, {"idle"}, "Moving back", _SPARE_S)
        finished = await self._saved(lambda: self._finished(app, run))
        with database.write() as session:
            sessions.end(session, visit.id)
        if finished.comparison is None:
            raise DemoError("nothing was played")
        return Result(finished.comparison, finished.rate_hz or station.info.rate_hz)

    @staticmethod
    def _recording(app: FastAPI, patient_id: Any) -> Any:
        with app.state.database.read() as session:
            return next(iter(recordings.of_patient(session, patient_id)), None)

    @staticmethod
    def _finished(app: FastAPI, run: Run) -> Run | None:
        with app.state.database.read() as session:
            row = sessions.get_run(session, run.id)
            return sessions.as_run(row) if row.ended_at else None

    async def _saved(self, look: Callable[[], Any]) -> Any:
        found: list[Any] = []

        def there() -> bool:
            found[:] = [look()]
            return found[0] is not None

        await self._until("Saving", 0.0, lambda: 0.0, there)
        return found[0]

    async def _until_mode(self, app: FastAPI, modes: set[Mode], what: str, lasts_s: float) -> None:
        def live() -> Live:
            told: Live = app.state.station.live()
            if told.stop:
                raise DemoError(" ".join(cause.message for cause in told.stop.causes))
            return told

        def left() -> float:
            run = live().run
            return run.left_s if run else 0.0

        await self._until(what, lasts_s, left, lambda: live().mode in modes)

    async def _until(self, what: str, lasts_s: float, left: Callable[[], float], done: Callable[[], bool]) -> None:
        """Show progress until it is done."""
        task = self._progress.add_task(what, total=max(lasts_s, left(), 0.1), left="")
        limit = asyncio.get_running_loop().time() + lasts_s + _SPARE_S
        while not done():
            if asyncio.get_running_loop().time() > limit:
                raise DemoError(f"{what}: not over after {lasts_s + _SPARE_S:.0f} s")
            total = self._progress.tasks[task].total or 0.1
            self._progress.update(task, completed=max(0.0, total - left()), left=f"{left():.0f} s left")
            await asyncio.sleep(0.1)
        self._progress.update(task, completed=self._progress.tasks[task].total, left="done")


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
