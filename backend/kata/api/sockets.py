"""Serve a WebSocket until the page disconnects, its login session ends, or it sends too many messages."""

import asyncio
import logging
from collections.abc import AsyncIterator, Coroutine

from fastapi import WebSocket
from starlette.websockets import WebSocketState

from kata.actor import Actor
from kata.api.message_limits import MESSAGES_AT_ONCE, MESSAGES_PER_S, TOO_MANY
from kata.api.services import services_of
from kata.api.token_bucket import TokenBucket
from kata.audit.entries import entry
from kata.auth.login import address_of

log = logging.getLogger(__name__)


async def received(socket: WebSocket, actor: Actor) -> AsyncIterator[str]:
    """Yield the text of every message until the page disconnects. Close the WebSocket when there are too many messages."""
    bucket = TokenBucket(MESSAGES_PER_S, MESSAGES_AT_ONCE)
    while (message := await socket.receive())["type"] != "websocket.disconnect":
        if not bucket.take():
            await _note_offence(socket, actor)
            await socket.close(1008, TOO_MANY)
            return
        yield message.get("text") or ""
    if message.get("flooded"):
        # LimitedWebSocket has closed it.
        await _note_offence(socket, actor)


async def _note_offence(socket: WebSocket, actor: Actor) -> None:
    services = services_of(socket)
    offender = actor.account_id, address_of(socket)
    services.offences.add(offender)
    log.warning("a WebSocket of %s sent too many messages and was closed", offender[1])
    await services.audit_log.record(entry("live", "refused", detail={"why": "too_many_messages"}))


async def accepted(socket: WebSocket, actor: Actor) -> bool:
    """Accept a WebSocket. Close it and return False if its user has repeatedly sent too many messages."""
    if services_of(socket).offences.is_refused((actor.account_id, address_of(socket))):
        await socket.close(1008, TOO_MANY)
        return False
    await socket.accept()
    return True


async def serve_until_gone(
    socket: WebSocket, actor: Actor, receiving: Coroutine[None, None, None], sending: Coroutine[None, None, None]
) -> None:
    """Receive and send until one of them ends or the login session ends. In the last case close the WebSocket with "signed out".

    ``receiving`` notices a disconnection even while nothing can be sent.
    """
    services = services_of(socket)
    tasks = {asyncio.create_task(receiving), asyncio.create_task(sending)}
    ending = asyncio.create_task(services.auth.revocations.until_ended(actor.login_session_id))
    try:
        with services.metrics.listeners.track_inprogress():
            first, _ = await asyncio.wait(tasks | {ending}, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks | {ending}:
            task.cancel()
        # Not gather: it would swallow the cancellation of this task.
        await asyncio.wait(tasks | {ending})
        for task in tasks:
            # If the WebSocket closes while a message is being sent, this is no error.
            if not task.cancelled() and (error := task.exception()) and not _is_closed(socket):
                log.error("a WebSocket failed", exc_info=error)
    if first == {ending} and not _is_closed(socket):
        await socket.close(1008, "signed out")


def _is_closed(socket: WebSocket) -> bool:
    return WebSocketState.DISCONNECTED in (socket.client_state, socket.application_state)
