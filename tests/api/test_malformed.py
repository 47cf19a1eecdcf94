"""Malformed Host, Origin and Forwarded headers, byte by byte over the wire: none grants access, none opens a socket."""

import random
import socket
from collections.abc import Iterator
from itertools import cycle, islice, product
from typing import Final

import pytest

from kata.auth.login_session import COOKIE
from tests.support.browser_clinic import Clinic

_FEW: Final = 32
_MANY: Final = 1000
_PLACES: Final = (
    "evil.example",
    "127.0.0.1",
    "localhost",
    "::1",
    "[::1]",
    "0",
    "0x7f000001",
    "2130706433",
    "127.1",
    "null",
)
_WRAPPED: Final = (
    "{own}@{place}", "{place}@{own}", "{place}#{own}", "{place}/{own}", "{own}.{place}", "{place}.{own}", "{own},{place}",
    "{place}, {own}", "{own} {place}", "{own}\t{place}", "{own}\\{place}", "{own}%00{place}", "{own}%2e{place}", "{own}:{place}",
    "{own}:99999999", "{own}:-1", "{own}:", "{own}..", "-{own}", "[{own}]", "[{own}", "{own}]", "\xff{own}", "{own}\xa0", '"{own}"',
    "//{own}", "http:/{own}", "javascript:{own}", "*", "{own};{place}", "${{{own}}}", "\u00ad{own}".encode().decode("latin-1"),
)  # fmt: skip


def wrong_hosts(own: str) -> Iterator[str]:
    """Yield hosts that are not the service's own, though a lenient parser could take them for it."""
    for shape, place in product(_WRAPPED, _PLACES):
        wrong = shape.format(own=own, place=place)
        yield wrong
        yield wrong.swapcase() + "x"


def forwarded(place: str, turn: int) -> list[str]:
    """Return headers of a proxy that no setting names, well-formed or not."""
    return [
        [f"Forwarded: for={place};host={place};proto=https"],
        [f"X-Forwarded-For: {place}, 127.0.0.1", "X-Forwarded-Proto: https"],
        [f"X-Forwarded-Host: {place}", f"X-Real-IP: {place}"],
        [f'Forwarded: for="[{place}', "Forwarded: ;;;,,,=", f"X-Forwarded-For: {'9' * turn}"],
        [f"X-Original-URL: /api/patients?{place}", "X-Rewrite-URL: /api/patients", "X-HTTP-Method-Override: DELETE"],
    ][turn % 5]


class Wire:
    """Sends bytes to a listening service."""

    def __init__(self, port: int, cookie: str) -> None:
        self.own = f"127.0.0.1:{port}"
        self._port, self._cookie = port, f"Cookie: {COOKIE}={cookie}"

    def status(self, method: str, path: str, headers: list[str], *, signed_in: bool) -> int:
        """Return the status of one request on its own connection, 0 if the service closes it without an answer."""
        lines = [f"{method} {path} HTTP/1.1", *headers, "Connection: close", "Content-Length: 0"]
        return self._first([*lines, self._cookie] if signed_in else lines)

    def upgrade(self, headers: list[str], *, signed_in: bool) -> int:
        """Return the status of the handshake of /api/live; 101 opens a socket."""
        key = [
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==",
        ]
        lines = ["GET /api/live HTTP/1.1", *headers, *key]
        return self._first([*lines, self._cookie] if signed_in else lines)

    def _first(self, lines: list[str]) -> int:
        with socket.create_connection(("127.0.0.1", self._port), timeout=20) as connection:
            connection.sendall("\r\n".join([*lines, "", ""]).encode())
            answer = connection.makefile("rb").readline().split()
        return int(answer[1]) if answer else 0


@pytest.fixture(scope="module")
def wire(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Wire]:
    """Return the service as `kata serve` starts it, with an administrator's cookie. It allows as many connections a second as are tried."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KATA_CONNECTIONS_PER_ADDRESS", "1000")
        clinic = Clinic(tmp_path_factory.mktemp("kata"), simulate=False)
    yield Wire(clinic.port, clinic.cookie)
    clinic.close()


def test_valid_request_is_distinguished_from_all_malformed_ones(wire: Wire) -> None:
    own = [f"Host: {wire.own}", f"Origin: http://{wire.own}"]
    assert wire.status("GET", "/api/patients", own, signed_in=True) == 200
    assert wire.status("GET", "/api/patients", own, signed_in=False) == 401
    assert wire.upgrade(own, signed_in=True) == 101
    assert wire.upgrade(own, signed_in=False) == 403


def test_malformed_headers_grant_no_access(wire: Wire) -> None:
    _try(wire, _FEW)


@pytest.mark.campaign
@pytest.mark.timeout(600)
def test_thousand_malformed_headers_grant_no_access(wire: Wire) -> None:
    _try(wire, _MANY)


def _try(wire: Wire, cases: int) -> None:
    """Send so many malformed requests, of each kind as many, and check that none grants access."""
    chance = random.Random(7)
    own = [f"Host: {wire.own}"]
    wrong = list(wrong_hosts(wire.own))
    chance.shuffle(wrong)
    start_login_session, upgraded, differing = [], [], []
    for turn, bad in enumerate(islice(cycle(wrong), cases)):
        kind = turn % 4
        if kind == 0:
            headers = [f"Host: {bad}", f"Origin: http://{wire.own}"]
        elif kind == 1:
            headers = [*own, f"Origin: {bad if turn % 8 == 1 else f'http://{bad}'}"]
        elif kind == 2:
            headers = [
                [*own, f"Host: {bad}"],
                [f"Host: {bad}", *own],
                [f" Host: {wire.own}"],
                [f"Host : {wire.own}"],
                [],
            ][turn // 4 % 5]
        else:
            # A correct address with the headers of an unknown proxy: the service ignores these headers.
            headers = [*own, *forwarded(chance.choice(_PLACES), turn // 4)]
            read = [wire.status("GET", "/api/patients", headers, signed_in=who) for who in (True, False)]
            sockets = [wire.upgrade([*headers, f"Origin: http://{wire.own}"], signed_in=who) for who in (True, False)]
            if read not in ([200, 401], [400, 400], [0, 0]) or sockets[1] == 101:
                differing.append((headers, read, sockets))
            continue
        change = wire.status("POST", "/api/station/stop", headers, signed_in=True)
        nobody = wire.status("GET", "/api/patients", headers, signed_in=False)
        if change < 400 and change != 0:
            start_login_session.append((headers, change))
        if nobody < 400 and nobody != 0:
            start_login_session.append((headers, nobody))
        if 101 in (wire.upgrade(headers, signed_in=True), wire.upgrade(headers, signed_in=False)):
            upgraded.append(headers)
    assert (start_login_session, upgraded, differing) == ([], [], [])
