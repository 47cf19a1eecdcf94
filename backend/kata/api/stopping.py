"""Passes a user's Stop to the device, with its permission and its audit entry. HTTP and WebSocket both use it."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Final

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT
from kata.api.authorization import check_user
from kata.api.services import Services
from kata.audit.chain import AuditOutcome
from kata.audit.entries import entry
from kata.auth.permissions import ROUTE_RULES, RouteRule
from kata.device.ipc_messages import Refusal, Stop

_RULE: Final[RouteRule] = ROUTE_RULES["stop"]
_ACTION: Final = "stop"


async def stop_by_user(services: Services) -> Refusal | None:
    """Stop the apparatus for the current user, then record it. Return the device's refusal, or None if it has confirmed the Stop.

    :raises ProblemError: when the user may not stop the apparatus.
    """
    actor = CURRENT_ACTOR.get()
    # Both routes require a login.
    assert actor is not None
    check_user(actor, _RULE, services.station_name)
    outcome: AuditOutcome = "failed"
    refusal: Refusal | None = None
    try:
        refusal = await services.station.command(Stop())
        outcome = "refused" if refusal else "done"
    finally:
        _record(services, outcome, refusal)
    return refusal


def _record(services: Services, outcome: AuditOutcome, refusal: Refusal | None) -> None:
    context = REQUEST_CONTEXT.get()
    of_request = context is not None and context.action == _ACTION
    if context and not of_request:
        # A WebSocket's own context is that of its opening.
        context = replace(context, action=_ACTION, is_command=True, audited=set())
    token = REQUEST_CONTEXT.set(context)
    services.audit_log.record_at_once(entry(_ACTION, outcome, detail={"why": refusal.code} if refusal else None))
    REQUEST_CONTEXT.reset(token)
    if context and of_request:
        context.audited.add(outcome)


class StopQueue:
    """Sends the Stops of one WebSocket one after another. Stops that arrive while one is in flight share the next.

    They may not share the Stop in flight: the device may have processed it before a command that the later Stop must discard.
    """

    def __init__(
        self, stop: Callable[[], Awaitable[Refusal | None]], answer: Callable[[int, Refusal | None], None]
    ) -> None:
        """``answer`` gets the number of each Stop with the device's refusal."""
        self._stop, self._answer = stop, answer
        self._waiting: list[int] = []
        self._running: asyncio.Task[None] | None = None

    def put(self, number: int) -> None:
        """Send a Stop as soon as the Stop in flight is answered."""
        self._waiting.append(number)
        if self._running is None or self._running.done():
            self._running = asyncio.create_task(self._run(), name="stop")

    async def _run(self) -> None:
        while self._waiting:
            numbers, self._waiting = self._waiting, []
            refusal = await self._stop()
            for number in numbers:
                self._answer(number, refusal)
