"""Attacks a service from a separate process over the network, until its standard input is closed: ``python -m benchmarks.attacks``."""

import argparse
import asyncio
import json
import os
import sys
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

import websockets

_FLOODING_SOCKETS: Final = 5
_JUNK_CONNECTIONS: Final = 20
_SLOW_CONNECTIONS: Final = 400
_OPEN_CONNECTIONS: Final = 1000
_LOGINS_AT_ONCE: Final = 16
_JOBS_AT_ONCE: Final = 20
_UPLOADS: Final = 20
_PIECE: Final = 1 << 16
_FLOOD_PIECE: Final = 200
"""Number of messages after which one flooding socket yields to the others."""
_PAUSE_S: Final = 0.01
_FAILED: Final = (OSError, asyncio.IncompleteReadError, websockets.WebSocketException)


@dataclass(frozen=True)
class Target:
    """The attacked service, and the records that the attacker's account may read."""

    host: str
    port: int
    cookie: str
    """``Cookie`` header of the attacker's login session."""
    patient_id: str
    session_id: str


async def _flood_sockets(target: Target, number: int) -> None:
    """Send messages as fast as possible on the live WebSocket until it is closed."""
    address, stop = f"ws://{target.host}:{target.port}/api/live", json.dumps({"kind": "stop", "number": 1})
    text = stop if number % 2 else "x" * 60_000
    with suppress(*_FAILED):
        async with websockets.connect(address, additional_headers={"Cookie": target.cookie}) as socket:
            while True:
                for _ in range(_FLOOD_PIECE):
                    await socket.send(text)
                await asyncio.sleep(0)


async def _send_junk(target: Target, number: int) -> None:
    """Send bytes that are not HTTP."""
    _, writer = await asyncio.open_connection(target.host, target.port)
    try:
        while True:
            writer.write(os.urandom(_PIECE))
            await writer.drain()
    finally:
        writer.close()


async def _send_headers_slowly(target: Target, number: int) -> None:
    """Send one header a second without ending the request."""
    _, writer = await asyncio.open_connection(target.host, target.port)
    try:
        writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\n")
        while True:
            writer.write(b"X-A: b\r\n")
            await writer.drain()
            await asyncio.sleep(1)
    finally:
        writer.close()


async def _hold_connection(target: Target, number: int) -> None:
    """Open a connection, send half of the longest header, and wait."""
    reader, writer = await asyncio.open_connection(target.host, target.port)
    try:
        writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\nX-A: " + b"b" * (_PIECE // 2))
        await writer.drain()
        await reader.read()
    finally:
        writer.close()


async def _guess_passwords(target: Target, number: int) -> None:
    """Try to sign in with names that do not exist."""
    await _ask(target, "POST", "/api/sign-in", _wrong_login(), "application/json", cookie=False)


async def _guess_without_waiting(target: Target, number: int) -> None:
    """Try to sign in and close the connection before the answer."""
    _, writer = await asyncio.open_connection(target.host, target.port)
    try:
        writer.write(_request(target, "POST", "/api/sign-in", _wrong_login(), "application/json", cookie=False))
        await writer.drain()
    finally:
        writer.close()


async def _make_reports(target: Target, number: int) -> None:
    """Ask for a PDF, or for all files of the patient as ZIP."""
    session, patient = f"/api/sessions/{target.session_id}", f"/api/patients/{target.patient_id}"
    await _ask(target, "GET", f"{session}/report.pdf" if number % 2 else f"{patient}/export.zip")


async def _upload(target: Target, number: int) -> None:
    """Send most of a 67 MB file to the login route, without being logged in."""
    _, writer = await asyncio.open_connection(target.host, target.port)
    try:
        writer.write(
            b"POST /api/sign-in HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/csv\r\nContent-Length: 67000000\r\n\r\n"
        )
        for _ in range(67_000_000 // _PIECE - 1):
            writer.write(b"a" * _PIECE)
            await writer.drain()
        await asyncio.sleep(60)
    finally:
        writer.close()


async def _ask(
    target: Target, method: str, path: str, body: bytes = b"", content_type: str = "", *, cookie: bool = True
) -> None:
    """Send a request and read its answer."""
    reader, writer = await asyncio.open_connection(target.host, target.port)
    try:
        writer.write(_request(target, method, path, body, content_type, cookie=cookie))
        await writer.drain()
        while await reader.read(_PIECE):
            pass
    finally:
        writer.close()


def _request(target: Target, method: str, path: str, body: bytes, content_type: str, *, cookie: bool) -> bytes:
    head = f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {len(body)}\r\n"
    head += f"Content-Type: {content_type}\r\n" if content_type else ""
    head += f"Cookie: {target.cookie}\r\n" if cookie else ""
    return head.encode() + b"\r\n" + body


def _wrong_login() -> bytes:
    return json.dumps({"username": f"nobody-{os.urandom(4).hex()}", "password": "a wrong password"}).encode()


Attack = Callable[[Target, int], Coroutine[None, None, None]]
ATTACKS: Final[dict[str, tuple[Attack, int]]] = {
    "socket_flood": (_flood_sockets, _FLOODING_SOCKETS),
    "junk": (_send_junk, _JUNK_CONNECTIONS),
    "slow_headers": (_send_headers_slowly, _SLOW_CONNECTIONS),
    "connections": (_hold_connection, _OPEN_CONNECTIONS),
    "login_storm": (_guess_passwords, _LOGINS_AT_ONCE),
    "hasty_guesses": (_guess_without_waiting, _LOGINS_AT_ONCE),
    "reports": (_make_reports, _JOBS_AT_ONCE),
    "uploads": (_upload, _UPLOADS),
}
"""Attacks by name: the function of one attacker, and the number of attackers at the same time."""


async def _attack(name: str, target: Target) -> int:
    """Attack until standard input ends. Return the number of times that an attacker began."""
    attack, count = ATTACKS[name]
    begun = 0

    async def again(number: int) -> None:
        nonlocal begun
        while True:
            begun += 1
            with suppress(*_FAILED):
                await attack(target, number)
            await asyncio.sleep(_PAUSE_S)

    attackers = [asyncio.create_task(again(number)) for number in range(count)]
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    await asyncio.to_thread(sys.stdin.read)
    for attacker in attackers:
        attacker.cancel()
    await asyncio.wait(attackers)
    return begun


def main() -> None:
    """Run one attack. Print the number of times that its attackers began."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.attacks", description=__doc__)
    parser.add_argument("--name", choices=tuple(ATTACKS), required=True)
    parser.add_argument("--url", required=True)
    parser.add_argument("--cookie", required=True)
    parser.add_argument("--patient", required=True)
    parser.add_argument("--session", required=True)
    given = parser.parse_args()
    where = urlsplit(given.url)
    target = Target(where.hostname or "", where.port or 80, given.cookie, given.patient, given.session)
    sys.stdout.write(str(asyncio.run(_attack(given.name, target))))


if __name__ == "__main__":
    main()
