"""Clients that open many connections, send endless headers or never finish a request are cut off, before any login."""

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import partial
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest
import uvicorn
import websockets
from hypothesis import given, settings
from hypothesis import strategies as st

from kata.api import connection_limits
from kata.api.connection_limits import LimitedListener, LimitedProtocol, OpenConnections
from kata.api.message_limits import BYTES_AT_ONCE, LimitedWebSocket

PER_ADDRESS = 5
RECEIVED: list[dict[str, Any]] = []
"""Messages that the application received by WebSockets."""
SLOW: list[asyncio.Event] = []
"""One event for each request of ``/slow``, which is answered when it is set."""
Client = tuple[asyncio.StreamReader, asyncio.StreamWriter]
Connect = Callable[[], Awaitable[Client]]


@pytest.fixture(autouse=True)
def hasty_clients_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_limits, "NEW_AT_ONCE", 1000)


async def echo(scope: Any, receive: Any, send: Any) -> None:
    """Answer a request with the length of its body, and a WebSocket's messages with themselves."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.accept"})
        while (message := await receive())["type"] == "websocket.receive":
            RECEIVED.append(message)
            if scope["path"] != "/silent":
                await send({"type": "websocket.send", "text": message["text"]})
        RECEIVED.append(message)
        return
    if scope["path"] == "/slow":
        SLOW.append(asyncio.Event())
        await SLOW[-1].wait()
    if scope["path"] == "/refused":
        await send({"type": "http.response.start", "status": 413, "headers": [(b"content-length", b"0")]})
        await send({"type": "http.response.body", "body": b""})
        return
    taken, more = 0, True
    while more:
        message = await receive()
        taken += len(message.get("body", b""))
        more = message.get("more_body", False)
    body = str(taken).encode()
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"%d" % len(body))]})
    await send({"type": "http.response.body", "body": body})


@asynccontextmanager
async def serving(trusted_proxies: str, on_unlisted_proxy: Callable[[str], None]) -> AsyncIterator[int]:
    open_connections = OpenConnections(PER_ADDRESS, trusted_proxies, on_unlisted_proxy)
    protocol: Any = partial(LimitedProtocol, open_connections)
    server = uvicorn.Server(uvicorn.Config(echo, http=protocol, ws=LimitedWebSocket, lifespan="off", log_level="error"))
    with LimitedListener(socket.create_server(("127.0.0.1", 0)), open_connections) as listening:
        running = asyncio.create_task(server.serve([listening]))
        yield listening.getsockname()[1]
        server.should_exit = True
        await running


def run(
    test: Callable[[int, Connect], Awaitable[None]],
    trusted_proxies: str = "",
    on_unlisted_proxy: Callable[[str], None] = lambda address: None,
) -> None:
    async def whole() -> None:
        opened: list[Client] = []
        async with serving(trusted_proxies, on_unlisted_proxy) as port:

            async def connect() -> Client:
                opened.append(await asyncio.open_connection("127.0.0.1", port))
                return opened[-1]

            await test(port, connect)
            for _, writer in opened:
                writer.close()

    asyncio.run(whole())


async def ask(client: Client, size: int = 0) -> bytes:
    reader, writer = client
    writer.write(request_of("/", size))
    head = await reader.readuntil(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 200")
    return await reader.read(int(head.lower().split(b"content-length: ")[1].split()[0]))


def request_of(path: str, size: int) -> bytes:
    return b"POST %s HTTP/1.1\r\nhost: kata\r\ncontent-length: %d\r\n\r\n" % (path.encode(), size) + b"z" * size


async def is_closed(client: Client) -> bool:
    """Wait until the server closes the connection."""
    try:
        return await client[0].read() == b""
    except ConnectionResetError:
        return True


async def until_taken() -> None:
    """Let the server read the written data; it shares this event loop."""
    for _ in range(20):
        await asyncio.sleep(0)


def test_connections_of_an_address_are_limited_until_one_ends() -> None:
    async def test(_: int, connect: Connect) -> None:
        clients = [await connect() for _ in range(PER_ADDRESS)]
        assert [await ask(client) for client in clients] == [b"0"] * PER_ADDRESS
        assert await is_closed(await connect())
        clients[0][1].close()
        await clients[0][1].wait_closed()
        while True:
            again = await connect()
            try:
                assert await ask(again) == b"0"
            except (ConnectionError, asyncio.IncompleteReadError):
                await asyncio.sleep(0.01)
                continue
            return

    run(test)


@pytest.mark.parametrize("trusted_proxies", ["", "127.0.0.1"])
def test_requests_whose_client_has_gone_count_until_they_end(
    monkeypatch: pytest.MonkeyPatch, trusted_proxies: str
) -> None:
    """A client that does not wait for its answers could otherwise have any number of requests in progress."""
    monkeypatch.setattr(connection_limits, "MAX_CONNECTIONS", PER_ADDRESS)
    SLOW.clear()

    async def test(_: int, connect: Connect) -> None:
        for number in range(1, PER_ADDRESS + 1):
            writer = (await connect())[1]
            writer.write(request_of("/slow", 0))
            await until_taken()
            assert len(SLOW) == number
            writer.close()
            await writer.wait_closed()
        await until_taken()
        assert await is_closed(await connect())
        for request in SLOW:
            request.set()
        await until_taken()
        assert await ask(await connect()) == b"0"

    run(test, trusted_proxies)


def test_abandoned_requests_of_an_address_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """Connections of an address are refused while several requests are in progress whose connections it has closed."""
    monkeypatch.setattr(connection_limits, "MAX_ABANDONED", 2)
    SLOW.clear()

    async def test(_: int, connect: Connect) -> None:
        waiting = await connect()
        waiting[1].write(request_of("/slow", 0))
        for _ in range(2):
            writer = (await connect())[1]
            writer.write(request_of("/slow", 0))
            await until_taken()
            writer.close()
            await writer.wait_closed()
        await until_taken()
        assert await is_closed(await connect())
        SLOW[1].set()
        await until_taken()
        assert await ask(await connect()) == b"0"
        for request in SLOW:
            request.set()
        assert await waiting[0].readuntil(b"\r\n\r\n")

    run(test)


@pytest.mark.parametrize(("trusted_proxies", "answered"), [("", 2 * PER_ADDRESS), ("127.0.0.1", 4 * PER_ADDRESS)])
def test_new_connections_of_an_address_are_limited(
    monkeypatch: pytest.MonkeyPatch, trusted_proxies: str, answered: int
) -> None:
    monkeypatch.setattr(connection_limits, "NEW_AT_ONCE", 2)
    now_s = [0.0]
    monkeypatch.setattr("kata.api.token_bucket.time", SimpleNamespace(monotonic=lambda: now_s[0]))

    async def test(_: int, connect: Connect) -> None:
        assert [await answers(connect) for _ in range(4 * PER_ADDRESS)].count(True) == answered
        now_s[0] += 1.0
        assert await answers(connect)

    async def answers(connect: Connect) -> bool:
        client = await connect()
        try:
            assert await ask(client) == b"0"
        except (ConnectionError, asyncio.IncompleteReadError):
            return False
        client[1].close()
        await client[1].wait_closed()
        await until_taken()
        return True

    run(test, trusted_proxies)


def test_trusted_proxy_has_no_limit_of_its_own() -> None:
    async def test(_: int, connect: Connect) -> None:
        for _ in range(3 * PER_ADDRESS):
            assert await ask(await connect()) == b"0"

    run(test, trusted_proxies="192.0.2.1, 127.0.0.0/8")


@pytest.mark.parametrize(
    ("header", "trusted", "noticed"),
    [
        (b"X-Forwarded-For: 192.0.2.7", "", ["127.0.0.1"]),
        (b"Forwarded: for=192.0.2.7", "192.0.2.1", ["127.0.0.1"]),
        (b"X-Forwarded-For: 192.0.2.7", "192.0.2.1, 127.0.0.1", []),
        (b"Accept: text/html", "", []),
    ],
)
def test_unlisted_proxy_is_noticed_once(header: bytes, trusted: str, noticed: list[str]) -> None:
    found: list[str] = []

    async def test(_: int, connect: Connect) -> None:
        for _ in range(2):
            reader, writer = await connect()
            writer.write(b"GET / HTTP/1.1\r\nhost: kata\r\n" + header + b"\r\n\r\n")
            assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 200")

    run(test, trusted, found.append)
    assert found == noticed


def test_all_connections_together_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_limits, "MAX_CONNECTIONS", 3)

    async def test(_: int, connect: Connect) -> None:
        for _ in range(3):
            assert await ask(await connect()) == b"0"
        assert await is_closed(await connect())

    run(test, trusted_proxies="127.0.0.1")


def test_endless_headers_are_refused() -> None:
    async def test(_: int, connect: Connect) -> None:
        reader, writer = await connect()
        writer.write(b"GET / HTTP/1.1\r\n")
        sent = 0
        while not reader.at_eof() and sent < 100 * connection_limits.MAX_HEADER_BYTES:
            writer.write(b"x: " + b"y" * 1000 + b"\r\n")
            sent += 1005
            try:
                await writer.drain()
            except ConnectionError:
                break
            await asyncio.sleep(0)
        assert sent < 20 * connection_limits.MAX_HEADER_BYTES

    run(test)


def test_long_headers_and_a_long_body_pass() -> None:
    async def test(_: int, connect: Connect) -> None:
        reader, writer = await connect()
        for size in (40_000, 40_000):
            writer.write(b"GET / HTTP/1.1\r\nhost: kata\r\nx: ")
            await writer.drain()
            writer.write(b"y" * size + b"\r\n\r\n")
            assert (await reader.readuntil(b"\r\n\r\n0")).startswith(b"HTTP/1.1 200")
        assert await ask((reader, writer), 5_000_000) == b"5000000"

    run(test)


@pytest.mark.parametrize(
    ("sent", "answer"),
    [
        (b"", b"HTTP/1.1 408"),
        (b"GET / HTTP/1.1\r\nhost: ka", b"HTTP/1.1 408"),
        (b"\r\n\r\n\r\n", b"HTTP/1.1 408"),
        (b"POST / HTTP/1.1\r\nhost: kata\r\ncontent-length: 10\r\n\r\n12345", b""),
    ],
)
def test_request_that_does_not_end_is_cut_off(monkeypatch: pytest.MonkeyPatch, sent: bytes, answer: bytes) -> None:
    monkeypatch.setattr(connection_limits, "HEADERS_WITHIN_S", 0.2)
    monkeypatch.setattr(connection_limits, "BODY_WITHIN_S", 0.2)

    async def test(_: int, connect: Connect) -> None:
        reader, writer = await connect()
        writer.write(sent)
        assert (await reader.read())[:12] == answer

    run(test)


def test_empty_lines_after_an_answer_keep_no_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_limits, "HEADERS_WITHIN_S", 0.2)

    async def test(_: int, connect: Connect) -> None:
        client = await connect()
        assert await ask(client) == b"0"
        client[1].write(b"\r\n")
        assert (await client[0].read())[:12] == b"HTTP/1.1 408"

    run(test)


def test_refused_body_is_not_read_to_its_end() -> None:
    async def test(_: int, connect: Connect) -> None:
        reader, writer = await connect()
        writer.write(b"POST /refused HTTP/1.1\r\nhost: kata\r\ncontent-length: 1000000000\r\n\r\n")
        answer = asyncio.create_task(reader.read(12))
        sent = 0
        while sent < 200_000_000:
            writer.write(b"z" * 100_000)
            sent += 100_000
            try:
                await writer.drain()
            except ConnectionError:
                break
        assert sent < 50_000_000
        assert await answer == b"HTTP/1.1 413"

    run(test)


def test_websocket_outlives_every_time_limit_and_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_limits, "HEADERS_WITHIN_S", 0.1)
    monkeypatch.setattr(connection_limits, "BODY_WITHIN_S", 0.1)

    async def test(port: int, connect: Connect) -> None:
        sockets = [await websockets.connect(f"ws://127.0.0.1:{port}/") for _ in range(PER_ADDRESS)]
        await asyncio.sleep(0.3)
        for page in sockets:
            await page.send("stop")
            assert await page.recv() == "stop"
        assert await is_closed(await connect())
        for page in sockets:
            await page.close()
        assert await ask(await connect()) == b"0"

    run(test)


@pytest.mark.parametrize("size", [1, BYTES_AT_ONCE // 2])
def test_websocket_reads_no_more_than_allowed(size: int) -> None:
    """The first messages of a flood arrive, because one may be a Stop; the rest is not even parsed."""
    RECEIVED.clear()

    async def test(port: int, connect: Connect) -> None:
        page = await websockets.connect(f"ws://127.0.0.1:{port}/silent", compression=None)
        page.transport.writelines([masked(b"x" * size) for _ in range(100_000 // size)])
        await page.wait_closed()
        await until_taken()

    run(test)
    *messages, end = RECEIVED
    assert 0 < len(messages) <= BYTES_AT_ONCE // len(masked(b"x" * size))
    assert end == {"type": "websocket.disconnect", "code": 1008, "flooded": True}


def masked(text: bytes) -> bytes:
    """Return a WebSocket frame from a client, with the mask 0."""
    length = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + len(text).to_bytes(2, "big")
    return b"\x81" + length + bytes(4) + text


def test_small_body_after_its_refusal_keeps_the_connection() -> None:
    async def test(_: int, connect: Connect) -> None:
        client = await connect()
        client[1].write(b"POST /refused HTTP/1.1\r\nhost: kata\r\ncontent-length: 10\r\n\r\n")
        assert (await client[0].readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 413")
        for half in (b"12345", b"67890"):
            client[1].write(half)
            await until_taken()
        assert await ask(client, 4) == b"4"

    run(test)


REQUESTS = st.lists(st.tuples(st.sampled_from(["/", "/refused"]), st.integers(0, 30)), min_size=1, max_size=5)
CUTS = st.lists(st.integers(0, 400), max_size=12)


@settings(max_examples=10, deadline=None)
@given(conversations=st.lists(st.tuples(REQUESTS, CUTS), min_size=1, max_size=PER_ADDRESS))
def test_requests_cut_anywhere_get_the_same_answers(
    conversations: list[tuple[list[tuple[str, int]], list[int]]],
) -> None:
    """How the network divides requests changes nothing: a body may come long after its request has been answered."""

    async def test(_: int, connect: Connect) -> None:
        for requests, cuts in conversations:
            reader, writer = await connect()
            sent = b"".join(request_of(path, size) for path, size in requests)
            edges = sorted({0, len(sent), *(cut for cut in cuts if cut < len(sent))})
            for start, end in pairwise(edges):
                writer.write(sent[start:end])
                await until_taken()
            for path, size in requests:
                head = await reader.readuntil(b"\r\n\r\n")
                assert head.startswith(b"HTTP/1.1 413" if path == "/refused" else b"HTTP/1.1 200"), head
                if path == "/":
                    assert await reader.readexactly(len(str(size))) == str(size).encode()

    run(test)
