"""The ``kata evaluate`` command. It imports its packages when it runs, so that ``kata`` itself starts quickly."""

import importlib.util
import json
import logging
import resource
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from kata.system.console import fail

if TYPE_CHECKING:
    from kata.evaluation.outcome import CaseResult
    from kata.evaluation.run import Job, MechanicsChoice
    from kata.motion.method import Method
    from kata.simulator.independent.patients import PatientName
    from kata.simulator.mechanics import PlantName


_PlantOption = Annotated[
    str | None,
    typer.Option(
        help="Simulated mechanics: mujoco (written independently of the controller) or simple (faster). "
        "Default: mujoco if it is installed; simple in real time."
    ),
]
_BalancerOption = Annotated[
    float | None,
    typer.Option(
        "--balancer", min=0.0, max=10.0, help="With mujoco: weight on the balancer in kg. Default: as designed."
    ),
]
_PatientOption = Annotated[
    str, typer.Option(help="With mujoco: the patient, one of healthy, freezing, frozen, thawing, large and small.")
]
_TaughtOption = Annotated[Path | None, typer.Option(help="Folder of motions (CSV) instead of the built-in motions.")]
_RepetitionsOption = Annotated[
    int | None,
    typer.Option(
        min=1, help="Number of playbacks of each recording. Default: five for learned, one for the other methods."
    ),
]
_RealTimeOption = Annotated[
    bool, typer.Option("--real-time", help="Play in real time, through the service's processes.")
]
_EndFeelOption = Annotated[
    bool,
    typer.Option(
        "--end-feel",
        help="Judge the end-feel test instead of playback. Of the other options only plant, seed, seeds, processes and json apply.",
    ),
]


def evaluate(
    taught: _TaughtOption = None,
    methods: Annotated[str, typer.Option(help="Playback methods, separated by commas.")] = "paper,smooth,learned",
    repetitions: _RepetitionsOption = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, help="Seed of a variation of the simulated mechanics by up to 30 %. Default: no variation."
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Number of variations: this seed and the following ones.")] = 1,
    json_out: Annotated[Path | None, typer.Option("--json", help="Write the figures to this JSON file.")] = None,
    html_out: Annotated[Path | None, typer.Option("--html", help="Write a report to this HTML file.")] = None,
    plant: _PlantOption = None,
    patient: _PatientOption = "healthy",
    balancer_kg: _BalancerOption = None,
    processes: Annotated[
        int | None,
        typer.Option(min=1, help="Number of cases played at the same time. Default: one for each processor."),
    ] = None,
    real_time: _RealTimeOption = False,
    end_feel: _EndFeelOption = False,
    station: Annotated[
        Path | None, typer.Option(help="Play on the real apparatus of this station's TOML file, in real time.")
    ] = None,
) -> None:
    """Teach, play back and compare: the paper's fourteen cases, or a folder of motions, by every method."""
    from kata.database.engine import DatabaseError
    from kata.device.config import ConfigError
    from kata.device.journal import FolderInUseError
    from kata.evaluation import run
    from kata.evaluation.cases import paper_cases, recorded_cases
    from kata.motion.taught import TaughtError
    from kata.simulator.process import SimulatorError

    logging.basicConfig(level=logging.ERROR)
    chosen = _parse_methods(methods)
    chosen_plant = _choose_plant(plant, real_time=real_time or station is not None)
    if end_feel:
        _judge_end_feel(chosen_plant, range(seed or 0, (seed or 0) + seeds), processes, json_out)
        return
    judge = run.MechanicsChoice(chosen_plant, _parse_patient(patient, chosen_plant), balancer_kg)
    if balancer_kg is not None and chosen_plant != "mujoco":
        raise typer.BadParameter("is possible only with --plant mujoco", param_hint="--balancer")
    try:
        cases = recorded_cases(taught) if taught else paper_cases()
    except TaughtError as error:
        fail(str(error))
    variations = [None] if seed is None and seeds == 1 else [(seed or 0) + n for n in range(seeds)]
    jobs = run.jobs([case.for_patient(judge.patient) for case in cases], chosen, repetitions, variations, judge)
    try:
        outcomes = _in_real_time(jobs, station) if real_time or station else _on_virtual_time(jobs, processes)
    except (ConfigError, DatabaseError, FolderInUseError, SimulatorError, OSError) as error:
        fail(str(error))
    beside: list[CaseResult] = []
    if html_out and judge.plant == "mujoco":
        other = [replace(job, judge=run.MechanicsChoice()) for job in jobs if job.seed == variations[0]]
        beside = _on_virtual_time(other, processes)
    _report(outcomes, beside, (json_out, html_out), simulated=station is None, judge=judge)
    sys.exit(any(outcome.problem for outcome in outcomes))


def _judge_end_feel(plant: "PlantName", seeds: range, processes: int | None, json_out: Path | None) -> None:
    from kata.evaluation import end_feel

    chosen = end_feel.cases(plant, seeds, get_args(end_feel.Kind), list(end_feel.CHOSEN_NM))
    end_feel.judge_many(chosen, processes, json_out)


def _report(
    outcomes: "Sequence[CaseResult]",
    beside: "Sequence[CaseResult]",
    files: tuple[Path | None, Path | None],
    *,
    simulated: bool,
    judge: "MechanicsChoice",
) -> None:
    """Print the tables and write the files: JSON and HTML. ``beside``: playbacks on the simple plant, for the HTML report."""
    from kata.evaluation import page, report, tables
    from kata.evaluation.outcome import as_json

    json_out, html_out = files
    report.show(outcomes, Console(), simulated=simulated, plant=judge.plant)
    if json_out:
        json_report = as_json(outcomes, simulated=simulated) | asdict(judge)
        if judge.plant == "mujoco":
            json_report["goals"] = [asdict(figure) for figure in tables.worst_beside_goals(outcomes)]
        json_out.write_text(json.dumps(json_report, indent=2) + "\n")
    if html_out:
        html_out.write_text(page.as_html(outcomes, simulated=simulated, beside=beside))


def _choose_plant(plant: str | None, *, real_time: bool) -> "PlantName":
    from kata.simulator.mechanics import PlantName

    installed = importlib.util.find_spec("mujoco") is not None
    if plant is None:
        if not installed and not real_time:
            typer.echo("MuJoCo is not installed (pip install kata[evaluate]): the simple plant is used.", err=True)
        return "mujoco" if installed and not real_time else "simple"
    for plant_name in get_args(PlantName):
        if plant == plant_name:
            break
    else:
        raise typer.BadParameter(f"{plant} is not one of {', '.join(get_args(PlantName))}", param_hint="--plant")
    if plant == "mujoco" and real_time:
        raise typer.BadParameter("in real time and on a real apparatus only simple is possible", param_hint="--plant")
    if plant == "mujoco" and not installed:
        fail("MuJoCo is not installed: pip install kata[evaluate].")
    return "mujoco" if plant == "mujoco" else "simple"


def _parse_patient(patient: str, plant: "PlantName") -> "PatientName":
    from kata.simulator.independent.patients import PatientName

    for name in get_args(PatientName):
        if patient == name and (plant == "mujoco" or name == "healthy"):
            patient_name: PatientName = name
            return patient_name
    choices = ", ".join(get_args(PatientName)) if plant == "mujoco" else "healthy (on the simple plant)"
    raise typer.BadParameter(f"{patient} is not one of {choices}", param_hint="--patient")


def _parse_methods(methods: str) -> "list[Method]":
    from kata.motion.method import Method

    methods_by_name: dict[str, Method] = {method: method for method in get_args(Method)}
    names = [name.strip() for name in methods.split(",")]
    for name in names:
        if name not in methods_by_name:
            raise typer.BadParameter(f"{name} is not one of {', '.join(methods_by_name)}", param_hint="--methods")
    return [methods_by_name[name] for name in names]


def _on_virtual_time(jobs: "Sequence[Job]", processes: int | None) -> "list[CaseResult]":
    from kata.evaluation import run

    began_s, began_cpu_s = time.monotonic(), _processor_s()
    with _progress() as progress:
        task = progress.add_task("Teaching and playing back, simulated", total=len(jobs))
        outcomes = run.evaluate_jobs(jobs, lambda job: progress.advance(task), processes)
    clock_s = sum(outcome.clock_s for outcome in outcomes)
    took_s, cpu_s = time.monotonic() - began_s, _processor_s() - began_cpu_s
    Console(stderr=True, highlight=False).print(
        f"{clock_s:.0f} s of the apparatus' clock in {took_s:.0f} s: {clock_s / took_s:.1f} times faster than real time. "
        f"In {cpu_s:.0f} s of processor time: {clock_s / cpu_s:.1f} times on one free core."
    )
    return outcomes


def _processor_s() -> float:
    """Return the processor time of the processes that have ended. Other work on the computer does not change it much."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _in_real_time(jobs: "Sequence[Job]", station: Path | None) -> "list[CaseResult]":
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
    """Return a progress bar on standard error. Standard output has only the tables."""
    columns = (TextColumn("{task.description:<36}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True))
