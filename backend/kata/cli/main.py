"""The ``kata`` command. Commands import their modules when they run, because importing the whole service takes seconds."""

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
from kata.system.gc_freeze import frozen_imports

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
app.add_typer(audit, name="audit")
app.add_typer(bench, name="bench")
app.command()(evaluate)
accounts = typer.Typer(no_args_is_help=True, help="Manage who may sign in.")
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
    host: Annotated[str | None, typer.Option(help="Address to listen on; default: 127.0.0.1.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on; default: 8000; 0: any free port.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    rate_hz: Annotated[
        int | None, typer.Option(help="Samples and setpoints per second, instead of the station's.")
    ] = None,
    reload: Annotated[
        bool, typer.Option("--reload", help="Restart when the program changes (for developers).")
    ] = False,
) -> None:
    """Start the service: page, API and control of the apparatus."""
    settings = _settings(station=station, host=host, port=port, data=data, rate_hz=rate_hz, simulate=simulate or None)
    if not settings.simulate and not settings.station:
        fail("No apparatus given. Use --station FILE.toml for a real one, or --simulate for a simulated one.")
    with frozen_imports():
        from kata.cli import serve

    try:
        serve.serve(settings, reload=reload)
    except KeyboardInterrupt:
        sys.exit(130)


@app.command()
def demo(
    taught: Annotated[Path, typer.Option(help="The motion to teach: CSV with time_s and the five pose columns.")],
    json_out: Annotated[Path | None, typer.Option("--json", help="Write the errors to this JSON file.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for the database; default: a new temporary folder.")] = None,
    rate_hz: Annotated[int | None, typer.Option(help="Samples and setpoints per second.")] = None,
    seed: Annotated[int | None, typer.Option(help="Vary the simulated mechanics by up to 30 %.")] = None,
) -> None:
    """Teach a motion to a simulated apparatus, play it back, and print the error of every motor."""
    folder = data or Path(mkdtemp(prefix="kata-demo-"))
    if (folder / "kata.db").exists():
        fail(f"{folder} already contains a database; the demonstration needs a new folder.")
    from kata.cli.demo import FAILURES, demonstrate, write

    logging.basicConfig(level=logging.WARNING)
    settings = Settings(data=folder, database_url="", simulate=True, rate_hz=rate_hz, seed=seed)
    try:
        result = demonstrate(taught, settings)
        if json_out:
            write(result, json_out)
    except FAILURES as error:
        fail(str(error))
    typer.echo(f"Patient, recording and session are stored in {folder / 'kata.db'}")


@app.command()
def seed(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    number: Annotated[int, typer.Option("--seed", help="The same number on the same day creates the same clinic.")] = 1,
    patients: Annotated[int, typer.Option(min=1, max=12, help="Number of patients.")] = 12,
) -> None:
    """Fill an empty clinic with up to 12 invented patients and months of their history. Stop the service first."""
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
    import kata.api.app  # noqa: F401 - imports every package that declares messages
    from kata.messages import CATALOGUE

    _write_json({code: CATALOGUE[code].english for code in sorted(CATALOGUE)}, out)


@accounts.command("link")
def link(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    url: Annotated[str, typer.Option(help="Address of the clinic's page.")] = "http://127.0.0.1:8000",
) -> None:
    """Print a one-time link that creates an administrator, for a clinic whose users can no longer sign in.

    The service may run meanwhile. If the user name exists, its account gets the new password and becomes an administrator.
    """
    from kata.auth import set_up
    from kata.database.base import utc_now

    settings = _settings(data=data)
    try:
        secret = set_up.offer(settings.data, utc_now())
    except OSError as error:
        fail(f"Cannot write to {settings.data}: {error.strerror}.")
    console.print(set_up.invitation(url.rstrip("/"), secret), soft_wrap=True)


@app.command()
def doctor(
    station: Annotated[
        Path | None, typer.Option(help="The station's TOML file; the command opens its port for a moment.")
    ] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print JSON instead.")] = False,
) -> None:
    """Check whether this computer is fit for the work, and print what to do where it is not. Status 1 when there is a problem."""
    from kata.cli.doctor import as_json, examine

    # The printed lines already contain what warnings would say.
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
    """Return the settings: given options first, then the environment."""
    return Settings(**{name: value for name, value in typed.items() if value is not None})
