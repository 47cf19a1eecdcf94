"""Tells systemd that the service is there, and again and again that its event loop turns (sd_notify)."""

import asyncio
import logging
import os
import socket
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager

log = logging.getLogger(__name__)


@asynccontextmanager
async def watched(environment: Mapping[str, str] = os.environ) -> AsyncIterator[None]:
    """While the context lasts; without systemd nothing happens. Half of ``WATCHDOG_USEC`` passes between two words."""
    address = environment.get("NOTIFY_SOCKET", "")
    if not address:
        yield
        return
    # "@" stands for the abstract namespace.
    place = "\0" + address[1:] if address.startswith("@") else address
    every_s = int(environment.get("WATCHDOG_USEC", "0")) / 2e6
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as told:

        def tell(word: bytes) -> None:
            try:
                told.sendto(word, place)
            except OSError as error:
                log.warning("systemd is not told %s: %s", word.decode(), error)

        async def again() -> None:
            while True:
                tell(b"WATCHDOG=1")
                await asyncio.sleep(every_s)

        tell(b"READY=1")
        telling = asyncio.create_task(again(), name="watchdog") if every_s else None
        try:
            yield
        finally:
            tell(b"STOPPING=1")
            if telling:
                telling.cancel()
