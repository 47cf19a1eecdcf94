"""The ``kata`` command. What a command takes is imported when it is asked for: the whole service is seconds of imports."""

import json
import logging
import sys
from importlib.metadata import version
from pathlib import Path
from tempfile import mkdtemp
from typing import Annotated, Any

import typer

from kata.audit.commands import app as audit
from kata.backups.commands import backup, restore
from kata.bench.commands import app as bench
from kata.evaluation.commands import evaluate
from kata.settings import Settings
from kata.system.console import console, fail
from kata.system.gc_freeze import staying

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
app.add_typer(audit, name="audit")
app.add_typer(bench, name="bench")
app.command()(evaluate)
accounts = typer.Typer(no_args_is_help=True, help="Who may sign in.")
app.add_typer(accounts, name="accounts")
app.command()(backup)
app.command()(restore)


@app.callback(invoke_without_command=True)
def _common(show_version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    """The software of a shoulder-rehabilitation apparatus."""
    if show_version:
        typer.echo(f"kata {version('kata')}")
        raise typer.Exit


@app.command()
def serve(
    simulate: Annotated[bool, typer.Option("--simulate", help="Start a simulated apparatus.")] = False,
    station: Annotated[Path | None, typer.Option(help="The station's TOML file.")] = None,
    host: Annotated[str | None, typer.Option(help="Address to listen on; 127.0.0.1 unless given.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on; 8000 unless given, 0 for any free one.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    rate_hz: Annotated[
        int | None, typer.Option(help="Samples and setpoints a second, instead of the station's.")
    ] = None,
    reload: Annotated[
        bool, typer.Option("--reload", help="Start anew when the program changes (for developers).")
    ] = False,
) -> None:
    """Serve the clinic: page, API and the apparatus' control."""
    settings = _settings(station=station, host=host, port=port, data=data, rate_hz=rate_hz, simulate=simulate or None)
    if not settings.simulate and not settings.station:
        fail("Which apparatus? Give its configuration with --station FILE.toml, or try --simulate.")
    with staying():
        from kata.cli import serve

    try:
        serve.serve(settings, reload=reload)
    except KeyboardInterrupt:
        sys.exit(130)


@app.command()
def demo(
    taught: Annotated[Path, typer.Option(help="The motion to teach: CSV with time_s and the five pose columns.")],
    json_out: Annotated[Path | None, typer.Option("--json", help="Write the errors to this JSON file.")] = None,
    data: Annotated[Path | None, typer.Option(help="Keep the database here; a new folder unless given.")] = None,
    rate_hz: Annotated[int | None, typer.Option(help="Samples and setpoints a second.")] = None,
    seed: Annotated[int | None, typer.Option(help="Vary the simulated mechanics by up to 30 %.")] = None,
) -> None:
    """Teach a motion to a simulated apparatus, play it back, and show the error of every motor."""
    folder = data or Path(mkdtemp(prefix="kata-demo-"))
    if (folder / "kata.db").exists():
        fail(f"{folder} holds a database already; the demonstration wants a fresh one.")
    from kata.cli.demo import FAILURES, demonstrate, write

    logging.basicConfig(level=logging.WARNING)
    settings = Settings(data=folder, database_url="", simulate=True, rate_hz=rate_hz, seed=seed)
    try:
        result = demonstrate(taught, settings)
        if json_out:
            write(result, json_out)
    except FAILURES as error:
        fail(str(error))
    typer.echo(f"Patient, recording and session are in {folder / 'kata.db'}")


@app.command()
def seed(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    number: Annotated[int, typer.Option("--seed", help="The same number on the same day makes the same clinic.")] = 1,
    patients: Annotated[int, typer.Option(min=1, max=12, help="How many of them.")] = 12,
) -> None:
    """Fill an empty clinic with a dozen invented patients and months of their history. Stop the service first."""
    from kata.cli.seed import FAILURES, NUMBER, seeded

    try:
        made = seeded(_settings(data=data), number, patients)
    except FAILURES as error:
        fail(str(error))
    typer.echo(
        f"{made} invented patients. `kata serve --simulate` shows them; their clinic numbers begin with {NUMBER}."
    )


@app.command()
def openapi(out: Annotated[Path | None, typer.Option(help="Write it to this file.")] = None) -> None:
    """Print the OpenAPI document of the service."""
    from kata.api.app import create_app

    _write_json(create_app(Settings()).openapi(), out)


@app.command()
def messages(out: Annotated[Path | None, typer.Option(help="Write them to this file.")] = None) -> None:
    """Print every message of the service: its code and its English template, as JSON."""
    import kata.api.app  # noqa: F401 - with it every package declares its messages
    from kata.messages import CATALOGUE

    _write_json({code: CATALOGUE[code].english for code in sorted(CATALOGUE)}, out)


@accounts.command("link")
def link(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    url: Annotated[str, typer.Option(help="Where the clinic's page is.")] = "http://127.0.0.1:8000",
) -> None:
    """Print a one-time link that makes an administrator, for a clinic that nobody can sign in to any more.

    The service need not be stopped for it. A user name that exists is given the new password, and is an administrator from then on.
    """
    from kata.auth import set_up
    from kata.database.base import utc_now

    settings = _settings(data=data)
    try:
        secret = set_up.offer(settings.data, utc_now())
    except OSError as error:
        fail(f"Nothing can be written to {settings.data}: {error.strerror}.")
    console.print(set_up.invitation(url.rstrip("/"), secret), soft_wrap=True)


@app.command()
def doctor(
    station: Annotated[
        Path | None, typer.Option(help="The station's TOML file; its port is opened for a moment.")
    ] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print JSON instead.")] = False,
) -> None:
    """Look whether this computer can do the work, and say what to do where not. Status 1 when there is a problem."""
    from kata.cli.doctor import as_json, examine

    # What is not granted is said in the lines themselves.
    logging.basicConfig(level=logging.ERROR)
    findings = examine(_settings(station=station, data=data))
    if json_out:
        typer.echo(json.dumps(as_json(findings), indent=2))
    else:
        for finding in findings:
            typer.echo(f"{finding.state:<8} {finding.name}: {finding.message}")
            if finding.what_to_do:
                typer.echo(f"{'':<8}   {finding.what_to_do}")
    if any(finding.state == "problem" for finding in findings):
        raise typer.Exit(1)


def _write_json(content: object, out: Path | None) -> None:
    """Write a document to a file, or to standard output."""
    text = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
    if out:
        out.write_text(text)
    else:
        typer.echo(text, nl=False)


def _settings(**typed: Any) -> Settings:
    """What was typed comes before the environment; what was not, does not."""
    return Settings(**{name: value for name, value in typed.items() if value is not None})
