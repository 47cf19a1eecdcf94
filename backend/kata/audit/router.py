"""REST route that searches the audit trail."""

import json
from datetime import datetime
from typing import Annotated, Any, Final, Literal, Protocol
from uuid import UUID

from fastapi import APIRouter, Query, Request
from pydantic import Field
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.audit.audit_log import AuditLog
from kata.audit.chain import AuditOutcome
from kata.audit.tables import AuditRow
from kata.dependencies import PROBLEMS, TheDatabase
from kata.pagination import After, Keyset, Limit, Page
from kata.settings import Settings
from kata.types import NO_NUL, Moment, Schema

router = APIRouter(tags=["audit"])

_NEWEST_FIRST: Final = Keyset(tuple[datetime, int], AuditRow.at, AuditRow.number, descending=True)


class AuditServices(Protocol):
    """The service that this module uses. ``kata.api.services.Services`` provides it."""

    @property
    def audit_log(self) -> AuditLog:
        """Return the audit log."""

    @property
    def settings(self) -> Settings:
        """Return the service's settings."""


class AuditEntry(Schema):
    """An action, a view or a refused attempt."""

    number: int = Field(description="Number in the chain, from 1 without gaps.")
    at: datetime
    account_id: UUID | None = Field(
        description="The user's account; without a login, the account of the attempted login; null if there is neither."
    )
    who: str = Field(description="The user's name at that time; empty without a login.")
    role: str
    address: str = Field(description="Address of the browser.")
    action: str = Field(description="The operation's name in this API, or the action of the program.")
    outcome: AuditOutcome
    patient_id: UUID | None
    subject: str = Field(description="Object of the action, in addition to the patient.")
    station: str
    detail: dict[str, Any] = Field(description="Changed rows and fields, or the reason of a refusal.")


class AuditHeads(Schema):
    """The places outside the database that store heads of the trail. A stored head reveals that the trail was cut."""

    elsewhere: list[str] = Field(description="Files on another disk or computer that contain every head.")
    copy_file: str | None = Field(description="KATA_AUDIT_ANCHOR_COPY; null: not set.")
    failing_since: Moment | None = Field(
        description="Time since which the copy cannot be written; null: it can be written, or there is no copy."
    )
    log: bool = Field(description="True if every row is written to the log, for a log collector.")
    other_stations: bool = Field(description="True if other stations on the same database also anchor the trail.")


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
    """Return the entries that match every given filter, newest first."""
    services: AuditServices = request.app.state.services
    services.audit_log.until_written(1.0)
    filters = (
        (AuditRow.account_id, account_id),
        (AuditRow.patient_id, patient_id),
        (AuditRow.action, action),
        (AuditRow.outcome, outcome),
        (AuditRow.station, station),
    )
    query = select(AuditRow).where(*(column == value for column, value in filters if value is not None))
    if since:
        query = query.where(AuditRow.at >= since)
    if until:
        query = query.where(AuditRow.at < until)
    with database.read() as session:
        rows = list(session.scalars(_NEWEST_FIRST.page(query, after, limit)))
        page_rows, further = _NEWEST_FIRST.cut(rows, limit, lambda row: (row.at, row.number))
        heads = _describe_heads(services.audit_log, services.settings, shared=database.file is None, session=session)
        return AuditPage(items=[_to_entry(row) for row in page_rows], next=further, heads=heads)


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
