"""``kata bench ...`` as typed. What it takes is imported when it is asked for: the service itself starts without."""

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

_FILE_WIDTH: Final = 160
"""Of a table that goes into a file: a terminal's usual 80 columns break its words."""

app = typer.Typer(no_args_is_help=True, help="Measure the timing goals on this computer.")

Json = Annotated[Path | None, typer.Option("--json", help="Write the figures to this JSON file.")]
PlotMinutes = Annotated[float, typer.Option(help="Length of the run that the load draws, minutes.")]


@app.command()
def loop(
    seconds: Annotated[float, typer.Option(min=1.0, help="Time for each measurement.")] = 60.0,
    rates: Annotated[str, typer.Option(help="Rates of the station, Hz, with commas.")] = "10,100,200",
    fifo: Annotated[
        bool | None,
        typer.Option("--fifo/--no-fifo", help="Only with real-time privileges, or only without; both unless given."),
    ] = None,
    idle: Annotated[
        bool | None, typer.Option("--idle/--loaded", help="Only idle, or only under load; both unless given.")
    ] = None,
    plot_minutes: PlotMinutes = 60.0,
    json_out: Json = None,
) -> None:
    """How late the control loop's cycles begin: idle and under load, with real-time privileges and without."""
    from kata.bench import loop as benchmark

    try:
        numbers = [int(rate) for rate in rates.split(",")]
    except ValueError as error:
        raise typer.BadParameter(f"{rates} are no rates", param_hint="--rates") from error
    wanted = benchmark.cells(numbers, real_time=_only(fifo), loaded=_only(None if idle is None else not idle))
    _carry_out(lambda progress: benchmark.run(wanted, seconds, plot_minutes * 60, progress), json_out)


@app.command()
def estop(
    presses: Annotated[int, typer.Option(min=1, help="How often to press.")] = 1000,
    rate_hz: Annotated[int, typer.Option(help="Rate of the station, Hz.")] = 100,
    loaded: Annotated[bool, typer.Option("--loaded/--idle", help="Under load, or not.")] = True,
    fifo: Annotated[bool, typer.Option("--fifo/--no-fifo", help="With real-time privileges, or without.")] = True,
    plot_minutes: PlotMinutes = 60.0,
    json_out: Json = None,
) -> None:
    """How long from the emergency stop to torque off at all five drives."""
    from kata.bench import estop as benchmark
    from kata.bench.loop import Cell

    cell = Cell(rate_hz, loaded, fifo)
    _carry_out(lambda progress: benchmark.run(presses, cell, plot_minutes * 60, progress), json_out)


@app.command()
def stop(
    stops: Annotated[int, typer.Option(min=1, help="How often to stop under each load.")] = 1000,
    loads: Annotated[
        str,
        typer.Option(help="With commas, of idle, built, loaded, second_client, slow_disk, extreme; all unless given."),
    ] = "",
    fifo: Annotated[bool, typer.Option("--fifo/--no-fifo", help="With real-time privileges, or without.")] = True,
    json_out: Json = None,
) -> None:
    """How long from a Stop on the socket to torque off at all five drives, while the device process is kept busy."""
    from kata.bench import stop as benchmark

    wanted = loads.split(",") if loads else benchmark.LOADS
    if unknown := set(wanted) - set(benchmark.LOADS):
        raise typer.BadParameter(f"{', '.join(sorted(unknown))}: no such load", param_hint="--loads")
    _carry_out(lambda progress: benchmark.run(stops, wanted, fifo, progress), json_out)


@app.command()
def bus(
    seconds: Annotated[float, typer.Option(min=0.01, help="Time for each library on each wire.")] = 6.0,
    rounds: Annotated[int, typer.Option(min=1, help="Turns in which that time is spent.")] = 3,
    return_delay_us: Annotated[int, typer.Option(min=0, max=508, help="How long drives wait before they answer.")] = 0,
    json_out: Json = None,
) -> None:
    """How much of what the line carries the drivers use, beside other libraries on the same wire."""
    from kata.bench import bus as benchmark

    _carry_out(lambda progress: benchmark.run(seconds, rounds, return_delay_us, progress), json_out)


@app.command()
def soak(
    minutes: Annotated[float, typer.Option(min=0.01, help="How long to play.")] = 60.0,
    json_out: Json = None,
) -> None:
    """Play over and over: cycles missed, and the memory of service and device process."""
    from kata.bench import soak as benchmark

    _carry_out(lambda progress: benchmark.run(minutes, progress), json_out)


@app.command()
def pages(
    count: Annotated[int, typer.Option("--pages", min=1, help="How many pages are open.")] = 500,
    stalled: Annotated[int, typer.Option(min=0, help="How many of them read nothing, in the last measurement.")] = 50,
    seconds: Annotated[float, typer.Option(min=1.0, help="Time for each measurement.")] = 60.0,
    json_out: Json = None,
) -> None:
    """Hundreds of pages on one service: how soon each is told, and what the control loop and memory feel of them."""
    from kata.bench import pages as benchmark

    _carry_out(lambda progress: benchmark.run(count, stalled, seconds, progress), json_out)


@app.command()
def stations(
    count: Annotated[int, typer.Option("--stations", min=2, help="How many services, each with its apparatus.")] = 5,
    presses: Annotated[int, typer.Option(min=1, help="How often an emergency stop is pressed at one of them.")] = 200,
    seconds: Annotated[float, typer.Option(min=1.0, help="Time to play with the database, and without.")] = 60.0,
    json_out: Json = None,
) -> None:
    """Several stations on one PostgreSQL: how soon they see each other, and cycles missed while the database hangs."""
    from kata.bench import stations as benchmark

    _carry_out(lambda progress: benchmark.run(count, presses, seconds, progress), json_out)


@app.command()
def sign_in(
    seconds: Annotated[float, typer.Option(min=1.0, help="Time for each measurement of the control loop.")] = 60.0,
    per_minute: Annotated[int, typer.Option(min=1, help="Tries a minute.")] = 1000,
    pairs: Annotated[int, typer.Option(min=2, help="Tries with a known and with an unknown name, each.")] = 400,
    json_out: Json = None,
) -> None:
    """A storm of sign-ins: whether it is locked out, what the control loop feels, whether names can be told by the time."""
    from kata.bench import sign_in as benchmark

    _carry_out(lambda progress: benchmark.run(seconds, per_minute, pairs, progress), json_out)


@app.command()
def history(
    patients: Annotated[int, typer.Option(min=1, help="How many patients.")] = 10_000,
    sessions: Annotated[int, typer.Option(min=1, help="How many sessions, of all of them together.")] = 1_000_000,
    minutes: Annotated[float, typer.Option(min=0.1, help="Length of the run that is drawn.")] = 60.0,
    times: Annotated[int, typer.Option(min=1, help="How often everything is asked for.")] = 200,
    store: Annotated[
        Path | None, typer.Option(help="Folder where the databases stay; those that it has are not built again.")
    ] = None,
    json_out: Json = None,
) -> None:
    """Ten years of a clinic, on SQLite and PostgreSQL: how long lists, charts and an hour's error plot take, and its size."""
    from kata.bench import history as benchmark

    _carry_out(lambda progress: benchmark.run(patients, sessions, minutes * 60, times, store, progress), json_out)


def _only(wanted: bool | None) -> tuple[bool, ...]:
    return (True, False) if wanted is None else (wanted,)


def _carry_out(benchmark: Callable[[Callable[[str], None]], "Report"], json_out: Path | None) -> None:
    """Run, print, write; errors as sentences."""
    from kata.bench.clinic import BenchError
    from kata.simulator.process import SimulatorError

    # However it ends, it ends what it has started.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    # What is not granted, the report says.
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
    """What is going on, on the error stream: the other one belongs to the table."""
    with Console(stderr=True).status("Preparing ...") as status:
        yield lambda what: status.update(f"{what} ...")
