"""Limits on connections: how many, how long the headers of a request may be, and how long a request may take to arrive.

They hold before any login, in uvicorn's protocol, because the application sees a request only when its headers are complete.
"""

import asyncio
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from ipaddress import ip_address, ip_network
from typing import Any, Final

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

MAX_CONNECTIONS: Final = 1000
"""Open connections of the service. More are closed at once; those that exist, such as the pages' WebSockets, are not affected."""
MAX_HEADER_BYTES: Final = 64 * 1024
"""Request line and headers."""
HEADERS_WITHIN_S: Final = 10.0
"""From the connection, or from the first byte of the next request, until the headers are complete."""
BODY_WITHIN_S: Final = 120.0
"""From the headers until the body is complete: 64 MiB at 0.6 MB/s."""
ANSWER_READ_WITHIN_S: Final = 1.0
"""From the answer to an unfinished request, such as a refused file, until the connection is closed."""
_OF_PROXIES: Final = frozenset({b"x-forwarded-for", b"forwarded"})
_TOO_LARGE: Final = b"HTTP/1.1 431 Request Header Fields Too Large\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"
_TOO_SLOW: Final = b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"


@dataclass
class OpenConnections:
    """The open connections by the address of their client."""

    per_address: int
    """Most connections of one address."""
    trusted_proxies: str = ""
    """Addresses and networks without a limit of their own, separated by commas: all clients behind a proxy share its address."""
    on_unlisted_proxy: Callable[[str], None] = lambda address: None
    """Called once with the address of a proxy that is not in ``trusted_proxies``."""
    _of: dict[str, set[asyncio.BaseTransport]] = field(default_factory=lambda: defaultdict(set))
    _unlisted_seen: bool = False

    def admit(self, address: str, transport: asyncio.BaseTransport) -> bool:
        """Count a new connection. Return False if it must be closed."""
        known = self._of[address]
        if len(known) >= self.per_address and not is_listed(address, self.trusted_proxies):
            return False
        known.add(transport)
        return True

    def lost(self, address: str, transport: asyncio.BaseTransport) -> None:
        """Forget a connection that has ended."""
        self._of[address].discard(transport)
        if not self._of[address]:
            del self._of[address]

    def count(self) -> int:
        """Return the number of open connections."""
        # A WebSocket takes over its connection, and its end is not reported here.
        self._of = defaultdict(set, {address: left for address, known in self._of.items() if (left := _open(known))})
        return sum(map(len, self._of.values()))

    def note_headers(self, address: str, headers: list[tuple[bytes, bytes]]) -> None:
        """Notice the headers of a proxy at an address that is not listed: all its clients then share one address."""
        if not self._unlisted_seen and any(name in _OF_PROXIES for name, _ in headers):
            self._unlisted_seen = not is_listed(address, self.trusted_proxies)
            if self._unlisted_seen:
                self.on_unlisted_proxy(address)


def is_listed(address: str, trusted_proxies: str) -> bool:
    """Return whether ``KATA_TRUSTED_PROXIES`` contains an address."""
    proxies = [name.strip() for name in trusted_proxies.split(",") if name.strip()]
    return any(ip_address(address) in ip_network(proxy) for proxy in proxies)


def _open(transports: set[asyncio.BaseTransport]) -> set[asyncio.BaseTransport]:
    return {transport for transport in transports if not transport.is_closing()}


class LimitedProtocol(HttpToolsProtocol):
    """uvicorn's protocol with the limits of this module."""

    def __init__(self, open_connections: OpenConnections, *args: Any, **options: Any) -> None:
        """``open_connections``: shared by all connections of the service; the rest is uvicorn's."""
        super().__init__(*args, **options)
        self._open_connections = open_connections
        self._address = ""
        self._in_headers = True
        self._header_bytes = 0
        self._timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Close the connection if there are too many."""
        super().connection_made(transport)
        self._address = self.client[0] if self.client else ""
        too_many = self._open_connections.count() >= MAX_CONNECTIONS
        if too_many or not self._open_connections.admit(self._address, transport):
            transport.abort()
            return
        self._limit_time(HEADERS_WITHIN_S)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._stop_timer()
        self._open_connections.lost(self._address, self.transport)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Feed the parser. Answer 431 when the headers become too long."""
        in_headers = self._in_headers
        super().data_received(data)
        if self.transport.get_protocol() is not self:
            self._stop_timer()  # a WebSocket has taken over
        elif self._timer is None and self.timeout_keep_alive_task is None and self._is_answered:
            self._limit_time(HEADERS_WITHIN_S)  # empty lines end uvicorn's wait for the next request
        if in_headers and self._in_headers:
            # The headers have begun in an earlier piece, and end in a later one.
            self._header_bytes += len(data)
            if self._header_bytes > MAX_HEADER_BYTES:
                self._refuse(_TOO_LARGE)

    def on_message_begin(self) -> None:
        """Begin with the headers of a request."""
        super().on_message_begin()
        self._in_headers = True
        self._header_bytes = 0
        self._limit_time(HEADERS_WITHIN_S)

    def on_headers_complete(self) -> None:
        """Begin with the body of a request."""
        self._in_headers = False
        self._open_connections.note_headers(self._address, self.headers)
        self._limit_time(BODY_WITHIN_S)
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Stop reading a body whose request has been answered, and close soon: the client may still read the answer."""
        if self.cycle.response_complete:
            self.transport.pause_reading()
            self._stop_timer()
            self._timer = self.loop.call_later(ANSWER_READ_WITHIN_S, self.transport.close)
        super().on_body(body)

    def on_message_complete(self) -> None:
        """The whole request has arrived."""
        self._stop_timer()
        super().on_message_complete()

    @property
    def _is_answered(self) -> bool:
        """True if no request waits for its answer."""
        cycle: RequestResponseCycle | None = self.cycle
        return cycle is None or cycle.response_complete

    def _limit_time(self, seconds: float) -> None:
        self._stop_timer()
        self._timer = self.loop.call_later(seconds, self._refuse, _TOO_SLOW)

    def _stop_timer(self) -> None:
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def _refuse(self, answer: bytes) -> None:
        self._stop_timer()
        if self._is_answered:
            self.transport.write(answer)
        self.transport.close()


def limited_protocol(
    per_address: int, trusted_proxies: str, on_unlisted_proxy: Callable[[str], None] = lambda address: None
) -> Callable[..., asyncio.Protocol]:
    """Return the ``http`` class of a uvicorn configuration: its connections share one count."""
    return partial(LimitedProtocol, OpenConnections(per_address, trusted_proxies, on_unlisted_proxy))
