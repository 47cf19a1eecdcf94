"""Make audit entries, and add them to the transaction of the change that they describe."""

import json
from collections.abc import Mapping
from typing import Any, Final
from uuid import UUID

from sqlalchemy.orm import Session

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, Actor
from kata.audit.chain import AuditOutcome, Entry
from kata.database.base import utc_now

PROGRAM: Final = "Kata"
"""Name of the actor if no user requested the action."""
ADDED: Final = "audit"
"""Key in ``Session.info`` of the entries that wait for the commit."""


def entry(
    action: str,
    outcome: AuditOutcome = "done",
    patient_id: UUID | None = None,
    subject: str = "",
    detail: Mapping[str, Any] | None = None,
    actor: Actor | None = None,
) -> Entry:
    """Return an entry with user, address, patient and station of the request. Texts are truncated to their columns.

    :param detail: must contain no secret and no data of a patient.
    :param actor: the user, if it is not the user of the request.
    """
    actor, context = actor or CURRENT_ACTOR.get(), REQUEST_CONTEXT.get()
    if actor and actor.by_token:
        detail = {**(detail or {}), "access_token": str(actor.login_session_id)}
    return Entry(
        at=utc_now(),
        account_id=actor.account_id if actor else context.account_id if context else None,
        who=_truncate(actor.name, 100) if actor else "" if context and context.address else PROGRAM,
        role=actor.role if actor else "",
        sign_in_id=actor.login_session_id if actor else None,
        address=_truncate(context.address, 64) if context else "",
        action=_truncate(action, 64),
        outcome=outcome,
        patient_id=patient_id or (context.patient_id if context else None),
        subject=_truncate(subject or (context.subject if context else ""), 100),
        station=_truncate(context.station, 100) if context else "",
        detail=as_json(detail),
    )


def add_entry(session: Session, entry: Entry) -> None:
    """Add an entry to the trail when ``session``, one of :meth:`Database.write`, is committed.

    The entry describes all changes of the session. Without an added entry, the audit hook makes one of the request's action. An entry must
    not contain a user name as typed, because the user may have typed a password there.
    """
    session.info.setdefault(ADDED, []).append(entry)


def as_json(detail: Mapping[str, Any] | None) -> str:
    """Return a detail as stored in a row: compact JSON, empty for no detail."""
    return json.dumps(detail, separators=(",", ":")) if detail else ""


def _truncate(text: str, longest: int) -> str:
    """Return a text that every database can store, truncated."""
    return text.replace("\0", "").encode(errors="replace").decode()[:longest]
