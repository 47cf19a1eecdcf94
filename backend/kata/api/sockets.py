"""Serve a WebSocket until the page leaves or its login session ends."""

import asyncio
import logging
from collections.abc import Coroutine

from fastapi import WebSocket

from kata.actor import Actor
from kata.api.services import services_of

log = logging.getLogger(__name__)


async def until_gone(
    socket: WebSocket, actor: Actor, receiving: Coroutine[None, None, None], sending: Coroutine[None, None, None]
) -> None:
    """Receive and send until either ends or the login session ends. In the last case close the WebSocket with "signed out".

    ``receiving`` notices that the other end has gone, even while nothing can be sent.
    """
    services = services_of(socket)
    tasks = {asyncio.create_task(receiving), asyncio.create_task(sending)}
    ending = asyncio.create_task(services.access.revocations.of(actor.login_session_id))
    try:
        with services.metrics.listeners.track_inprogress():
            first, _ = await asyncio.wait(tasks | {ending}, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks | {ending}:
            task.cancel()
        # Not gather: it would swallow the cancellation of this task.
        await asyncio.wait(tasks | {ending})
        for task in tasks:
            if not task.cancelled() and (error := task.exception()):
                log.error("a WebSocket failed", exc_info=error)
    if first == {ending}:
        await socket.close(1008, "signed out")
