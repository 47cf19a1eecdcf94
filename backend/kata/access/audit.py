"""The audit trail: what is noted of a change is committed with it, in the same transaction, as the next link of one chain."""

import json
from collections.abc import Mapping
from typing import Any, Final
from uuid import UUID

from sqlalchemy.orm import Session

from kata.access.actor import ACTING, DOING, Actor
from kata.access.chain import Entry, Outcome
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
    actor, doing = actor or ACTING.get(), DOING.get()
    return Entry(
        at=utc_now(),
        account_id=actor.account_id if actor else doing.account_id if doing else None,
        who=_cut(actor.name, 100) if actor else "" if doing and doing.address else PROGRAM,
        role=actor.role if actor else "",
        sign_in_id=actor.sign_in_id if actor else None,
        address=_cut(doing.address, 64) if doing else "",
        action=_cut(action, 64),
        outcome=outcome,
        patient_id=patient_id or (doing.patient_id if doing else None),
        subject=_cut(subject or (doing.subject if doing else ""), 100),
        station=_cut(doing.station, 100) if doing else "",
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
