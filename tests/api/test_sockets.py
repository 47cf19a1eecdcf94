"""The end of a WebSocket, whichever side ends it."""

import asyncio
import logging
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any
from uuid import uuid4

import pytest
from starlette.websockets import WebSocketState

from kata.actor import Actor
from kata.api.sockets import serve_until_gone

SATO = Actor(uuid4(), uuid4(), "Sato", "therapist", frozenset())


class Socket:
    """A WebSocket whose other end may have gone."""

    def __init__(self, *, login_session_ends: bool = False) -> None:
        async def ended(_: object) -> None:
            if not login_session_ends:
                await asyncio.Event().wait()

        self.client_state = self.application_state = WebSocketState.CONNECTED
        self.closed: list[str] = []
        services = SimpleNamespace(
            auth=SimpleNamespace(revocations=SimpleNamespace(until_ended=ended)),
            metrics=SimpleNamespace(listeners=SimpleNamespace(track_inprogress=nullcontext)),
        )
        self.app = SimpleNamespace(state=SimpleNamespace(services=services))

    async def close(self, code: int, reason: str) -> None:
        self.closed.append(reason)


def end(socket: Any, *, receiving: Any, sending: Any) -> None:
    asyncio.run(serve_until_gone(socket, SATO, receiving, sending))


async def forever() -> None:
    await asyncio.Event().wait()


def test_message_to_a_page_that_has_gone_is_no_error(caplog: pytest.LogCaptureFixture) -> None:
    socket = Socket()

    async def receive() -> None:
        socket.client_state = WebSocketState.DISCONNECTED

    async def send() -> None:
        await asyncio.sleep(0)
        raise RuntimeError('Cannot call "send" once a close message has been sent.')

    with caplog.at_level(logging.INFO):
        end(socket, receiving=receive(), sending=send())
    assert (caplog.records, socket.closed) == ([], [])


def test_error_of_an_open_websocket_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    async def send() -> None:
        raise RuntimeError("a mistake of the program")

    end(Socket(), receiving=forever(), sending=send())
    (record,) = caplog.records
    assert record.exc_info and "a mistake of the program" in str(record.exc_info[1])


def test_websocket_is_closed_at_the_end_of_the_login_session() -> None:
    socket = Socket(login_session_ends=True)
    end(socket, receiving=forever(), sending=forever())
    assert socket.closed == ["signed out"]


def test_websocket_that_has_gone_is_not_closed_again() -> None:
    socket = Socket(login_session_ends=True)
    socket.client_state = WebSocketState.DISCONNECTED
    end(socket, receiving=forever(), sending=forever())
    assert socket.closed == []
