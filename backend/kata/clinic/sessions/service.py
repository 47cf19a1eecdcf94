"""What is done with sessions; with their runs, see ``runs``. Commits nothing: the request does."""

from datetime import datetime
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic.patients import service as patients
from kata.clinic.sessions import ending, plans, runs
from kata.clinic.sessions.schemas import (
    Addendum,
    CheckAnswer,
    EndReason,
    Session,
    SessionPatient,
    SessionUpdate,
)
from kata.clinic.sessions.tables import (
    SessionRow,
)
from kata.database.base import utc_now
from kata.problems import ProblemError, check_version, not_found

_MAY_BE_EMPTIED: Final = {"pain_before", "pain_during", "pain_after"}


def begin(
    session: DatabaseSession,
    patient_id: UUID,
    therapist: str = "",
    programme_version_id: UUID | None = None,
    station: str = "",
) -> SessionRow:
    """Begin a session; the patient's one that is still open goes on instead, with what it does not have yet.

    :raises ProblemError: 404; 409 for an archived patient, or a programme of another episode.
    """
    patient = patients.get(session, patient_id)
    if patient.archived_at:
        raise ProblemError(409, "archived", f"{patient.name} is archived.", "Restore the patient's record first.")
    unended = select(SessionRow).where(SessionRow.patient_id == patient.id, SessionRow.ended_at.is_(None))
    row = session.scalars(unended.order_by(SessionRow.started_at.desc())).first()
    if row is None:
        now = utc_now()
        row = SessionRow(
            id=uuid4(),
            patient_id=patient.id,
            episode_id=patient.episode.id if patient.episode else None,
            station=station,
            started_at=now,
            ended_at=None,
            note="",
            updated_at=now,
        )
        session.add(row)
        session.flush()
        session.refresh(row)
    row.therapist = row.therapist or therapist
    if programme_version_id and row.programme_version_id is None:
        plans.choose(session, row, programme_version_id)
        session.flush()
    return row


def get(session: DatabaseSession, session_id: UUID) -> SessionRow:
    """One session.

    :raises ProblemError: 404.
    """
    row = session.get(SessionRow, session_id)
    if row is None:
        raise not_found("session")
    return row


def to_change(session: DatabaseSession, session_id: UUID, seen_at: datetime | None = None) -> SessionRow:
    """One session that may still be changed; nobody else changes it meanwhile.

    ``seen_at``: the ``updated_at`` that the editor saw.

    :raises ProblemError: 404; 409 when it is signed, or somebody else has changed it.
    """
    row = session.get(SessionRow, session_id, with_for_update=True)
    if row is None:
        raise not_found("session")
    if row.signed_at:
        raise ProblemError(409, "signed", "This session is signed and stays as it is.", "Write an addendum.")
    patients.check_not_erased(row.patient)
    check_version(row.updated_at, seen_at)
    return row


def end(session: DatabaseSession, session_id: UUID, reason: EndReason | None = None) -> SessionRow:
    """End a session, once; only the reason may be given again.

    :raises ProblemError: 404; 409 while a run in it has not ended, or when it is signed.
    """
    row = to_change(session, session_id)
    if any(run.outcome == "loaded" for run in row.runs):
        raise ProblemError(
            409, "run_not_ended", "A playback in this session has not ended.", "End it first, or stop it."
        )
    row.ended_at = row.ended_at or utc_now()
    row.end_reason = reason or row.end_reason or ending.suggested_reason(plans.items(row), row.runs)
    row.updated_at = utc_now()
    return row


def change(session: DatabaseSession, session_id: UUID, given: SessionUpdate) -> SessionRow:
    """Change what is given, leave the rest.

    :raises ProblemError: 404; 409 when it is signed, somebody else changed it meanwhile, or the programme is another episode's.
    """
    row = to_change(session, session_id, given.updated_at)
    fields = given.model_dump(exclude_unset=True, exclude={"updated_at", "programme_version_id"})
    for name, value in fields.items():
        if value is not None or name in _MAY_BE_EMPTIED:
            setattr(row, name, value)
    if given.programme_version_id:
        plans.choose(session, row, given.programme_version_id)
    elif "programme_version_id" in given.model_fields_set:
        row.programme_version = None
    row.updated_at = utc_now()
    return row


def as_session(row: SessionRow) -> Session:
    """As it goes out."""
    return Session(
        id=row.id,
        patient=SessionPatient.model_validate(row.patient),
        episode_id=row.episode_id,
        side=row.episode.side if row.episode else None,
        therapist=row.therapist,
        station=row.station,
        programme=plans.as_programme(row),
        started_at=row.started_at,
        ended_at=row.ended_at,
        end_reason=row.end_reason,
        checks=[CheckAnswer.model_validate(one) for one in row.checks],
        pain_before=row.pain_before,
        pain_during=row.pain_during,
        pain_after=row.pain_after,
        note=row.note,
        signed_at=row.signed_at,
        signed_by=row.signed_by,
        addenda=[Addendum.model_validate(one) for one in row.addenda],
        updated_at=row.updated_at,
        runs=[runs.as_run(run) for run in row.runs],
    )
