"""The ``kata`` command."""

import asyncio
import json
import logging
import os
import signal
import socket
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from importlib.metadata import version
from ipaddress import ip_address
from pathlib import Path
from tempfile import mkdtemp
from typing import Annotated, Any, NoReturn

import typer
import uvicorn
from rich.console import Console

from kata.access import set_up
from kata.access.anchor import AnchorError
from kata.access.audit_commands import app as audit
from kata.access.backups.commands import backup, restore_command
from kata.access.backups.folder import UnfinishedRestoreError
from kata.access.backups.key import BackupError
from kata.access.factor_key import FactorKeyError
from kata.access.openid import OpenIdError
from kata.access.set_up import LASTS
from kata.bench.commands import app as bench
from kata.clinic.reports.letterhead import LetterheadError
from kata.database.base import utc_now
from kata.database.engine import DatabaseError
from kata.demo import demonstrate, write
from kata.device.config import ConfigError
from kata.device.journal import FolderInUseError
from kata.evaluate.commands import evaluate
from kata.motion.taught import TaughtError
from kata.problems import ProblemError
from kata.rehearsal import RehearsalError
from kata.seed import seed
from kata.settings import Settings
from kata.simulator.hand import HandRefusedError
from kata.simulator.process import SimulatorError
from kata.web import live, logs, tls, watchdog
from kata.web.app import create_app
from kata.web.hardening import allowed_hosts

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
app.add_typer(audit, name="audit")
app.add_typer(bench, name="bench")
app.command()(evaluate)
accounts = typer.Typer(no_args_is_help=True, help="Who may sign in.")
app.add_typer(accounts, name="accounts")
app.command()(backup)
app.command("restore")(restore_command)
app.command()(seed)
_LONGEST_MESSAGE = 64 * 1024
"""Bytes of a WebSocket message; the page sends nothing but Stop."""
_console = Console(stderr=True, highlight=False)


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
    given: dict[str, Any] = {"station": station, "host": host, "port": port, "data": data, "rate_hz": rate_hz}
    given["simulate"] = simulate or None
    settings = Settings(**{name: value for name, value in given.items() if value is not None})
    if not settings.simulate and not settings.station:
        _fail("Which apparatus? Give its configuration with --station FILE.toml, or try --simulate.")
    logs.begin(settings.log_format)
    if reload:
        _serve_reloading(settings)
    else:
        try:
            asyncio.run(_serve(settings))
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
        _fail(f"{folder} holds a database already; the demonstration wants a fresh one.")
    logging.basicConfig(level=logging.WARNING)
    settings = Settings(data=folder, database_url="", simulate=True, rate_hz=rate_hz, seed=seed)
    try:
        result = demonstrate(taught, settings, Console())
        if json_out:
            write(result, json_out)
    except (
        TaughtError,
        HandRefusedError,
        RehearsalError,
        ProblemError,
        AnchorError,
        ConfigError,
        DatabaseError,
        FolderInUseError,
        LetterheadError,
        SimulatorError,
        OSError,
    ) as error:
        _fail(str(error))
    typer.echo(f"Patient, recording and session are in {folder / 'kata.db'}")


@app.command()
def openapi(out: Annotated[Path | None, typer.Option(help="Write it to this file.")] = None) -> None:
    """Print the OpenAPI document of the service."""
    text = json.dumps(create_app(Settings()).openapi(), indent=2, ensure_ascii=False) + "\n"
    if out:
        out.write_text(text)
    else:
        typer.echo(text, nl=False)


@accounts.command("link")
def link(
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    url: Annotated[str, typer.Option(help="Where the clinic's page is.")] = "http://127.0.0.1:8000",
) -> None:
    """Print a one-time link that makes an administrator, for a clinic that nobody can sign in to any more.

    The service need not be stopped for it. A user name that exists is given the new password, and is an administrator from then on.
    """
    given: dict[str, Any] = {} if data is None else {"data": data}
    settings = Settings(**given)
    try:
        secret = set_up.offer(settings.data, utc_now())
    except OSError as error:
        _fail(f"Nothing can be written to {settings.data}: {error.strerror}.")
    _print_set_up_link(url.rstrip("/"), secret)


@app.command()
def doctor(
    station: Annotated[
        Path | None, typer.Option(help="The station's TOML file; its port is opened for a moment.")
    ] = None,
    data: Annotated[Path | None, typer.Option(help="Folder for database and journals.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print JSON instead.")] = False,
) -> None:
    """Look whether this computer can do the work, and say what to do where not. Status 1 when there is a problem."""
    from kata.doctor import as_json, examine

    # What is not granted is said in the lines themselves.
    logging.basicConfig(level=logging.ERROR)
    given: dict[str, Any] = {"station": station, "data": data}
    findings = examine(Settings(**{name: value for name, value in given.items() if value is not None}))
    if json_out:
        typer.echo(json.dumps(as_json(findings), indent=2))
    else:
        for finding in findings:
            typer.echo(f"{finding.state:<8} {finding.name}: {finding.message}")
            if finding.what_to_do:
                typer.echo(f"{'':<8}   {finding.what_to_do}")
    if any(finding.state == "problem" for finding in findings):
        raise typer.Exit(1)


class _Server(uvicorn.Server):
    """Says where the page is once it really is there, and what was wrong when it is not."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """As uvicorn's own, without raising the signal again at the end: there is more to be ended after the server."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self.handle_exit, number, None)
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            host, port = self.servers[0].sockets[0].getsockname()[:2]
            url = _address(host, port, encrypted=self.config.is_ssl)
            _console.print(f"[bold]Kata is ready: {url}[/bold]  (Ctrl-C ends it)")
            application: Any = self.config.app
            _print_links(application, url)


def _print_links(application: Any, url: str) -> None:
    """To the terminal, never to the log: whoever reads them is let in."""
    access = application.state.access
    for role, secret in access.links.secrets.items():
        _console.print(f"Demonstration clinic, sign in once as {role}: {url}/sign-in#link={secret}", soft_wrap=True)
    if access.set_up_secret:
        _print_set_up_link(url, access.set_up_secret)


def _print_set_up_link(url: str, secret: str) -> None:
    hours = LASTS.total_seconds() / 3600
    _console.print(
        f"Set up the clinic's administrator, once, within {hours:g} hours: {url}/set-up#secret={secret}", soft_wrap=True
    )


def _address(host: str, port: int, *, encrypted: bool) -> str:
    """Where the page is, for somebody at this computer."""
    reached = ip_address(host)
    if reached.is_unspecified:
        shown = "localhost" if encrypted else "127.0.0.1"
    else:
        shown = f"[{host}]" if reached.version == 6 else host
    return f"{'https' if encrypted else 'http'}://{shown}:{port}"


async def _serve(settings: Settings) -> None:
    """With the lifespan in our own hands, its errors are ours to put into words."""
    application = create_app(settings)
    listening = _listen(settings)
    try:
        async with AsyncExitStack() as stack:
            certificate = tls.Certificate(settings, allowed_hosts(settings)) if settings.encrypted else None
            await stack.enter_async_context(application.router.lifespan_context(application))
            if certificate:
                await stack.enter_async_context(tls.kept(certificate))
                _console.print(f"The certificate's SHA-256 fingerprint: {certificate.fingerprint}", soft_wrap=True)
            await stack.enter_async_context(watchdog.watched())
            await _Server(_configured(application, settings, certificate)).serve([listening])
    except (
        AnchorError,
        BackupError,
        ConfigError,
        DatabaseError,
        FactorKeyError,
        FolderInUseError,
        LetterheadError,
        OpenIdError,
        SimulatorError,
        UnfinishedRestoreError,
        tls.TlsError,
    ) as error:
        _fail(str(error))


def _configured(application: Any, settings: Settings, certificate: tls.Certificate | None) -> uvicorn.Config:
    return uvicorn.Config(
        application,
        lifespan="off",
        log_level="warning",
        timeout_graceful_shutdown=2,
        server_header=False,
        # By itself uvicorn believes every proxy on this computer.
        proxy_headers=bool(settings.trusted_proxies),
        forwarded_allow_ips=settings.trusted_proxies,
        ws_max_size=_LONGEST_MESSAGE,
        # A cable that is pulled closes no socket: who operates the apparatus is asked for all the time.
        ws_ping_interval=live.PING_S,
        ws_ping_timeout=live.PONG_S,
        ssl_context_factory=(lambda config, default: certificate.context) if certificate else None,
    )


def _listen(settings: Settings) -> socket.socket:
    try:
        family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
        return socket.create_server((settings.host, settings.port), family=family)
    except OSError as error:
        _fail(
            f"Cannot listen on {settings.host}:{settings.port}: {error.strerror}. "
            "Is Kata running already? Another port: --port 8001."
        )


def _serve_reloading(settings: Settings) -> None:
    """The reloader starts processes of its own; they find the settings in the environment."""
    if settings.encrypted or not settings.is_on_loopback:
        _fail("--reload is for developers, without encryption and on this computer alone: leave out --host.")
    values: dict[str, Any] = settings.model_dump(mode="json", exclude_none=True)
    os.environ.update({f"KATA_{name.upper()}": str(value) for name, value in values.items()})
    uvicorn.run(
        "kata.cli:development_app",
        factory=True,
        host=settings.host,
        port=settings.port,
        reload=True,
        reload_dirs=[str(Path(__file__).parent)],
        proxy_headers=False,
        log_level="info",
    )


def development_app() -> Any:
    """What the reloader imports."""
    settings = Settings()
    application = create_app(settings)
    started = application.router.lifespan_context

    @asynccontextmanager
    async def announced(app: Any) -> AsyncIterator[Any]:
        async with started(app) as state:
            _print_links(app, f"http://{settings.host}:{settings.port}")
            yield state

    application.router.lifespan_context = announced
    return application


def _fail(message: str) -> NoReturn:
    _console.print(f"[bold red]{message}[/bold red]")
    sys.exit(1)
