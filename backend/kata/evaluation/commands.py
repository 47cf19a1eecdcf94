"""The ``kata evaluate`` command. It imports its packages when it runs, so that ``kata`` itself starts quickly."""

import json
import logging
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from kata.system.console import fail

if TYPE_CHECKING:
    from kata.evaluation.outcome import Outcome
    from kata.evaluation.run import Job
    from kata.motion.method import Method


def evaluate(
    taught: Annotated[
        Path | None, typer.Option(help="Folder of motions (CSV) instead of the built-in motions.")
    ] = None,
    methods: Annotated[str, typer.Option(help="Methods, separated by commas.")] = "paper,smooth,learned",
    repetitions: Annotated[
        int | None,
        typer.Option(min=1, help="Plays of each recording. Default: five for learned, one for the other methods."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Vary the simulated mechanics by up to 30 %. Default: as designed.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Number of variations, beginning with the seed.")] = 1,
    json_out: Annotated[Path | None, typer.Option("--json", help="Write the figures to this JSON file.")] = None,
    html_out: Annotated[Path | None, typer.Option("--html", help="Write a report to this HTML file.")] = None,
    real_time: Annotated[
        bool,
        typer.Option("--real-time", help="In real time, through the service's processes and a pseudo-terminal."),
    ] = False,
    station: Annotated[
        Path | None, typer.Option(help="The station's TOML file: play on that apparatus, in real time.")
    ] = None,
) -> None:
    """Teach, play back and compare: the paper's fourteen cases, or a folder of motions, by every method."""
    from kata.database.engine import DatabaseError
    from kata.device.config import ConfigError
    from kata.device.journal import FolderInUseError
    from kata.evaluation import page, report, run
    from kata.evaluation.cases import paper_cases, recorded_cases
    from kata.evaluation.outcome import as_json
    from kata.motion.taught import TaughtError
    from kata.simulator.process import SimulatorError

    logging.basicConfig(level=logging.ERROR)
    chosen = _parse_methods(methods)
    try:
        cases = recorded_cases(taught) if taught else paper_cases()
    except TaughtError as error:
        fail(str(error))
    variations = [None] if seed is None and seeds == 1 else [(seed or 0) + n for n in range(seeds)]
    jobs = run.jobs(cases, chosen, repetitions, variations)
    try:
        outcomes = _in_real_time(jobs, station) if real_time or station else _on_virtual_time(jobs)
    except (ConfigError, DatabaseError, FolderInUseError, SimulatorError, OSError) as error:
        fail(str(error))
    simulated = station is None
    report.show(outcomes, Console(), simulated=simulated)
    if json_out:
        json_out.write_text(json.dumps(as_json(outcomes, simulated=simulated), indent=2) + "\n")
    if html_out:
        html_out.write_text(page.as_html(outcomes, simulated=simulated))
    if any(outcome.problem for outcome in outcomes):
        sys.exit(1)


def _parse_methods(methods: str) -> "list[Method]":
    from kata.motion.method import Method

    known: dict[str, Method] = {method: method for method in get_args(Method)}
    names = [name.strip() for name in methods.split(",")]
    for name in names:
        if name not in known:
            raise typer.BadParameter(f"{name} is not one of {', '.join(known)}", param_hint="--methods")
    return [known[name] for name in names]


def _on_virtual_time(jobs: "Sequence[Job]") -> "list[Outcome]":
    from kata.evaluation import run

    began_s = time.monotonic()
    with _progress() as progress:
        task = progress.add_task("Teaching and playing back, simulated", total=len(jobs))
        outcomes = run.evaluate_jobs(jobs, lambda job: progress.advance(task))
    clock_s, took_s = sum(outcome.clock_s for outcome in outcomes), time.monotonic() - began_s
    Console(stderr=True, highlight=False).print(
        f"{clock_s:.0f} s of the apparatus' clock in {took_s:.0f} s: {clock_s / took_s:.0f} times faster than real time."
    )
    return outcomes


def _in_real_time(jobs: "Sequence[Job]", station: Path | None) -> "list[Outcome]":
    from kata.evaluation import real_time

    if station:
        typer.confirm(
            f"The apparatus of {station} will move: {len(jobs)} motions in all. Is the apparatus clear of people, and the emergency "
            "stop within reach?",
            abort=True,
        )

    with _progress() as progress:
        task = progress.add_task("Teaching and playing back", total=len(jobs))

        def confirm_side(side: str) -> None:
            progress.stop()
            typer.confirm(f"Is the apparatus set up for the {side} shoulder?", abort=True)
            progress.start()

        def show(step: str, lasts_s: float, left_s: float) -> None:
            progress.update(task, description=step)

        return real_time.evaluate_jobs(jobs, station, confirm_side, show, lambda job: progress.advance(task))


def _progress() -> Progress:
    """Return a progress bar on standard error; standard output has only the tables."""
    columns = (TextColumn("{task.description:<36}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True))
