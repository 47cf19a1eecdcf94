"""A WebSocket over which a page listens: until it leaves, or its sign-in ends."""

import asyncio
import logging
from collections.abc import Coroutine

from fastapi import WebSocket

from kata.actor import Actor
from kata.auth.login import SessionRevocations

log = logging.getLogger(__name__)


async def until_gone(
    socket: WebSocket, actor: Actor, hearing: Coroutine[None, None, None], telling: Coroutine[None, None, None]
) -> None:
    """Hear and tell until either comes to its end, or until this sign-in does: then the page is told so.

    ``hearing``: finds out that the other end has gone, even while nothing can be sent.
    """
    state = socket.app.state
    revocations: SessionRevocations = state.access.revocations
    tasks = {asyncio.create_task(hearing), asyncio.create_task(telling)}
    ending = asyncio.create_task(revocations.of(actor.sign_in_id))
    try:
        with state.metrics.listeners.track_inprogress():
            first, _ = await asyncio.wait(tasks | {ending}, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks | {ending}:
            task.cancel()
        # Not gather: it would swallow what we ourselves are cancelled by.
        await asyncio.wait(tasks | {ending})
        for task in tasks:
            if not task.cancelled() and (error := task.exception()):
                log.error("a listener could not be told any more", exc_info=error)
    if first == {ending}:
        await socket.close(1008, "signed out")
