"""Limits on the number of connections, the length of a request's headers, and the time in which a request must arrive.

They apply before any login, in uvicorn's protocol, because the application sees a request only when its headers are complete.
"""

import asyncio
import socket
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from ipaddress import ip_address, ip_network
from typing import Any, Final

from starlette.types import Receive, Scope, Send
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from kata.api.token_bucket import TokenBucket

MAX_CONNECTIONS: Final = 1000
"""Maximum number of open connections of the service. Further connections are closed at once; existing ones, such as the pages' WebSockets,
are not affected.
"""
NEW_AT_ONCE: Final = 2
"""An address may open this multiple of its connection limit at once, and its connection limit again each second."""
MAX_ABANDONED: Final = 8
"""Maximum number of requests of one address that are still being answered although the client has closed its connection. At this number,
further connections of the address are closed. Closing a page abandons a few requests.
"""
MAX_HEADER_BYTES: Final = 64 * 1024
"""Maximum number of bytes of request line and headers."""
HEADERS_WITHIN_S: Final = 10.0
"""Longest time until the headers are complete, from the connection or from the first byte of the next request."""
BODY_WITHIN_S: Final = 120.0
"""Longest time from the headers until the body is complete: 64 MiB at 0.6 MB/s."""
MAX_UNREAD_BYTES: Final = 64 * 1024
"""Maximum number of bytes of a body that arrives after its request has been answered. A smaller body is dropped, and the connection can be
used again.
"""
ANSWER_READ_WITHIN_S: Final = 1.0
"""Time from the first byte beyond ``MAX_UNREAD_BYTES`` (for example of a refused file) until the connection is closed."""
REFUSED_AT_ONCE: Final = 32
"""Maximum number of connections closed in one step of the event loop. Closing one takes up to 0.1 ms, because the client's unread request
must be discarded.
"""
_OF_PROXIES: Final = frozenset({b"x-forwarded-for", b"forwarded"})
_TOO_LARGE: Final = b"HTTP/1.1 431 Request Header Fields Too Large\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"
_TOO_SLOW: Final = b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"


@dataclass
class OpenConnections:
    """Counts the open connections of each client address, and the closed connections whose request is still being answered.

    Without the second count, a client that does not wait for its answers could have any number of requests in progress.
    """

    per_address: int
    """Maximum number of connections of one address."""
    trusted_proxies: str = ""
    """Addresses and networks without a limit of their own, separated by commas, because all clients behind a proxy share its address."""
    on_unlisted_proxy: Callable[[str], None] = lambda address: None
    """Called once with the address of a proxy that is not in ``trusted_proxies``."""
    _of: dict[str, set[asyncio.BaseTransport]] = field(default_factory=lambda: defaultdict(set))
    _answering: set[asyncio.BaseTransport] = field(default_factory=set)
    _abandoned: dict[str, set[asyncio.BaseTransport]] = field(default_factory=lambda: defaultdict(set))
    _new: dict[str, TokenBucket] = field(default_factory=dict)
    _unlisted_seen: bool = False

    def may_open(self, address: str) -> bool:
        """Return whether an address may open a connection now, and count it.

        Limits the rate, too: a client that opens connections as fast as possible takes the service's time even if few are open.
        """
        if not self.has_room(address):
            return False
        if is_listed(address, self.trusted_proxies):
            return True
        if address not in self._new:
            self._new = {other: new for other, new in self._new.items() if not new.is_full}
            self._new[address] = TokenBucket(self.per_address, NEW_AT_ONCE * self.per_address)
        return self._new[address].take()

    def has_room(self, address: str) -> bool:
        """Return whether another connection of an address may be opened."""
        if len(self._of[address]) >= self.per_address:
            # A WebSocket takes over its connection, and the end of that connection is not reported here.
            self._of[address] = self._occupied(self._of[address])
        too_many = len(self._of[address]) >= self.per_address or len(self._abandoned.get(address, ())) >= MAX_ABANDONED
        if too_many and not is_listed(address, self.trusted_proxies):
            return False
        return sum(map(len, self._of.values())) < MAX_CONNECTIONS or self.count() < MAX_CONNECTIONS

    def admit(self, address: str, transport: asyncio.BaseTransport) -> bool:
        """Count a new connection. Return False if it must be closed."""
        if not self.has_room(address):
            return False
        self._of[address].add(transport)
        return True

    def lost(self, address: str, transport: asyncio.BaseTransport, *, answered: bool = True) -> None:
        """Forget a connection that has ended, unless its request is still being answered. ``answered``: the client has its answer."""
        if transport in self._answering:
            if not answered:
                self._abandoned[address].add(transport)
            return
        self._of[address].discard(transport)
        if not self._of[address]:
            del self._of[address]

    def request_began(self, transport: asyncio.BaseTransport) -> None:
        """Keep a connection counted until its request has been answered, even if the client closes it."""
        self._answering.add(transport)

    def request_ended(self, address: str, transport: asyncio.BaseTransport) -> None:
        """Count a connection only while it is open."""
        self._answering.discard(transport)
        if transport in self._abandoned.get(address, ()):
            self._abandoned[address].remove(transport)
            if not self._abandoned[address]:
                del self._abandoned[address]
        if transport.is_closing():
            self.lost(address, transport)

    def count(self) -> int:
        """Return the number of counted connections."""
        occupied = {address: alive for address, counted in self._of.items() if (alive := self._occupied(counted))}
        self._of = defaultdict(set, occupied)
        return sum(map(len, self._of.values()))

    def note_headers(self, address: str, headers: list[tuple[bytes, bytes]]) -> None:
        """If an address that is not listed sends a proxy's headers, call ``on_unlisted_proxy`` once. All clients of that proxy share one
        address.
        """
        if not self._unlisted_seen and any(name in _OF_PROXIES for name, _ in headers):
            self._unlisted_seen = not is_listed(address, self.trusted_proxies)
            if self._unlisted_seen:
                self.on_unlisted_proxy(address)

    def _occupied(self, transports: set[asyncio.BaseTransport]) -> set[asyncio.BaseTransport]:
        return {transport for transport in transports if not transport.is_closing() or transport in self._answering}


def is_listed(address: str, trusted_proxies: str) -> bool:
    """Return whether ``KATA_TRUSTED_PROXIES`` contains an address."""
    proxies = [name.strip() for name in trusted_proxies.split(",") if name.strip()]
    return any(ip_address(address) in ip_network(proxy) for proxy in proxies)


class LimitedProtocol(HttpToolsProtocol):
    """uvicorn's protocol with the limits of this module."""

    def __init__(self, open_connections: OpenConnections, *args: Any, **options: Any) -> None:
        """``open_connections``: shared by all connections of the service. The other arguments are uvicorn's."""
        super().__init__(*args, **options)
        self.app = self._answer
        self._open_connections = open_connections
        self._address = ""
        self._in_headers = True
        self._header_bytes = 0
        self._unread_bytes = 0
        self._timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Close the connection if there are too many."""
        super().connection_made(transport)
        self._address = self.client[0] if self.client else ""
        if not self._open_connections.admit(self._address, transport):
            transport.abort()
            return
        self._limit_time(HEADERS_WITHIN_S)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop counting the connection."""
        self._stop_timer()
        self._open_connections.lost(self._address, self.transport, answered=self._is_answered)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Feed the parser. Answer 431 when the headers become too long."""
        in_headers = self._in_headers
        super().data_received(data)
        if self.transport.get_protocol() is not self:
            self._stop_timer()  # a WebSocket has taken over
        elif self._timer is None and self.timeout_keep_alive_task is None and self._is_answered:
            self._limit_time(HEADERS_WITHIN_S)  # an empty line ends uvicorn's own timer for the next request
        if in_headers and self._in_headers:
            # The headers began in an earlier piece and end in a later one.
            self._header_bytes += len(data)
            if self._header_bytes > MAX_HEADER_BYTES:
                self._refuse(_TOO_LARGE)

    def on_message_begin(self) -> None:
        """Limit the headers of a new request."""
        super().on_message_begin()
        self._in_headers = True
        self._header_bytes = 0
        self._unread_bytes = 0
        self._limit_time(HEADERS_WITHIN_S)

    def on_headers_complete(self) -> None:
        """Limit the body of the request."""
        self._in_headers = False
        self._open_connections.note_headers(self._address, self.headers)
        self._limit_time(BODY_WITHIN_S)
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Stop reading a long body whose request has been answered. Close the connection later, so that the client can read the answer."""
        if self.cycle.response_complete:
            self._unread_bytes += len(body)
            if self._unread_bytes > MAX_UNREAD_BYTES and self.transport.is_reading():
                self.transport.pause_reading()
                self.loop.call_later(ANSWER_READ_WITHIN_S, self.transport.close)
        super().on_body(body)

    def on_message_complete(self) -> None:
        """Stop the timer, because the whole request has arrived."""
        self._stop_timer()
        super().on_message_complete()

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let the application answer a request of this connection."""
        self._open_connections.request_began(self.transport)
        try:
            await self.config.loaded_app(scope, receive, send)
        finally:
            self._open_connections.request_ended(self._address, self.transport)

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


class LimitedListener(socket.socket):
    """Listening socket that closes connections above the limits.

    During a flood of connections, a user's connection waits behind those that are refused. Closing a connection here takes a tenth of the
    time of creating a transport and a protocol for it.
    """

    def __init__(self, listening: socket.socket, open_connections: OpenConnections) -> None:
        """``listening``: its file descriptor is taken over; the object cannot be used afterwards."""
        super().__init__(listening.family, listening.type, listening.proto, listening.detach())
        self._open_connections = open_connections
        self._refused = 0
        """Connections refused in this step of the event loop, which accepts several connections a step."""

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection within the limits.

        :raises BlockingIOError: when no connection waits, or after ``REFUSED_AT_ONCE`` refused ones. The event loop then calls again in its
        next step.
        """
        try:
            while self._refused < REFUSED_AT_ONCE:
                connection, address = super().accept()
                if self._open_connections.may_open(address[0]):
                    return connection, address
                connection.close()
                self._refused += 1
            raise BlockingIOError
        except BlockingIOError:
            self._refused = 0
            raise
