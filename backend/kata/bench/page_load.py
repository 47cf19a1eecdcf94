"""A busy service: many pages open, of which some may have stalled, and one user who draws a long run again and again. In a process
of its own.
"""

import argparse
import asyncio
import contextlib
import json
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from typing import Final
from urllib.request import Request, urlopen

import msgspec
import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from kata.bench.account import ACTIVE_HEADER
from kata.bench.helper_process import helper_process
from kata.bench.records import BenchRecords
from kata.bench.running_service import RunningService

PAGES: Final = 100
_START_LIMIT_S: Final = 60.0
_FIGURE_LIMIT_S: Final = 600.0


class PageLoadFigures(msgspec.Struct):
    """What the clients got."""

    messages: int = 0
    hung_up: int = 0
    """Connections that did not last."""
    figures: int = 0
    figure_mb: float = 0.0
    figure_s: float = 0.0
    """Seconds for the slowest one."""
    delivery_p50_ms: float = 0.0
    """From the message's own time to its arrival, read; half of them took no longer."""
    delivery_p99_ms: float = 0.0
    delivery_max_ms: float = 0.0

    def line(self) -> str:
        """In words."""
        return (
            f"load: {self.messages} WebSocket messages read, {self.hung_up} connections lost, {self.figures} times the plot "
            f"({self.figure_mb:.0f} MB, {self.figure_s:.1f} s at worst)"
        )


@contextmanager
def page_load(
    service: RunningService, records: BenchRecords | None, pages: int = PAGES, stalled: int = 0
) -> Iterator[PageLoadFigures]:
    """Clients on the service while the block lasts, all connected when it begins; then it is told what they got.

    ``records`` None: nobody draws. ``stalled``: so many of the pages read nothing after their first message.
    """
    arguments = ["--url", service.url, "--pages", str(pages), "--stalled", str(stalled), "--cookie", service.cookie]
    if records:
        arguments += ["--run", str(records.run_id)]
    told = PageLoadFigures()
    with helper_process(
        "kata.bench.page_load", *arguments, failure="the clients that make the load could not connect"
    ) as output:
        yield told
    with contextlib.suppress(msgspec.DecodeError):
        for name, value in msgspec.structs.asdict(msgspec.json.decode(output.text, type=PageLoadFigures)).items():
            setattr(told, name, value)


class _Sent(msgspec.Struct):
    sent_at: datetime


_SENT: Final = msgspec.json.Decoder(_Sent)


async def _page(
    url: str, cookie: str, told: PageLoadFigures, connected: asyncio.Semaphore, took_ms: list[float], *, stalls: bool
) -> None:
    try:
        live, headers = url.replace("http", "ws", 1) + "/api/live", {"Cookie": cookie}
        async with connect(live, additional_headers=headers, max_size=None) as socket:
            await socket.recv()
            connected.release()
            if stalls:
                # Nothing is taken from it any more: soon nothing is read of the connection, either.
                await asyncio.Event().wait()
            async for message in socket:
                told.messages += 1
                took_ms.append((time.time() - _SENT.decode(message).sent_at.timestamp()) * 1000)
    except (OSError, WebSocketException):
        pass
    told.hung_up += 1


def _draw(url: str, cookie: str, run: str) -> int:
    request = Request(f"{url}/api/runs/{run}/figures", headers={"Cookie": cookie} | ACTIVE_HEADER)
    with urlopen(request, timeout=_FIGURE_LIMIT_S) as answer:
        size = 0
        while part := answer.read(1 << 20):
            size += len(part)
        return size


async def _user(url: str, cookie: str, run: str, told: PageLoadFigures) -> None:
    while True:
        began = time.monotonic()
        told.figure_mb = await asyncio.to_thread(_draw, url, cookie, run) / 1e6
        told.figures += 1
        told.figure_s = max(told.figure_s, time.monotonic() - began)


async def _serve(url: str, cookie: str, run: str | None, pages: int, stalled: int) -> None:
    told, took_ms = PageLoadFigures(), list[float]()
    connected = asyncio.Semaphore(0)
    clients = [
        asyncio.create_task(_page(url, cookie, told, connected, took_ms, stalls=n < stalled)) for n in range(pages)
    ]
    async with asyncio.timeout(_START_LIMIT_S):
        for _ in clients:
            await connected.acquire()
    # What came while they all connected at once is no page's day.
    took_ms.clear()
    if run:
        clients.append(asyncio.create_task(_user(url, cookie, run, told)))
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    reader = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    await reader.read()
    if took_ms:
        told.delivery_p50_ms, told.delivery_p99_ms, told.delivery_max_ms = (
            float(value) for value in np.percentile(took_ms, (50, 99, 100))
        )
    sys.stdout.write(json.dumps(msgspec.structs.asdict(told)))
    sys.stdout.flush()
    # Not by way of asyncio's own end: that would wait for a plot that is still on its way.
    os._exit(0)


def main() -> None:
    """Entry of ``python -m kata.bench.page_load``."""
    parser = argparse.ArgumentParser(prog="python -m kata.bench.page_load", description=__doc__)
    parser.add_argument("--url", required=True, help="the service")
    parser.add_argument("--cookie", required=True, help="header of somebody who is signed in")
    parser.add_argument("--pages", type=int, required=True, help="WebSocket clients")
    parser.add_argument("--stalled", type=int, default=0, help="of them, so many that read nothing")
    parser.add_argument("--run", help="the run to draw; none unless given")
    arguments = parser.parse_args()
    asyncio.run(_serve(arguments.url, arguments.cookie, arguments.run, arguments.pages, arguments.stalled))


if __name__ == "__main__":
    main()
