"""Notify systemd when the service is ready, and then at intervals that its event loop runs (sd_notify)."""

import asyncio
import logging
import os
import socket
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager

log = logging.getLogger(__name__)


@asynccontextmanager
async def systemd_notified(environment: Mapping[str, str] = os.environ) -> AsyncIterator[None]:
    """Notify systemd while the context lasts, every half of ``WATCHDOG_USEC``. Without systemd, do nothing."""
    address = environment.get("NOTIFY_SOCKET", "")
    if not address:
        yield
        return
    # "@" at the beginning means the abstract namespace.
    path = "\0" + address[1:] if address.startswith("@") else address
    period_s = int(environment.get("WATCHDOG_USEC", "0")) / 2e6
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as notify_socket:

        def notify(state: bytes) -> None:
            try:
                notify_socket.sendto(state, path)
            except OSError as error:
                log.warning("systemd could not be notified of %s: %s", state.decode(), error)

        async def repeat() -> None:
            while True:
                notify(b"WATCHDOG=1")
                await asyncio.sleep(period_s)

        notify(b"READY=1")
        repeating = asyncio.create_task(repeat(), name="watchdog") if period_s else None
        try:
            yield
        finally:
            notify(b"STOPPING=1")
            if repeating:
                repeating.cancel()
