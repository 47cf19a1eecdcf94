"""``kata serve``: run the service on its socket. Errors at the start are printed as sentences, and links only on the terminal."""

import asyncio
import logging
import os
import signal
import socket
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager, suppress
from functools import partial
from ipaddress import ip_address
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

import uvicorn
from fastapi import FastAPI
from sqlalchemy.orm import configure_mappers

from kata.api import live, logs, systemd_notify
from kata.api.app import create_app
from kata.api.connection_limits import LimitedListener, LimitedProtocol, OpenConnections
from kata.api.message_limits import BYTES_AT_ONCE, LimitedWebSocket
from kata.api.security_middleware import allowed_hosts
from kata.api.services import Services
from kata.audit.anchor import AnchorError
from kata.auth import set_up
from kata.auth.factor_key import FactorKeyError
from kata.auth.openid import OpenIdError
from kata.backups.folder import UnfinishedRestoreError
from kata.backups.key import BackupError
from kata.database.engine import DatabaseError
from kata.device.config import ConfigError
from kata.device.journal import FolderInUseError
from kata.settings import Settings
from kata.simulator.process import SimulatorError
from kata.system import malloc
from kata.system.console import console, fail
from kata.system.gc_freeze import permanent_objects
from kata.system.private_files import make_private

if TYPE_CHECKING:
    from kata.api.tls import Certificate

log = logging.getLogger(__name__)

WAITING_CONNECTIONS: Final = 2048
"""Number of connections that may wait in the kernel until they are accepted."""
ACCEPTED_AT_ONCE: Final = 16
"""Number of connections accepted in one step of the event loop. Accepting all waiting ones would, in a flood, stop everything else for
0.2 s.
"""
_TICK_S: Final = 1.0


def serve(settings: Settings, *, reload: bool) -> None:
    """Run the service until it is ended. ``reload``: restart each time the program changes.

    :raises SystemExit: when the service cannot start; the reason is then on the terminal.
    :raises KeyboardInterrupt: when Ctrl-C ended it.
    """
    logs.begin(settings.log_format)
    _make_private(settings.data)
    if reload:
        _serve_reloading(settings)
        return
    malloc.return_free_memory()
    with permanent_objects():
        application = create_app(settings)
        # The first query would do this otherwise.
        configure_mappers()
    asyncio.run(_serve(settings, application))


def _make_private(folder: Path) -> None:
    """Repair the permissions of a data folder from an earlier version, which other users of the computer could read."""
    try:
        changed = make_private(folder)
    except OSError as error:
        log.warning("other users of this computer may read %s: %s", error.filename or folder, error.strerror)
        return
    if changed:
        log.warning(
            "other users of this computer could read %d files and folders in %s; repaired", len(changed), folder
        )


class _Server(uvicorn.Server):
    """Prints the page's address when the server is ready. Wakes once a second, not ten times as uvicorn does."""

    def __init__(self, configured: uvicorn.Config) -> None:
        """Prepare without starting."""
        super().__init__(configured)
        self._exit_requested = asyncio.Event()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End the server at once. The event loop calls this for a signal."""
        super().handle_exit(sig, frame)
        self._exit_requested.set()

    async def main_loop(self) -> None:
        """Update the answers' date every second until the server ends."""
        while not await self.on_tick(0):
            with suppress(TimeoutError):
                async with asyncio.timeout(_TICK_S):
                    await self._exit_requested.wait()

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Handle signals like uvicorn, but do not raise them again at the end, because the services still have to shut down."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self.handle_exit, number, None)
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        for listening in sockets or []:
            listening.listen(WAITING_CONNECTIONS)
        if self.started:
            host, port = self.servers[0].sockets[0].getsockname()[:2]
            url = _address(host, port, encrypted=self.config.is_ssl)
            console.print(f"[bold]Kata is ready: {url}[/bold]  (Ctrl-C ends it)")
            application: Any = self.config.app
            _print_links(application, url)


def _print_links(application: Any, url: str) -> None:
    """Print the links on the terminal and never in the log, because anyone who has a link can sign in."""
    services: Services = application.state.services
    auth = services.auth
    for role, secret in auth.links.secrets.items():
        console.print(f"Demonstration clinic, sign in once as {role}: {url}/sign-in#link={secret}", soft_wrap=True)
    if auth.set_up_secret:
        console.print(set_up.invitation(url, auth.set_up_secret), soft_wrap=True)


def _address(host: str, port: int, *, encrypted: bool) -> str:
    """Return the page's address for this computer."""
    reached = ip_address(host)
    if reached.is_unspecified:
        shown_host = "localhost" if encrypted else "127.0.0.1"
    else:
        shown_host = f"[{host}]" if reached.version == 6 else host
    return f"{'https' if encrypted else 'http'}://{shown_host}:{port}"


async def _serve(settings: Settings, application: FastAPI) -> None:
    """Run the application's lifespan here instead of in uvicorn, so that its errors can be printed as sentences."""
    open_connections = OpenConnections(
        settings.connections_per_address, settings.trusted_proxies, partial(_warn_of_proxy, settings)
    )
    listening = LimitedListener(_listen(settings), open_connections)
    try:
        async with AsyncExitStack() as stack:
            stack.enter_context(listening)
            certificate = await stack.enter_async_context(_encryption(settings))
            await stack.enter_async_context(application.router.lifespan_context(application))
            if certificate:
                console.print(f"The certificate's SHA-256 fingerprint: {certificate.fingerprint}", soft_wrap=True)
            await stack.enter_async_context(systemd_notify.systemd_notified())
            configured = _configured(application, settings, certificate, open_connections)
            await _Server(configured).serve([listening])
    except (
        AnchorError,
        BackupError,
        ConfigError,
        DatabaseError,
        FactorKeyError,
        FolderInUseError,
        OpenIdError,
        SimulatorError,
        UnfinishedRestoreError,
    ) as error:
        fail(str(error))


@asynccontextmanager
async def _encryption(settings: Settings) -> AsyncIterator["Certificate | None"]:
    """Yield the certificate, which is refreshed while the context lasts; None without encryption."""
    if not settings.encrypted:
        yield None
        return
    # Imported here, because the library of certificates would delay every start without encryption.
    from kata.api.tls import Certificate, TlsError, refreshed

    try:
        certificate = Certificate(settings, allowed_hosts(settings))
    except TlsError as error:
        fail(str(error))
    async with refreshed(certificate):
        yield certificate


def _configured(
    application: Any, settings: Settings, certificate: "Certificate | None", open_connections: OpenConnections
) -> uvicorn.Config:
    return uvicorn.Config(
        application,
        lifespan="off",
        log_level="warning",
        timeout_graceful_shutdown=2,
        # asyncio takes the backlog for both values; the server's start then sets the kernel's to WAITING_CONNECTIONS.
        backlog=ACCEPTED_AT_ONCE,
        server_header=False,
        http=partial(LimitedProtocol, open_connections),  # type: ignore[arg-type]
        # Uvicorn's default would trust every proxy on this computer.
        proxy_headers=bool(settings.trusted_proxies),
        forwarded_allow_ips=settings.trusted_proxies,
        ws=LimitedWebSocket,
        ws_max_size=BYTES_AT_ONCE,
        # A small compressed message can expand to a long one, which blocks the event loop.
        ws_per_message_deflate=False,
        # An unplugged cable closes no socket, so the operator's browser is pinged all the time.
        ws_ping_interval=live.PING_S,
        ws_ping_timeout=live.PONG_S,
        ssl_context_factory=(lambda config, default: certificate.context) if certificate else None,
    )


def _warn_of_proxy(settings: Settings, address: str) -> None:
    """Log that a proxy is not listed, and store its address for ``kata doctor``."""
    log.warning(
        "a request from %s came through a proxy that is not in KATA_TRUSTED_PROXIES: all users behind it count as one address, "
        "so the wrong passwords of one user delay the login of all, and the audit trail names the proxy; add its address to the setting",
        address,
    )
    with suppress(OSError):
        settings.unlisted_proxy_file.write_text(address)


def _listen(settings: Settings) -> socket.socket:
    try:
        family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
        return socket.create_server((settings.host, settings.port), family=family)
    except OSError as error:
        fail(
            f"Cannot listen on {settings.host}:{settings.port}: {error.strerror}. "
            "Is Kata already running? To use another port: --port 8001."
        )


def _serve_reloading(settings: Settings) -> None:
    """Pass the settings through the environment to the processes that the reloader starts."""
    if settings.encrypted or not settings.is_on_loopback:
        fail("--reload works only without encryption and on this computer: leave out --host.")
    os.environ.update(settings.as_environment())
    uvicorn.run(
        "kata.cli.serve:development_app",
        factory=True,
        host=settings.host,
        port=settings.port,
        reload=True,
        reload_dirs=[str(Path(__file__).parent)],
        proxy_headers=False,
        log_level="info",
    )


def development_app() -> Any:
    """Return the application for the reloader."""
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
