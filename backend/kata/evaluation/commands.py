"""``kata evaluate`` as typed. What it takes is imported when it is asked for: the service itself starts without."""

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


def evaluate(
    taught: Annotated[
        Path | None, typer.Option(help="Folder of motions (CSV) instead of those that come with the program.")
    ] = None,
    methods: Annotated[str, typer.Option(help="Methods, with commas.")] = "paper,smooth,learned",
    repetitions: Annotated[
        int | None,
        typer.Option(min=1, help="Plays of each recording; unless given, five where it learns and one elsewhere."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Vary the simulated mechanics by up to 30 %; as designed unless given.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="So many variations, from the seed on.")] = 1,
    json_out: Annotated[Path | None, typer.Option("--json", help="Write the figures to this JSON file.")] = None,
    html_out: Annotated[Path | None, typer.Option("--html", help="Write a report to this HTML file.")] = None,
    real_time: Annotated[
        bool,
        typer.Option("--real-time", help="Through the service's own processes and a pseudo-terminal, in real time."),
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
    from kata.motion.method import Method
    from kata.motion.taught import TaughtError
    from kata.simulator.process import SimulatorError

    logging.basicConfig(level=logging.ERROR)
    known: dict[str, Method] = {method: method for method in get_args(Method)}
    asked = [method.strip() for method in methods.split(",")]
    for method in asked:
        if method not in known:
            raise typer.BadParameter(f"{method} is none of {', '.join(known)}", param_hint="--methods")
    try:
        cases = recorded_cases(taught) if taught else paper_cases()
    except TaughtError as error:
        fail(str(error))
    variations = [None] if seed is None and seeds == 1 else [(seed or 0) + n for n in range(seeds)]
    jobs = [
        run.Job(case, method, repetitions or (run.PLAYS_TO_LEARN if method == "learned" else 1), variation)
        for variation in variations
        for case in cases
        for method in (known[name] for name in asked)
    ]
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


def _on_virtual_time(jobs: "Sequence[Job]") -> "list[Outcome]":
    from kata.evaluation import run

    began_s = time.monotonic()
    with _progress() as progress:
        task = progress.add_task("Teaching and playing back, simulated", total=len(jobs))
        outcomes = run.carry_out(jobs, lambda job: progress.advance(task))
    clock_s, took_s = sum(one.clock_s for one in outcomes), time.monotonic() - began_s
    Console(stderr=True, highlight=False).print(
        f"{clock_s:.0f} s of the apparatus' clock in {took_s:.0f} s: {clock_s / took_s:.0f} times faster than real time."
    )
    return outcomes


def _in_real_time(jobs: "Sequence[Job]", station: Path | None) -> "list[Outcome]":
    from kata.evaluation import real_time

    if station:
        typer.confirm(
            f"The apparatus of {station} will move, {len(jobs)} motions in all. Is nobody in it who should not be, "
            "and the emergency stop at hand?",
            abort=True,
        )

    with _progress() as progress:
        task = progress.add_task("Teaching and playing back", total=len(jobs))

        def turn_to(side: str) -> None:
            progress.stop()
            typer.confirm(f"Does the apparatus stand for the {side} shoulder?", abort=True)
            progress.start()

        def show(what: str, lasts_s: float, left_s: float) -> None:
            progress.update(task, description=what)

        return real_time.carry_out(jobs, station, turn_to, show, lambda job: progress.advance(task))


def _progress() -> Progress:
    """On the error stream: the other one belongs to the tables."""
    columns = (TextColumn("{task.description:<36}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True))
