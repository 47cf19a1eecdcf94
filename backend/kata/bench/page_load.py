"""Runs the load of many clients on a service in a separate process: open pages, some of them stalled, and a user who repeatedly
plots a long run.
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
_CONFIRM_EVERY_S: Final = 0.25
"""A page confirms so often that it has shown a state."""
_START_LIMIT_S: Final = 60.0
_FIGURE_LIMIT_S: Final = 600.0


class PageLoadFigures(msgspec.Struct):
    """Figures of the clients."""

    messages: int = 0
    connections_lost: int = 0
    """Number of lost connections."""
    plots: int = 0
    plot_mb: float = 0.0
    """Size of the last plot."""
    plot_s: float = 0.0
    """Duration of the slowest plot in seconds."""
    delivery_p50_ms: float = 0.0
    """Median of the time from a message's own time stamp until it is read."""
    delivery_p99_ms: float = 0.0
    delivery_max_ms: float = 0.0

    def line(self) -> str:
        """Return the figures as a sentence."""
        return (
            f"load: {self.messages} WebSocket messages read, {self.connections_lost} connections lost, {self.plots} plots "
            f"(the last {self.plot_mb:.2f} MB, {self.plot_s:.1f} s at worst)"
        )


@contextmanager
def page_load(
    service: RunningService, records: BenchRecords | None, pages: int = PAGES, stalled: int = 0
) -> Iterator[PageLoadFigures]:
    """Run clients on the service during the block, which begins when all are connected. The figures are filled in at the end.

    Without ``records``, no client plots. ``stalled``: the number of pages that stop reading after their first message.
    """
    arguments = ["--url", service.url, "--pages", str(pages), "--stalled", str(stalled), "--cookie", service.cookie]
    if records:
        arguments += ["--run", str(records.run_id)]
    figures = PageLoadFigures()
    with helper_process("kata.bench.page_load", *arguments, failure="the clients could not connect") as output:
        yield figures
    with contextlib.suppress(msgspec.DecodeError):
        for name, value in msgspec.structs.asdict(msgspec.json.decode(output.text, type=PageLoadFigures)).items():
            setattr(figures, name, value)


class _Sent(msgspec.Struct):
    sent_at: datetime
    sequence: int


_SENT: Final = msgspec.json.Decoder(_Sent)


async def _open_page(
    url: str,
    cookie: str,
    figures: PageLoadFigures,
    connected: asyncio.Semaphore,
    delays_ms: list[float],
    *,
    stalls: bool,
) -> None:
    try:
        live, headers = url.replace("http", "ws", 1) + "/api/live", {"Cookie": cookie}
        async with connect(live, additional_headers=headers, max_size=None) as socket:
            await socket.recv()
            confirm_s = 0.0
            connected.release()
            if stalls:
                # The library stops reading the connection when its queue is full.
                await asyncio.Event().wait()
            async for message in socket:
                figures.messages += 1
                sent = _SENT.decode(message)
                delays_ms.append((time.time() - sent.sent_at.timestamp()) * 1000)
                if (now_s := time.monotonic()) >= confirm_s:
                    confirm_s = now_s + _CONFIRM_EVERY_S
                    await socket.send(json.dumps({"kind": "shown", "sequence": sent.sequence}))
    except (OSError, WebSocketException):
        pass
    figures.connections_lost += 1


def _download_plot(url: str, cookie: str, run: str) -> int:
    request = Request(f"{url}/api/runs/{run}/figures", headers={"Cookie": cookie} | ACTIVE_HEADER)
    with urlopen(request, timeout=_FIGURE_LIMIT_S) as answer:
        size = 0
        while part := answer.read(1 << 20):
            size += len(part)
        return size


async def _plot_repeatedly(url: str, cookie: str, run: str, figures: PageLoadFigures) -> None:
    while True:
        began = time.monotonic()
        figures.plot_mb = await asyncio.to_thread(_download_plot, url, cookie, run) / 1e6
        figures.plots += 1
        figures.plot_s = max(figures.plot_s, time.monotonic() - began)


async def _serve(url: str, cookie: str, run: str | None, pages: int, stalled: int) -> None:
    figures, delays_ms = PageLoadFigures(), list[float]()
    connected = asyncio.Semaphore(0)
    clients = [
        asyncio.create_task(_open_page(url, cookie, figures, connected, delays_ms, stalls=n < stalled))
        for n in range(pages)
    ]
    async with asyncio.timeout(_START_LIMIT_S):
        for _ in clients:
            await connected.acquire()
    # Omit messages that arrived while all clients connected at once.
    delays_ms.clear()
    if run:
        clients.append(asyncio.create_task(_plot_repeatedly(url, cookie, run, figures)))
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    reader = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    await reader.read()
    if delays_ms:
        figures.delivery_p50_ms, figures.delivery_p99_ms, figures.delivery_max_ms = (
            float(value) for value in np.percentile(delays_ms, (50, 99, 100))
        )
    sys.stdout.write(json.dumps(msgspec.structs.asdict(figures)))
    sys.stdout.flush()
    # Skip asyncio's shutdown, because it would wait for an unfinished plot.
    os._exit(0)


def main() -> None:
    """Run ``python -m kata.bench.page_load``."""
    parser = argparse.ArgumentParser(prog="python -m kata.bench.page_load", description=__doc__)
    parser.add_argument("--url", required=True, help="the service")
    parser.add_argument("--cookie", required=True, help="Cookie header of a login session")
    parser.add_argument("--pages", type=int, required=True, help="WebSocket clients")
    parser.add_argument("--stalled", type=int, default=0, help="how many of them stop reading")
    parser.add_argument("--run", help="the run to plot; none by default")
    arguments = parser.parse_args()
    asyncio.run(_serve(arguments.url, arguments.cookie, arguments.run, arguments.pages, arguments.stalled))


if __name__ == "__main__":
    main()
