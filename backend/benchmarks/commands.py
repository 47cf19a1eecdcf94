"""Defines the commands of ``python -m benchmarks``. In a checkout ``kata bench`` has them too. Each imports its benchmark when it runs."""

from pathlib import Path
from typing import Annotated

import typer

from kata.bench.run import Json, run_benchmark

app = typer.Typer(no_args_is_help=True, help="Measure a whole clinic on this computer.")


@app.command()
def soak(
    minutes: Annotated[float, typer.Option(min=0.01, help="Playing time, minutes.")] = 60.0,
    json_out: Json = None,
) -> None:
    """Measure while playing for an hour: missed cycles, and the memory of the service and of the device process."""
    from benchmarks import soak as benchmark

    run_benchmark(lambda progress: benchmark.run(minutes, progress), json_out)


@app.command()
def pages(
    count: Annotated[int, typer.Option("--pages", min=1, help="Number of open pages.")] = 500,
    stalled: Annotated[int, typer.Option(min=0, help="Pages that stop reading in the last measurement.")] = 50,
    seconds: Annotated[float, typer.Option(min=1.0, help="Duration of each measurement, seconds.")] = 60.0,
    json_out: Json = None,
) -> None:
    """Measure while hundreds of pages are open on one service: delay of each update, lateness of the control loop, and memory."""
    from benchmarks import pages as benchmark

    run_benchmark(lambda progress: benchmark.run(count, stalled, seconds, progress), json_out)


@app.command()
def stations(
    count: Annotated[int, typer.Option("--stations", min=2, help="Number of services, each with an apparatus.")] = 5,
    presses: Annotated[int, typer.Option(min=1, help="Number of emergency stops pressed.")] = 200,
    seconds: Annotated[
        float, typer.Option(min=0.0, help="Playing time with the database, and again while it hangs, seconds; 0: none.")
    ] = 60.0,
    pages: Annotated[
        int, typer.Option(min=0, help="Number of open pages of all stations together; each station has at least one.")
    ] = 0,
    rate: Annotated[int, typer.Option(min=1, help="Rate of the control loops, Hz.")] = 100,
    json_out: Json = None,
) -> None:
    """Run several stations on one PostgreSQL: delay between stations, load of the database, and missed cycles while it hangs."""
    from benchmarks import stations as benchmark

    run_benchmark(lambda progress: benchmark.run(count, presses, seconds, pages, rate, progress), json_out)


@app.command("sign-in", hidden=True)
@app.command()
def password_guessing(
    context: typer.Context,
    seconds: Annotated[
        float, typer.Option(min=1.0, help="Duration of each measurement of the control loop, seconds.")
    ] = 60.0,
    per_minute: Annotated[int, typer.Option(min=1, help="Attempts per minute.")] = 1000,
    pairs: Annotated[
        int, typer.Option(min=2, help="Number of attempts with a known name, and the same number with an unknown name.")
    ] = 400,
    json_out: Json = None,
) -> None:
    """Measure while passwords are guessed: the lock-out, how late the control loop is, and whether the answer time reveals a user name."""
    from benchmarks import sign_in as benchmark

    if context.info_name == "sign-in":
        typer.echo("sign-in is now called password-guessing; the next release does not accept sign-in.", err=True)
    run_benchmark(lambda progress: benchmark.run(seconds, per_minute, pairs, progress), json_out)


@app.command()
def stop_under_attack(
    stops: Annotated[int, typer.Option(min=1, help="Number of Stops during each attack.")] = 1000,
    attack: Annotated[list[str] | None, typer.Option(help="Only this attack; may be repeated.")] = None,
    stations: Annotated[
        int, typer.Option(min=1, help="Number of stations; several share one PostgreSQL, and the first is attacked.")
    ] = 1,
    json_out: Json = None,
) -> None:
    """Measure during attacks on the service: the time until a user's Stop is answered, and the service's memory."""
    from benchmarks import stop_under_attack as benchmark

    chosen = tuple(attack or benchmark.ALL)
    if unknown := set(chosen) - set(benchmark.ALL):
        raise typer.BadParameter(f"unknown: {', '.join(sorted(unknown))}; there are {', '.join(benchmark.ALL)}")
    run_benchmark(lambda progress: benchmark.run(stops, chosen, stations, progress), json_out)


@app.command()
def history(
    patients: Annotated[int, typer.Option(min=1, help="Number of patients.")] = 10_000,
    sessions: Annotated[int, typer.Option(min=1, help="Number of sessions of all patients together.")] = 1_000_000,
    minutes: Annotated[float, typer.Option(min=0.1, help="Length of the plotted run, minutes.")] = 60.0,
    times: Annotated[int, typer.Option(min=1, help="Number of requests of each kind.")] = 200,
    store: Annotated[
        Path | None, typer.Option(help="Folder for the databases. A database that it already holds is used again.")
    ] = None,
    json_out: Json = None,
) -> None:
    """Measure with ten years of a clinic on SQLite and PostgreSQL: answer times of lists and charts, and the size of an hour of samples."""
    from benchmarks import history as benchmark

    run_benchmark(lambda progress: benchmark.run(patients, sessions, minutes * 60, times, store, progress), json_out)


@app.command()
def start(
    rounds: Annotated[int, typer.Option(min=1, help="Number of starts after the first one.")] = 5,
    against: Annotated[
        Path | None, typer.Option(help="Another checkout of Kata, started in turns with this one.", exists=True)
    ] = None,
    json_out: Json = None,
) -> None:
    """Measure the start of the service: time until the page answers, and until a session can begin."""
    from benchmarks import start as benchmark

    run_benchmark(lambda progress: benchmark.run(rounds, against, progress), json_out)


@app.command()
def footprint(
    seconds: Annotated[float, typer.Option(min=1.0, help="Duration idle, and again playing, seconds.")] = 120.0,
    json_out: Json = None,
) -> None:
    """Measure memory of each process, idle processor time of the service, and bytes written per hour."""
    from benchmarks import footprint as benchmark

    run_benchmark(lambda progress: benchmark.run(seconds, progress), json_out)
