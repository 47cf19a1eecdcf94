"""Record requests that change no row (views, refusals, commands) in the audit trail, and search the trail."""

import json
from datetime import datetime
from typing import Annotated, Any, Final, Literal, Protocol
from uuid import UUID

from fastapi import APIRouter, Query, Request
from pydantic import Field
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, RequestContext
from kata.audit.audit_log import AuditLog
from kata.audit.chain import Entry, Outcome
from kata.audit.entries import entry
from kata.audit.tables import AuditRow
from kata.database.availability import DATABASE_UNAVAILABLE
from kata.dependencies import PROBLEMS, TheDatabase
from kata.pagination import After, Keyset, Limit, Page
from kata.settings import Settings
from kata.types import NO_NUL, Moment, Schema

router = APIRouter(tags=["audit"])

_REFUSED: Final = frozenset({401, 403, 404, 409, 410, 423, 429, 503})
"""Statuses of a refusal. A validation error (422) is none."""
_AUDITED_VIEWS: Final = frozenset({"read_records", "administer"})
"""Permissions of routes whose read requests are recorded."""
_COMMANDS: Final = frozenset({"stop", "operate"})
_READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_AUDITED_SOCKETS: Final = frozenset({"live", "live_stations"})
"""These WebSockets show which patient is on an apparatus."""
_HEALTH_CHECKS: Final = frozenset({"get_health_live", "get_health_ready", "get_health_idle"})
"""Never recorded: programs request them every few seconds."""
_REFRESH: Final = b"x-kata-refresh"
"""The header by which a page marks a request that refreshes what it shows."""
_UNAUTHENTICATED: Final = "at_the_door"
"""Action code of requests that were refused before their route was known. Stored rows contain it."""
_SOCKET_STATUS: Final = {"websocket.accept": 101, "websocket.close": 403}
"""HTTP status of the first message of a WebSocket's answer."""
_NEWEST_FIRST: Final = Keyset(tuple[datetime, int], AuditRow.at, AuditRow.number, descending=True)


class AuditServices(Protocol):
    """The service that this module uses. ``kata.api.services.Services`` provides it."""

    @property
    def audit_log(self) -> AuditLog:
        """Return the audit log."""

    @property
    def settings(self) -> Settings:
        """Return the service's settings."""


class AuditMiddleware:
    """Records the outcome of each request before it is answered. A request that cannot be recorded is not answered."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run the application, and record the outcome when its answer begins."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        services: AuditServices = scope["app"].state.services
        audit_log = services.audit_log
        CURRENT_ACTOR.set(None)
        REQUEST_CONTEXT.set(None)
        begun = False

        async def sent(message: Message) -> None:
            nonlocal begun
            if not begun:
                begun = True
                await _record_outcome(audit_log, scope, _SOCKET_STATUS.get(message["type"]) or int(message["status"]))
            await send(message)

        try:
            await self._app(scope, receive, sent)
        except Exception:
            if not begun:
                await _record_outcome(audit_log, scope, 500)
            raise


async def _record_outcome(audit_log: AuditLog, scope: Scope, status: int) -> None:
    context = REQUEST_CONTEXT.get()
    method = scope.get("method", "GET")
    outcome: Outcome = "done" if status < 400 else "refused" if status in _REFUSED else "failed"
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
    if method not in _READING and (outcome == "done" or context.permission in _COMMANDS):
        # The answer to a command never waits for the disk.
        audit_log.record_at_once(outcome_entry)
    elif outcome == "done" and scope["type"] == "http":
        await _record_view(audit_log, scope, outcome_entry)
    else:
        await audit_log.record(outcome_entry)


async def _record_view(audit_log: AuditLog, scope: Scope, view: Entry) -> None:
    """Record a view, unless it refreshes one that is in the trail."""
    address = scope["path"].encode(errors="replace") + b"?" + scope["query_string"]
    is_refresh = any(name == _REFRESH for name, _ in scope["headers"])
    if is_refresh and (view, address) in audit_log.recorded_views:
        return
    await audit_log.record(view)
    audit_log.recorded_views.add(view, address)


def _is_recorded(context: RequestContext, method: str, status: int) -> bool:
    # Refusals during an outage of the database are not recorded: the outage has its own entry.
    if context.why == DATABASE_UNAVAILABLE or context.action in _HEALTH_CHECKS:
        return False
    if status >= 500:
        return True
    if status >= 400:
        return status in _REFUSED
    return method not in _READING or context.permission in _AUDITED_VIEWS or context.action in _AUDITED_SOCKETS


class AuditEntry(Schema):
    """An action, a view or a refused attempt."""

    number: int = Field(description="In the chain, from 1 without gaps.")
    at: datetime
    account_id: UUID | None = Field(
        description="The user's account; without a login, the account of the attempted login. Null: neither."
    )
    who: str = Field(description="The user's name at that time; empty without a login.")
    role: str
    address: str = Field(description="Address of the browser.")
    action: str = Field(description="The operation's name in this API, or the program's action.")
    outcome: Outcome
    patient_id: UUID | None
    subject: str = Field(description="The object, besides the patient.")
    station: str
    detail: dict[str, Any] = Field(description="Changed rows and fields, or the reason of a refusal.")


class AuditHeads(Schema):
    """The places outside the database that store heads of the trail, which reveal a cut."""

    elsewhere: list[str] = Field(description="Files with every head on another disk or computer.")
    copy_file: str | None = Field(description="KATA_AUDIT_ANCHOR_COPY; null: not set.")
    failing_since: Moment | None = Field(
        description="Since when the copy cannot be written; null: it can, or there is none."
    )
    log: bool = Field(description="Every row is written to the log, for a log collector.")
    other_stations: bool = Field(description="Other stations on the same database anchor the trail, too.")


class AuditPage(Page[AuditEntry]):
    """Entries, newest first, and where the heads of the trail are stored."""

    heads: AuditHeads


_Text = Annotated[str | None, Query(max_length=100, pattern=NO_NUL)]


@router.get("/api/audit", responses=PROBLEMS.of(422), summary="Search the audit trail")
def list_audit(
    request: Request,
    database: TheDatabase,
    account_id: UUID | None = None,
    patient_id: UUID | None = None,
    action: _Text = None,
    outcome: Literal["done", "refused", "failed"] | None = None,
    station: _Text = None,
    since: Annotated[Moment | None, Query(description="UTC; from here on.")] = None,
    until: Annotated[Moment | None, Query(description="UTC; before this.")] = None,
    limit: Limit = 50,
    after: After = None,
) -> AuditPage:
    """Return the audit trail, newest first. Every given filter must match."""
    services: AuditServices = request.app.state.services
    services.audit_log.until_written(1.0)
    wanted = (
        (AuditRow.account_id, account_id),
        (AuditRow.patient_id, patient_id),
        (AuditRow.action, action),
        (AuditRow.outcome, outcome),
        (AuditRow.station, station),
    )
    query = select(AuditRow).where(*(column == value for column, value in wanted if value is not None))
    if since:
        query = query.where(AuditRow.at >= since)
    if until:
        query = query.where(AuditRow.at < until)
    with database.read() as session:
        rows = list(session.scalars(_NEWEST_FIRST.page(query, after, limit)))
        shown, further = _NEWEST_FIRST.cut(rows, limit, lambda row: (row.at, row.number))
        heads = _describe_heads(services.audit_log, services.settings, shared=database.file is None, session=session)
        return AuditPage(items=[_to_entry(row) for row in shown], next=further, heads=heads)


def _describe_heads(audit_log: AuditLog, settings: Settings, *, shared: bool, session: Session) -> AuditHeads:
    copy = audit_log.copy
    return AuditHeads(
        elsewhere=[str(file) for file in audit_log.elsewhere],
        copy_file=str(copy.file) if copy else None,
        failing_since=copy.failing_since if copy else None,
        log=settings.log_format == "json",
        other_stations=shared and audit_log.has_other_anchors(session),
    )


def _to_entry(row: AuditRow) -> AuditEntry:
    names = AuditEntry.model_fields.keys() - {"detail"}
    try:
        detail = json.loads(row.detail or "{}")
    except ValueError:
        detail = {"unreadable": row.detail}
    return AuditEntry.model_validate({name: getattr(row, name) for name in names} | {"detail": detail})
