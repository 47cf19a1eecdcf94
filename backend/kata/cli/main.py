"""The ``kata`` command. Commands import their modules when they run, because importing the whole service takes seconds."""

import json
import logging
import sys
from getpass import getuser
from pathlib import Path
from tempfile import mkdtemp
from typing import Annotated, Any, Literal

import typer

from kata import __version__
from kata.audit.commands import app as audit
from kata.backups.commands import backup, restore
from kata.bench.commands import app as bench
from kata.clinic.questionnaires.commands import app as questionnaires
from kata.evaluation.commands import evaluate
from kata.motion.axes import CANONICAL_SIDE, Side
from kata.settings import Settings
from kata.system.console import console, fail
from kata.system.gc_freeze import permanent_objects

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
app.add_typer(audit, name="audit")
app.add_typer(bench, name="bench")
app.add_typer(questionnaires, name="questionnaires")
app.command()(evaluate)
accounts = typer.Typer(no_args_is_help=True, help="Manage who may sign in.")
app.add_typer(accounts, name="accounts")
app.command()(backup)
app.command()(restore)


@app.callback(invoke_without_command=True)
def _common(show_version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    """The software of a shoulder-rehabilitation apparatus."""
    if show_version:
        typer.echo(f"kata {__version__}")
        raise typer.Exit


@app.command()
def serve(
    simulate: Annotated[bool, typer.Option("--simulate", help="Start a simulated apparatus.")] = False,
    station: Annotated[Path | None, typer.Option(help="The station's TOML file.")] = None,
    host: Annotated[str | None, typer.Option(help="Address to listen on; default: 127.0.0.1.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on; default: 8000. 0 chooses a free port.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    rate_hz: Annotated[
        int | None, typer.Option(help="Samples and setpoints per second, instead of the rate in the station's file.")
    ] = None,
    reload: Annotated[
        bool, typer.Option("--reload", help="Restart when the program changes (for developers).")
    ] = False,
) -> None:
    """Start the service: page, API and control of the apparatus."""
    settings = _settings(station=station, host=host, port=port, data=data, rate_hz=rate_hz, simulate=simulate or None)
    if not settings.simulate and not settings.station:
        fail("No apparatus given. Use --station FILE.toml for a real one, or --simulate for a simulated one.")
    with permanent_objects():
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
    seed: Annotated[
        int | None, typer.Option(help="Seed of a variation of the simulated mechanics by up to 30 %.")
    ] = None,
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
def simulate(
    plant: Annotated[
        Literal["simple", "mujoco"],
        typer.Option(
            help="Simulated mechanics: simple, or mujoco, which was written independently of the controller (kata[evaluate])."
        ),
    ] = "simple",
    number: Annotated[
        int | None,
        typer.Option(
            "--seed", min=0, help="Seed of a variation of the simulated mechanics by up to 30 %. Default: no variation."
        ),
    ] = None,
    protocol: Annotated[Literal["dynamixel", "modbus"], typer.Option(help="Protocol of the drives.")] = "dynamixel",
    baud: Annotated[int, typer.Option(help="Baud rate of the drives.")] = 1_000_000,
) -> None:
    """Run a simulated apparatus in real time on a pseudo-terminal until Ctrl-C. A station's file can name it as its port."""
    from kata.simulator.process import SimulatorError, SimulatorProcess

    folder = Path(mkdtemp(prefix="kata-simulate-"))
    try:
        apparatus = SimulatorProcess(folder, number, protocol, baud, plant=plant)
    except SimulatorError as error:
        fail(str(error))
    typer.echo(f"The simulated apparatus ({plant}) answers at {apparatus.port}.")
    typer.echo(f"Hand, pedal and emergency stop: {apparatus.control}. Log: {folder / 'simulator.log'}")
    try:
        status = apparatus.wait()
    except KeyboardInterrupt:
        return
    finally:
        apparatus.close()
    fail(f"The simulated apparatus has ended with status {status}; see {folder / 'simulator.log'}.")


@app.command()
def seed(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    number: Annotated[
        int,
        typer.Option(
            "--seed", help="Seed of the invented data. The same seed on the same day creates the same clinic."
        ),
    ] = 1,
    patients: Annotated[int, typer.Option(min=1, max=60, help="Number of patients.")] = 60,
    language: Annotated[Literal["en", "ja"], typer.Option(help="Language of names and notes.")] = "en",
) -> None:
    """Fill an empty clinic with up to 60 invented patients and two years of their history. Stop the service first."""
    from kata.cli.seed import FAILURES, NUMBER, STATION_FILE, seeded

    settings = _settings(data=data)
    try:
        patient_count = seeded(settings, number, patients, language)
    except FAILURES as error:
        fail(str(error))
    typer.echo(
        f"Created {patient_count} invented patients. `kata serve --simulate --station {settings.data / STATION_FILE}` shows them. Their clinic numbers begin with {NUMBER}."
    )


@app.command()
def openapi(out: Annotated[Path | None, typer.Option(help="Write the document to this file.")] = None) -> None:
    """Print the OpenAPI document of the service."""
    from kata.api.app import create_app

    _write_json(create_app(Settings()).openapi(), out)


@app.command()
def messages(out: Annotated[Path | None, typer.Option(help="Write the messages to this file.")] = None) -> None:
    """Print every message of the service: its code and its English template, as JSON."""
    import kata.api.app  # noqa: F401 - imports every package that declares messages
    from kata.messages import CATALOGUE

    _write_json({code: CATALOGUE[code].english for code in sorted(CATALOGUE)}, out)


@app.command()
def mjcf(
    side: Annotated[Side, typer.Option(help="Shoulder for which the apparatus is set up.")] = CANONICAL_SIDE,
    seed: Annotated[
        int | None, typer.Option(help="Seed of a variation of patient and gears. Default: nominal values.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the model to this file.")] = None,
) -> None:
    """Print the model of apparatus and arm as MJCF, for MuJoCo and its viewers.

    The model contains masses, links, friction and play. The drives, the patient's resistance and the balancer act through its motors.
    """
    from kata.simulator.independent import model
    from kata.simulator.independent.parameters import independent_parameters

    _write_text(model.mjcf(independent_parameters(seed), turned=side != CANONICAL_SIDE) + "\n", out)


@accounts.command("link")
def link(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    url: Annotated[str, typer.Option(help="Address of the clinic's page.")] = "http://127.0.0.1:8000",
) -> None:
    """Print a one-time link that creates an administrator, for a clinic whose users can no longer sign in.

    The service may be running. If the user name exists, its account gets the new password and becomes an administrator.
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
        Path | None, typer.Option(help="The station's TOML file. The command also opens its port and reads its drives.")
    ] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print JSON instead.")] = False,
) -> None:
    """Check whether this computer can run Kata, and print a remedy for each problem. The exit status is 1 if there is a problem."""
    from kata.cli.doctor import as_json, examine

    # The printed lines already contain the content of the warnings.
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


@app.command()
def commission(
    station: Annotated[
        Path, typer.Argument(help="The station's TOML file. The command writes it when every step has passed.")
    ],
    port: Annotated[
        str | None, typer.Option(help="The serial port. Default: the port in the file, or /dev/ttyUSB0.")
    ] = None,
    by: Annotated[str, typer.Option(help="Name of the technician. Default: the user of this terminal.")] = "",
    begin: Annotated[
        str | None, typer.Option("--from", help="Repeat the procedure from this step on, for example axes.")
    ] = None,
    check: Annotated[bool, typer.Option("--check", help="Run the periodic check of a commissioned station.")] = False,
    simulate: Annotated[
        int | None,
        typer.Option(
            min=0, help="For training: commission a simulated apparatus with new drives, made from this seed."
        ),
    ] = None,
    lines: Annotated[bool, typer.Option("--lines", hidden=True)] = False,
) -> None:
    """Guide a technician from new drives to a checked station's file and a record. Stop the service first."""
    from kata.cli.commission import STEP_KEYS, run, run_check

    if begin is not None and begin not in STEP_KEYS:
        raise typer.BadParameter(f"{begin} is not one of {', '.join(STEP_KEYS)}", param_hint="--from")
    name = by or getuser()
    passed = run_check(station, name, lines=lines) if check else run(station, port, name, begin, simulate, lines=lines)
    if not passed:
        raise typer.Exit(1)


@app.command()
def identify(
    station: Annotated[
        Path, typer.Argument(help="The station's TOML file. The steps of kata commission before lags must have passed.")
    ],
    write: Annotated[
        bool,
        typer.Option(
            "--write", help="Record the result, play the six motions with it, and then write the station's file."
        ),
    ] = False,
    by: Annotated[str, typer.Option(help="Name of the technician. Default: the user of this terminal.")] = "",
) -> None:
    """Identify lag and friction of each motor with a safe movement, and print them with residual and uncertainty. Stop the service first.

    All motors move. The result is refused if the fit is poor. Without --write the command changes no file.
    """
    from kata.cli.commission import identify

    if not identify(station, by or getuser(), write=write):
        raise typer.Exit(1)


@app.command("support-bundle")
def support_bundle(
    out: Annotated[Path, typer.Option(help="The ZIP file to write.")] = Path("kata-support.zip"),
    station: Annotated[Path | None, typer.Option(help="The station's TOML file.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
) -> None:
    """Write a ZIP file that describes this installation to its maintainers. It contains no patient data and no secrets. The service may
    be running.
    """
    from kata.cli.support_bundle import write

    logging.basicConfig(level=logging.ERROR)
    try:
        write(_settings(station=station, data=data), out)
    except OSError as error:
        fail(f"Cannot write {out}: {error.strerror}.")
    typer.echo(
        f"Wrote {out}. It contains no patient data. Its README.txt lists the parts; look through them before you send the file."
    )


@app.command()
def update(
    bundle: Annotated[
        Path | None, typer.Option("--from", help="The signed bundle of the new version.", exists=True, dir_okay=False)
    ] = None,
    key: Annotated[Path, typer.Option(help="Public key of the people who sign bundles (PEM, Ed25519).")] = Path(
        "/etc/kata/update-key.pem"
    ),
    unit: Annotated[
        list[str] | None, typer.Option(help="systemd unit of a Kata service on this computer; may be repeated.")
    ] = None,
    ready_within_s: Annotated[
        float, typer.Option(min=1.0, help="Time within which the new version must be ready, seconds.")
    ] = 600.0,
    installed: Annotated[str, typer.Option(help="Change to this version, which a package has installed already.")] = "",
    resume: Annotated[bool, typer.Option("--resume", help="Finish or undo an interrupted update.")] = False,
) -> None:
    """Update Kata on this computer without the internet. The update is undone if the new version does not become ready.

    The update is refused while a motor has torque or a session is open.
    """
    from kata.cli.update import update

    if sum((bundle is not None, bool(installed), resume)) != 1:
        raise typer.BadParameter("give exactly one of --from, --installed and --resume", param_hint="--from")
    update(bundle, installed, key, unit or ["kata"], ready_within_s)


@app.command("data-before-update", hidden=True)
def data_before_update(step: Literal["save", "put-back"]) -> None:
    """Save the data before an update, or put them back (a step of kata update)."""
    from kata.cli.update import data_before_update

    data_before_update(step, _settings())


def _write_json(content: object, out: Path | None) -> None:
    """Write a document to a file, or to standard output."""
    _write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", out)


def _write_text(text: str, out: Path | None) -> None:
    if out:
        out.write_text(text)
    else:
        typer.echo(text, nl=False)


def _settings(**typed: Any) -> Settings:
    """Return the settings: given options first, then the environment."""
    return Settings(**{name: value for name, value in typed.items() if value is not None})
