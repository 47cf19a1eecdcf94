"""Record the outcome of requests that change no row (views, refusals, commands) in the audit trail."""

from typing import Final, Protocol

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, RequestContext
from kata.audit.audit_log import AuditLog
from kata.audit.chain import AuditOutcome, Entry
from kata.audit.entries import entry
from kata.database.availability import DATABASE_UNAVAILABLE

_REFUSED: Final = frozenset({401, 403, 404, 409, 410, 423, 429, 503})
"""Statuses that are recorded as a refusal. A validation error (422) is not."""
_READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_AUDITED_SOCKETS: Final = frozenset({"live", "live_stations"})
"""WebSockets that are recorded, because they show which patient is on an apparatus."""
_HEALTH_CHECKS: Final = frozenset({"get_health_live", "get_health_ready", "get_health_idle"})
"""Routes that are never recorded, because programs request them every few seconds."""
_REFRESH: Final = b"x-kata-refresh"
"""Header by which a page marks a request that refreshes what it shows."""
_UNAUTHENTICATED: Final = "at_the_door"
"""Action code of requests that were refused before their route was known. Stored rows contain it."""
_SOCKET_STATUS: Final = {"websocket.accept": 101, "websocket.close": 403}
"""HTTP status of the first message of a WebSocket's answer."""


class AuditLogOwner(Protocol):
    """The service that this module uses. ``kata.api.services.Services`` provides it."""

    @property
    def audit_log(self) -> AuditLog:
        """Return the audit log."""


class AuditMiddleware:
    """Records the outcome of each request before it is answered. A request that cannot be recorded is not answered."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run the application, and record the outcome when its answer begins."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        services: AuditLogOwner = scope["app"].state.services
        audit_log = services.audit_log
        CURRENT_ACTOR.set(None)
        REQUEST_CONTEXT.set(None)
        has_begun = False

        async def sent(message: Message) -> None:
            nonlocal has_begun
            if not has_begun:
                has_begun = True
                await _record_outcome(audit_log, scope, _SOCKET_STATUS.get(message["type"]) or int(message["status"]))
            await send(message)

        try:
            await self._app(scope, receive, sent)
        except Exception:
            if not has_begun:
                await _record_outcome(audit_log, scope, 500)
            raise


async def _record_outcome(audit_log: AuditLog, scope: Scope, status: int) -> None:
    context = REQUEST_CONTEXT.get()
    method = scope.get("method", "GET")
    outcome: AuditOutcome = "done" if status < 400 else "refused" if status in _REFUSED else "failed"
    if context is None:
        if status in (400, 401, 403, 421, 429):
            client = scope.get("client")
            REQUEST_CONTEXT.set(
                RequestContext(
                    _UNAUTHENTICATED, subject=f"{method} {scope['path']}", address=client[0] if client else "?"
                )
            )
            await audit_log.record(entry(_UNAUTHENTICATED, "refused", detail={"why": status}))
        return
    if outcome in context.audited or not _is_recorded(context, method, status):
        return
    outcome_entry = entry(context.action, outcome, detail={"why": context.why or status} if status >= 400 else None)
    if method not in _READING and (outcome == "done" or context.is_command):
        # The answer to a command never waits for the disk.
        audit_log.record_at_once(outcome_entry)
    elif outcome == "done" and scope["type"] == "http":
        await _record_view(audit_log, scope, outcome_entry)
    else:
        await audit_log.record(outcome_entry)


async def _record_view(audit_log: AuditLog, scope: Scope, view: Entry) -> None:
    """Record a view, unless it refreshes a view that is already in the trail."""
    address = scope["path"].encode(errors="replace") + b"?" + scope["query_string"]
    is_refresh = any(name == _REFRESH for name, _ in scope["headers"])
    if is_refresh and (view, address) in audit_log.recorded_views:
        return
    await audit_log.record(view)
    audit_log.recorded_views.add(view, address)


def _is_recorded(context: RequestContext, method: str, status: int) -> bool:
    # Refusals during an outage of the database are not recorded, because the outage has its own entry.
    if context.why == DATABASE_UNAVAILABLE or context.action in _HEALTH_CHECKS:
        return False
    if status >= 500:
        return True
    if status >= 400:
        return status in _REFUSED
    return method not in _READING or context.audits_views or context.action in _AUDITED_SOCKETS
