"""A Stop by HTTP or by WebSocket has one permission and one audit entry, and a flood of messages does not delay other users."""

import asyncio
import json
from types import SimpleNamespace
from typing import Any, cast
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from kata.actor import Actor
from kata.api.message_limits import MESSAGES_AT_ONCE, MESSAGES_PER_S, OFFENCES, REFUSED_S, Offences
from kata.api.sockets import received
from kata.api.stopping import StopQueue
from kata.api.token_bucket import TokenBucket
from kata.device.ipc_messages import Refusal
from tests.support.audit_rows import audit_log


def next_of(socket: Any, kind: str) -> dict[str, Any]:
    """Return the next message of a kind."""
    while True:
        message: dict[str, Any] = socket.receive_json()
        if message["kind"] == kind:
            return message


def stop_rows(client: TestClient) -> list[tuple[str, ...]]:
    rows = audit_log(client, action="stop")
    return [tuple(row[name] for name in ("who", "role", "outcome", "station", "address")) for row in rows]


def test_stop_over_the_websocket_is_recorded_like_one_by_http(client: TestClient) -> None:
    before = len(stop_rows(client))
    client.post("/api/station/stop").raise_for_status()
    with client.websocket_connect("/api/live") as socket:
        socket.send_text('{"kind": "stop", "number": 7}')
        assert next_of(socket, "stop_answer")["number"] == 7
    by_websocket, by_http = stop_rows(client)[: len(stop_rows(client)) - before]
    assert by_websocket == by_http
    assert by_http[:3] == ("Test administrator", "administrator", "done")


def test_flooding_websocket_is_closed_and_then_refused(client: TestClient) -> None:
    for _ in range(OFFENCES):
        with client.websocket_connect("/api/live") as socket:
            for _ in range(2 * MESSAGES_AT_ONCE):
                socket.send_text("junk")
            with pytest.raises(WebSocketDisconnect) as closed:
                next_of(socket, "never")
            assert (closed.value.code, closed.value.reason) == (1008, "too many messages")
    for path in ("/api/live", "/api/stations/live"):
        with pytest.raises(WebSocketDisconnect) as refused, client.websocket_connect(path):
            pass
        assert refused.value.reason == "too many messages"
    client.post("/api/station/stop").raise_for_status()
    services: Any = cast(Any, client.app).state.services
    services.offences._at_s.clear()


def test_user_whose_flood_was_cut_off_has_offended(client: TestClient) -> None:
    """The protocol cuts off a flood of bytes. The messages before are received, and the offence is recorded."""
    messages: list[dict[str, Any]] = [
        {"type": "websocket.receive", "text": "stop"},
        {"type": "websocket.disconnect", "code": 1008, "flooded": True},
    ]

    async def receive() -> dict[str, Any]:
        return messages.pop(0)

    async def texts() -> list[str]:
        return [text async for text in received(socket, flooding)]

    socket: Any = SimpleNamespace(app=client.app, client=SimpleNamespace(host="192.0.2.7"), receive=receive)

    flooding = Actor(uuid4(), uuid4(), "Sato", "therapist", frozenset())
    offences: Offences = cast(Any, client.app).state.services.offences
    rows = len(audit_log(client, action="live"))
    assert asyncio.run(texts()) == ["stop"]
    assert list(offences._at_s) == [(flooding.account_id, "192.0.2.7")]
    assert len(audit_log(client, action="live")) == rows + 1
    offences._at_s.clear()


def test_stops_of_a_flood_share_answers_and_none_is_lost() -> None:
    sent: list[asyncio.Event] = []
    answers: list[int] = []

    async def whole() -> None:
        async def stop() -> Refusal | None:
            sent.append(asyncio.Event())
            await sent[-1].wait()
            return None

        queue = StopQueue(stop, lambda number, refusal: answers.append(number))
        queue.put(1)
        await asyncio.sleep(0)
        for number in range(2, 30):
            queue.put(number)
        await asyncio.sleep(0)
        assert len(sent) == 1
        assert queue._running is not None
        sent[0].set()
        await asyncio.sleep(0)
        # Stops that arrived during the first one get another Stop, because a command may have come in between.
        assert (answers, len(sent)) == ([1], 2)
        sent[1].set()
        await queue._running

    asyncio.run(whole())
    assert answers == list(range(1, 30))
    assert len(sent) == 2


def test_allowance_refills_with_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = [100.0]
    monkeypatch.setattr("kata.api.token_bucket.time.monotonic", lambda: now_s[0])
    bucket = TokenBucket(MESSAGES_PER_S, MESSAGES_AT_ONCE)
    assert [bucket.take() for _ in range(MESSAGES_AT_ONCE + 1)] == [True] * MESSAGES_AT_ONCE + [False]
    now_s[0] += 1.5 / MESSAGES_PER_S
    assert [bucket.take(), bucket.take(), bucket.take_some(3)] == [True, False, 0]
    now_s[0] += 60
    assert bucket.is_full
    assert bucket.take_some(2 * MESSAGES_AT_ONCE) == MESSAGES_AT_ONCE
    assert not bucket.is_full


def test_offenders_are_refused_for_a_while_at_their_address() -> None:
    now_s = [100.0]
    offences = Offences(clock=lambda: now_s[0])
    flooding, elsewhere = (uuid4(), "192.0.2.1"), (uuid4(), "192.0.2.2")
    for _ in range(OFFENCES):
        assert not offences.is_refused(flooding)
        offences.add(flooding)
    assert offences.is_refused(flooding)
    assert not offences.is_refused(elsewhere)
    assert not offences.is_refused((flooding[0], elsewhere[1]))
    now_s[0] += REFUSED_S + 1
    assert not offences.is_refused(flooding)
    assert not offences._at_s


def test_message_that_is_no_stop_is_ignored(client: TestClient) -> None:
    rows = len(stop_rows(client))
    with client.websocket_connect("/api/live") as socket:
        for junk in ("", "{", "null", json.dumps({"kind": "stop"}), json.dumps({"kind": "play", "number": 1})):
            socket.send_text(junk)
        socket.send_text(json.dumps({"kind": "stop", "number": 8}))
        assert next_of(socket, "stop_answer")["number"] == 8
    assert len(stop_rows(client)) == rows + 1
