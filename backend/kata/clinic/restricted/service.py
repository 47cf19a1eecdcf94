"""Records that only a care team sees. Commits nothing: the request does."""

import logging
from collections.abc import Iterable
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import Select, delete, or_, select
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

log = logging.getLogger(__name__)

GLASS_LASTS: Final = timedelta(hours=4)
"""Longer than a visit, shorter than a working day."""
_MOST_LISTED: Final = 200


def hidden(actor: Actor) -> Select[UUID]:
    """The patients whose records are not for this actor: a list leaves them out within its own query."""
    team = select(CareTeamRow.patient_id).where(CareTeamRow.account_id == actor.account_id)
    opened = _open_glass(actor).with_only_columns(BreakGlassAccessRow.patient_id)
    return select(PatientRow.id).where(PatientRow.restricted, ~or_(PatientRow.id.in_(team), PatientRow.id.in_(opened)))


def hidden_among(session: Session, actor: Actor, patient_ids: Iterable[UUID]) -> set[UUID]:
    """Which of these patients' records are not for this actor."""
    wanted = set(patient_ids)
    return set(session.scalars(hidden(actor).where(PatientRow.id.in_(wanted)))) if wanted else set()


def may_see(session: Session, actor: Actor | None, patient_ids: Iterable[UUID]) -> bool:
    """Whether all of these patients' records are for this actor. Of one that is not there, the route tells."""
    return actor is None or not hidden_among(session, actor, patient_ids)


def access(session: Session, actor: Actor, patient_id: UUID) -> RecordAccess:
    """Who sees a record, and whether the actor does.

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
        _open_glass(actor)
        .where(BreakGlassAccessRow.patient_id == patient_id)
        .order_by(BreakGlassAccessRow.until.desc())
    ).first()
    return RecordAccess(
        restricted=patient.restricted,
        team=[TeamMember(account_id=account_id, name=name) for account_id, name in team],
        open_to_you=may_see(session, actor, [patient_id]),
        glass_until=until if patient.restricted else None,
    )


def change(session: Session, patient_id: UUID, wanted: RecordAccessChange) -> None:
    """Restrict a record to a team, or open it to everybody who reads records.

    :raises ProblemError: 404; 422 when nobody has one of these accounts.
    """
    patient = patients.get(session, patient_id, to_change=True)
    known = set(session.scalars(select(AccountRow.id).where(AccountRow.id.in_(wanted.account_ids))))
    if unknown := wanted.account_ids - known:
        raise ProblemError(
            422,
            "no_account",
            texts.CARE_TEAM_WITHOUT_ACCOUNT(),
            texts.RELOAD_ACCOUNTS(),
            [("#/account_ids", str(account_id)) for account_id in sorted(unknown, key=str)],
        )
    patient.restricted = wanted.restricted
    session.execute(delete(CareTeamRow).where(CareTeamRow.patient_id == patient_id))
    session.add_all(CareTeamRow(patient_id=patient_id, account_id=account_id) for account_id in known)
    session.flush()


def break_glass(session: Session, actor: Actor, patient_id: UUID, reason: str) -> datetime:
    """Open a restricted record to the actor, until the time that is returned.

    :raises ProblemError: 404; 409 when it is open to the actor anyway.
    """
    patients.get(session, patient_id)
    if may_see(session, actor, [patient_id]):
        raise ProblemError(409, "not_restricted", texts.RECORD_NOT_RESTRICTED(), texts.GO_ON_AS_USUAL())
    now = utc_now()
    row = BreakGlassAccessRow(
        id=uuid4(), patient_id=patient_id, account_id=actor.account_id, reason=reason, at=now, until=now + GLASS_LASTS
    )
    session.add(row)
    session.flush()
    # Whose record it is stands in the database; a log is read by others.
    log.warning("%s broke the glass (%s)", actor.name, row.id)
    return row.until


def break_glass_accesses(session: Session) -> list[BreakGlassAccess]:
    """What was opened in an emergency: first what nobody has looked at, then the newest."""
    query = (
        select(BreakGlassAccessRow, AccountRow.name)
        .join(AccountRow, AccountRow.id == BreakGlassAccessRow.account_id)
        .order_by(BreakGlassAccessRow.reviewed_at.is_not(None), BreakGlassAccessRow.at.desc(), BreakGlassAccessRow.id)
    )
    return [_as_access(row, name) for row, name in session.execute(query.limit(_MOST_LISTED))]


def review(session: Session, actor: Actor, glass_id: UUID) -> BreakGlassAccess:
    """An administrator has looked at it.

    :raises ProblemError: 404; 409 when it was the administrator's own doing, or somebody has looked already.
    """
    row = session.get(BreakGlassAccessRow, glass_id, with_for_update=True)
    account = session.get(AccountRow, row.account_id) if row else None
    if row is None or account is None:
        raise not_found(texts.EMERGENCY_ACCESS_NOT_FOUND)
    if row.account_id == actor.account_id:
        raise ProblemError(409, "own_glass", texts.OWN_EMERGENCY_ACCESS(), texts.OTHER_ADMINISTRATOR_REVIEWS())
    if row.reviewed_at:
        raise ProblemError(409, "reviewed", texts.EMERGENCY_ACCESS_REVIEWED(), texts.RELOAD_LIST())
    row.reviewed_at, row.reviewed_by = utc_now(), actor.name
    return _as_access(row, account.name)


def _as_access(row: BreakGlassAccessRow, name: str) -> BreakGlassAccess:
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


def _open_glass(actor: Actor) -> Select[datetime]:
    return select(BreakGlassAccessRow.until).where(
        BreakGlassAccessRow.account_id == actor.account_id, BreakGlassAccessRow.until > utc_now()
    )
