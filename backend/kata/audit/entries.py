"""The audit trail: what is noted of a change is committed with it, in the same transaction, as the next link of one chain."""

import json
from collections.abc import Mapping
from typing import Any, Final
from uuid import UUID

from sqlalchemy.orm import Session

from kata.actor import CURRENT_ACTOR, REQUEST_CONTEXT, Actor
from kata.audit.chain import Entry, Outcome
from kata.database.base import utc_now

PROGRAM: Final = "Kata"
"""Who did what nobody asked for."""
NOTED: Final = "audit"
"""Where in ``Session.info`` entries wait for the commit."""


def entry(
    action: str,
    outcome: Outcome,
    patient_id: UUID | None = None,
    subject: str = "",
    detail: Mapping[str, Any] | None = None,
    actor: Actor | None = None,
) -> Entry:
    """What is to be noted, with what the request is known to be: who, from where, to whom. Texts are cut to their columns.

    ``actor``: who did it, where that is not whose request it is. ``detail``: no secret, nothing that a field says of a patient.
    """
    actor, context = actor or CURRENT_ACTOR.get(), REQUEST_CONTEXT.get()
    return Entry(
        at=utc_now(),
        account_id=actor.account_id if actor else context.account_id if context else None,
        who=_cut(actor.name, 100) if actor else "" if context and context.address else PROGRAM,
        role=actor.role if actor else "",
        sign_in_id=actor.sign_in_id if actor else None,
        address=_cut(context.address, 64) if context else "",
        action=_cut(action, 64),
        outcome=outcome,
        patient_id=patient_id or (context.patient_id if context else None),
        subject=_cut(subject or (context.subject if context else ""), 100),
        station=_cut(context.station, 100) if context else "",
        detail=written(detail),
    )


def note(
    session: Session,
    action: str,
    outcome: Outcome = "done",
    patient_id: UUID | None = None,
    subject: str = "",
    detail: Mapping[str, Any] | None = None,
    actor: Actor | None = None,
) -> None:
    """Have this written into the trail when ``session``, one of :meth:`Database.write`, is committed; and only then.

    It stands for the whole of what the session changes: without it, a row is made from the request's action. See :func:`entry`
    for the rest. What somebody typed as a user name is none of it: it may be a password.
    """
    session.info.setdefault(NOTED, []).append(entry(action, outcome, patient_id, subject, detail, actor))


def written(detail: Mapping[str, Any] | None) -> str:
    """As it stands in a row."""
    return json.dumps(detail, separators=(",", ":")) if detail else ""


def _cut(text: str, longest: int) -> str:
    """As every database can keep it."""
    return text.replace("\0", "").encode(errors="replace").decode()[:longest]
