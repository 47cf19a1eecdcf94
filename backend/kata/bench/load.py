"""A busy clinic: many pages open, and one user who draws a long run again and again. In a process of its own."""

import argparse
import asyncio
import contextlib
import json
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final
from urllib.request import Request, urlopen

import msgspec
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from kata.bench.beside import beside
from kata.bench.clinic import Clinic
from kata.bench.prepared import Prepared
from kata.bench.signed_in import ACTIVE

PAGES: Final = 100
_START_LIMIT_S: Final = 60.0
_FIGURE_LIMIT_S: Final = 600.0


class Told(msgspec.Struct):
    """What the clients got."""

    messages: int = 0
    hung_up: int = 0
    """Connections that did not last."""
    figures: int = 0
    figure_mb: float = 0.0
    figure_s: float = 0.0
    """Seconds for the slowest one."""

    def line(self) -> str:
        """In words."""
        return (
            f"load: {self.messages} WebSocket messages read, {self.hung_up} connections lost, {self.figures} times the plot "
            f"({self.figure_mb:.0f} MB, {self.figure_s:.1f} s at worst)"
        )


@contextmanager
def loading(clinic: Clinic, records: Prepared | None, pages: int = PAGES) -> Iterator[Told]:
    """Clients on the service while the block lasts, all connected when it begins; then it is told what they got.

    ``records`` None: nobody draws.
    """
    arguments = ["--url", clinic.url, "--pages", str(pages), "--cookie", clinic.cookie]
    if records:
        arguments += ["--run", str(records.run_id)]
    told = Told()
    with beside("kata.bench.load", *arguments, sorry="the clients that make the load could not connect") as said:
        yield told
    with contextlib.suppress(msgspec.DecodeError):
        for name, value in msgspec.structs.asdict(msgspec.json.decode(said.last, type=Told)).items():
            setattr(told, name, value)


async def _page(url: str, cookie: str, told: Told, connected: asyncio.Semaphore) -> None:
    try:
        live, headers = url.replace("http", "ws", 1) + "/api/live", {"Cookie": cookie}
        async with connect(live, additional_headers=headers, max_size=None) as socket:
            connected.release()
            async for _ in socket:
                told.messages += 1
    except (OSError, WebSocketException):
        pass
    told.hung_up += 1


def _draw(url: str, cookie: str, run: str) -> int:
    request = Request(f"{url}/api/runs/{run}/figures", headers={"Cookie": cookie} | ACTIVE)
    with urlopen(request, timeout=_FIGURE_LIMIT_S) as answer:
        size = 0
        while part := answer.read(1 << 20):
            size += len(part)
        return size


async def _user(url: str, cookie: str, run: str, told: Told) -> None:
    while True:
        began = time.monotonic()
        told.figure_mb = await asyncio.to_thread(_draw, url, cookie, run) / 1e6
        told.figures += 1
        told.figure_s = max(told.figure_s, time.monotonic() - began)


async def _serve(url: str, cookie: str, run: str | None, pages: int) -> None:
    told = Told()
    connected = asyncio.Semaphore(0)
    clients = [asyncio.create_task(_page(url, cookie, told, connected)) for _ in range(pages)]
    async with asyncio.timeout(_START_LIMIT_S):
        for _ in clients:
            await connected.acquire()
    if run:
        clients.append(asyncio.create_task(_user(url, cookie, run, told)))
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    reader = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    await reader.read()
    sys.stdout.write(json.dumps(msgspec.structs.asdict(told)))
    sys.stdout.flush()
    # Not by way of asyncio's own end: that would wait for a plot that is still on its way.
    os._exit(0)


def main() -> None:
    """Entry of ``python -m kata.bench.load``."""
    parser = argparse.ArgumentParser(prog="python -m kata.bench.load", description=__doc__)
    parser.add_argument("--url", required=True, help="the service")
    parser.add_argument("--cookie", required=True, help="header of somebody who is signed in")
    parser.add_argument("--pages", type=int, required=True, help="WebSocket clients")
    parser.add_argument("--run", help="the run to draw; none unless given")
    arguments = parser.parse_args()
    asyncio.run(_serve(arguments.url, arguments.cookie, arguments.run, arguments.pages))


if __name__ == "__main__":
    main()
