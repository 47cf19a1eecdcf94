"""Restricted records and break-glass accesses. The caller commits."""

import logging
from collections.abc import Iterable
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import Select, delete, false, or_, select
from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.auth.tables import AccountRow
from kata.clinic import texts
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import PatientRow
from kata.clinic.restricted.schemas import BreakGlassAccess, RecordAccess, RecordAccessChange, TeamMember
from kata.clinic.restricted.tables import BreakGlassAccessRow, CareTeamRow
from kata.database.base import utc_now
from kata.errors import ProblemError, not_found
from kata.pagination import Keyset

log = logging.getLogger(__name__)

BREAK_GLASS_DURATION: Final = timedelta(hours=4)
"""Duration of a break-glass access: longer than a visit, shorter than a working day."""
_UNREVIEWED_FIRST: Final = Keyset(
    tuple[bool, datetime, UUID],
    BreakGlassAccessRow.reviewed_at.is_(None),
    BreakGlassAccessRow.at,
    BreakGlassAccessRow.id,
    descending=True,
)


def hidden(actor: Actor) -> Select[UUID]:
    """Return a query of the patients whose records this actor may not see. Queries of lists use it to exclude these patients.

    A break-glass access opens a record only to the person who gave the reason, not to that person's programs.
    """
    team = select(CareTeamRow.patient_id).where(CareTeamRow.account_id == actor.account_id)
    opened = _valid_break_glass_accesses(actor).with_only_columns(BreakGlassAccessRow.patient_id)
    return select(PatientRow.id).where(PatientRow.restricted, ~or_(PatientRow.id.in_(team), PatientRow.id.in_(opened)))


def hidden_among(session: Session, actor: Actor, patient_ids: Iterable[UUID]) -> set[UUID]:
    """Return those of the given patients whose records this actor may not see."""
    ids = set(patient_ids)
    return set(session.scalars(hidden(actor).where(PatientRow.id.in_(ids)))) if ids else set()


def may_see(session: Session, actor: Actor | None, patient_ids: Iterable[UUID]) -> bool:
    """Return True if this actor may see the records of all these patients. Unknown ids count as visible, because the route answers 404."""
    return actor is None or not hidden_among(session, actor, patient_ids)


def access(session: Session, actor: Actor, patient_id: UUID) -> RecordAccess:
    """Return who may see a record, and whether the actor may see it.

    :raises ProblemError: 404.
    """
    patient = patients.get(session, patient_id)
    team = session.execute(
        select(AccountRow.id, AccountRow.name)
        .join(CareTeamRow, CareTeamRow.account_id == AccountRow.id)
        .where(CareTeamRow.patient_id == patient_id)
        .order_by(AccountRow.name, AccountRow.id)
    )
    until = session.scalars(
        _valid_break_glass_accesses(actor)
        .where(BreakGlassAccessRow.patient_id == patient_id)
        .order_by(BreakGlassAccessRow.until.desc())
    ).first()
    return RecordAccess(
        restricted=patient.restricted,
        team=[TeamMember(account_id=account_id, name=name) for account_id, name in team],
        open_to_you=may_see(session, actor, [patient_id]),
        glass_until=until if patient.restricted else None,
    )


def change(session: Session, patient_id: UUID, access: RecordAccessChange) -> None:
    """Restrict a record to a team, or open it to all users who may read records.

    :raises ProblemError: 404; 422 when one of these accounts does not exist.
    """
    patient = patients.get(session, patient_id, to_change=True)
    existing_ids = set(session.scalars(select(AccountRow.id).where(AccountRow.id.in_(access.account_ids))))
    if unknown := access.account_ids - existing_ids:
        raise ProblemError(
            422,
            "no_account",
            texts.CARE_TEAM_WITHOUT_ACCOUNT(),
            texts.RELOAD_ACCOUNTS(),
            [("#/account_ids", str(account_id)) for account_id in sorted(unknown, key=str)],
        )
    patient.restricted = access.restricted
    session.execute(delete(CareTeamRow).where(CareTeamRow.patient_id == patient_id))
    session.add_all(CareTeamRow(patient_id=patient_id, account_id=account_id) for account_id in existing_ids)
    session.flush()


def create_break_glass_access(session: Session, actor: Actor, patient_id: UUID, reason: str) -> datetime:
    """Open a restricted record to the actor and return the time at which the access ends.

    :raises ProblemError: 404; 409 when the actor may already see the record.
    """
    patients.get(session, patient_id)
    if may_see(session, actor, [patient_id]):
        raise ProblemError(409, "not_restricted", texts.RECORD_NOT_RESTRICTED(), texts.GO_ON_AS_USUAL())
    now = utc_now()
    row = BreakGlassAccessRow(
        id=uuid4(),
        patient_id=patient_id,
        account_id=actor.account_id,
        reason=reason,
        at=now,
        until=now + BREAK_GLASS_DURATION,
    )
    session.add(row)
    session.flush()
    # The log names neither patient nor user, because the people who maintain Kata read it.
    log.warning("a restricted record was opened in an emergency (%s)", row.id)
    return row.until


def break_glass_accesses(session: Session, limit: int, after: str | None) -> tuple[list[BreakGlassAccess], str | None]:
    """Return a page of the break-glass accesses, unreviewed ones first, then newest first, and the next cursor.

    :raises ProblemError: 422 when ``after`` is not a valid cursor.
    """
    query = select(BreakGlassAccessRow, AccountRow.name).join(
        AccountRow, AccountRow.id == BreakGlassAccessRow.account_id
    )
    records = session.execute(_UNREVIEWED_FIRST.page(query, after, limit)).all()
    rows, further = _UNREVIEWED_FIRST.cut(
        records, limit, lambda pair: (pair[0].reviewed_at is None, pair[0].at, pair[0].id)
    )
    return [_as_break_glass_access(row, name) for row, name in rows], further


def review_break_glass_access(session: Session, actor: Actor, break_glass_access_id: UUID) -> BreakGlassAccess:
    """Mark a break-glass access as reviewed by an administrator.

    :raises ProblemError: 404; 409 when it is the administrator's own access, or already reviewed.
    """
    row = session.get(BreakGlassAccessRow, break_glass_access_id, with_for_update=True)
    account = session.get(AccountRow, row.account_id) if row else None
    if row is None or account is None:
        raise not_found(texts.BREAK_GLASS_ACCESS_NOT_FOUND)
    if row.account_id == actor.account_id:
        raise ProblemError(409, "own_glass", texts.OWN_BREAK_GLASS_ACCESS(), texts.OTHER_ADMINISTRATOR_REVIEWS())
    if row.reviewed_at:
        raise ProblemError(409, "reviewed", texts.BREAK_GLASS_ACCESS_REVIEWED(), texts.RELOAD_LIST())
    row.reviewed_at, row.reviewed_by = utc_now(), actor.name
    return _as_break_glass_access(row, account.name)


def _as_break_glass_access(row: BreakGlassAccessRow, name: str) -> BreakGlassAccess:
    return BreakGlassAccess(
        id=row.id,
        patient_id=row.patient_id,
        account_id=row.account_id,
        name=name,
        reason=row.reason,
        at=row.at,
        until=row.until,
        reviewed_at=row.reviewed_at,
        reviewed_by=row.reviewed_by,
    )


def _valid_break_glass_accesses(actor: Actor) -> Select[datetime]:
    opened = select(BreakGlassAccessRow.until).where(
        BreakGlassAccessRow.account_id == actor.account_id, BreakGlassAccessRow.until > utc_now()
    )
    return opened.where(false()) if actor.by_token else opened
