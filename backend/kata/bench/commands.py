"""The ``kata bench`` commands. Each imports its benchmark when it runs, so that ``kata`` itself starts quickly."""

import importlib
from typing import Annotated, Final

import typer

from kata.bench.run import Json, run_benchmark
from kata.system.console import fail

CHECKOUT_ONLY: Final = (
    "soak", "pages", "stations", "password-guessing", "stop-under-attack", "history", "start", "footprint",
)  # fmt: skip
"""Names of the benchmarks in the package ``benchmarks``, which the wheel does not contain."""

app = typer.Typer(no_args_is_help=True, help="Measure the timing goals on this computer.")

PlotMinutes = Annotated[float, typer.Option(help="Length of the playback that the load plots, minutes.")]
Fifo = Annotated[bool, typer.Option("--fifo/--no-fifo", help="With real-time privileges, or without.")]


@app.command()
def loop(
    seconds: Annotated[float, typer.Option(min=1.0, help="Duration of each measurement, seconds.")] = 60.0,
    rates: Annotated[str, typer.Option(help="Rates of the station, Hz, separated by commas.")] = "10,100,200",
    fifo: Annotated[
        bool | None,
        typer.Option("--fifo/--no-fifo", help="Only with real-time privileges, or only without. Default: both."),
    ] = None,
    idle: Annotated[
        bool | None, typer.Option("--idle/--loaded", help="Only idle, or only under load. Default: both.")
    ] = None,
    plot_minutes: PlotMinutes = 60.0,
    json_out: Json = None,
) -> None:
    """Measure how late the control loop's cycles begin: idle and under load, with real-time privileges and without."""
    from kata.bench import loop as benchmark

    try:
        numbers = [int(rate) for rate in rates.split(",")]
    except ValueError as error:
        raise typer.BadParameter(f"{rates} are no rates", param_hint="--rates") from error
    cases = benchmark.loop_cases(numbers, real_time=_only(fifo), loaded=_only(None if idle is None else not idle))
    run_benchmark(lambda progress: benchmark.run(cases, seconds, plot_minutes * 60, progress), json_out)


@app.command()
def estop(
    presses: Annotated[int, typer.Option(min=1, help="Number of presses.")] = 1000,
    rate_hz: Annotated[int, typer.Option(help="Rate of the station, Hz.")] = 100,
    loaded: Annotated[bool, typer.Option("--loaded/--idle", help="Under load, or idle.")] = True,
    fifo: Fifo = True,
    plot_minutes: PlotMinutes = 60.0,
    json_out: Json = None,
) -> None:
    """Measure the time from the emergency stop to torque off at all five drives."""
    from kata.bench import estop as benchmark
    from kata.bench.loop import LoopCase

    case = LoopCase(rate_hz, loaded, fifo)
    run_benchmark(lambda progress: benchmark.run(presses, case, plot_minutes * 60, progress), json_out)


@app.command()
def stop(
    stops: Annotated[int, typer.Option(min=1, help="Number of stops under each load.")] = 1000,
    loads: Annotated[
        str,
        typer.Option(
            help="Loads, separated by commas: idle, built, loaded, second_client, slow_disk, extreme. Default: all."
        ),
    ] = "",
    fifo: Fifo = True,
    json_out: Json = None,
) -> None:
    """Measure the time from a Stop on the socket to torque off at all five drives, while the device process is busy."""
    from kata.bench import stop as benchmark

    chosen_loads = loads.split(",") if loads else benchmark.LOADS
    if unknown := set(chosen_loads) - set(benchmark.LOADS):
        raise typer.BadParameter(f"{', '.join(sorted(unknown))}: no such load", param_hint="--loads")
    run_benchmark(lambda progress: benchmark.run(stops, chosen_loads, fifo, progress), json_out)


@app.command()
def bus(
    seconds: Annotated[float, typer.Option(min=0.01, help="Duration for each library on each bus, seconds.")] = 6.0,
    rounds: Annotated[int, typer.Option(min=1, help="Number of rounds into which the duration is divided.")] = 3,
    return_delay_us: Annotated[int, typer.Option(min=0, max=508, help="Delay of the drives' answers, µs.")] = 0,
    json_out: Json = None,
) -> None:
    """Measure which share of the bus bandwidth the drivers use, beside other libraries on the same bus."""
    from kata.bench import bus as benchmark

    run_benchmark(lambda progress: benchmark.run(seconds, rounds, return_delay_us, progress), json_out)


def _add_checkout_benchmarks() -> None:
    """Add the commands of the package ``benchmarks``. If it is not installed, add commands that say where to find it."""
    try:
        # Import by name, because kata does not depend on a package that the wheel does not contain.
        commands = importlib.import_module("benchmarks.commands")
    except ModuleNotFoundError:
        for name in CHECKOUT_ONLY:
            _add_placeholder(name)
    else:
        app.add_typer(commands.app)


def _add_placeholder(name: str) -> None:
    def placeholder() -> None:
        fail(f"This benchmark is not installed. Run it in a checkout of Kata: python -m benchmarks {name}")

    any_arguments = {"allow_extra_args": True, "ignore_unknown_options": True}
    app.command(name, help="Works only in a checkout of Kata.", context_settings=any_arguments)(placeholder)


def _only(choice: bool | None) -> tuple[bool, ...]:
    return (True, False) if choice is None else (choice,)


_add_checkout_benchmarks()
