"""Read and write sessions. Module ``runs`` does the same for their runs. The caller commits."""

from datetime import datetime
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import select, update
from sqlalchemy.orm import Session as DatabaseSession

from kata.clinic import texts
from kata.clinic.patients import service as patients
from kata.clinic.sessions import ending, patient_angles, plans, runs
from kata.clinic.sessions.schemas import (
    Addendum,
    CheckAnswer,
    EndReason,
    GoniometerReading,
    Session,
    SessionPatient,
    SessionUpdate,
)
from kata.clinic.sessions.tables import (
    SessionRow,
    SessionStopRow,
)
from kata.database.base import utc_now
from kata.errors import ProblemError, check_version, not_found

_MAY_BE_EMPTIED: Final = {"pain_before", "pain_during", "pain_after"}


def has_open(session: DatabaseSession, station: str) -> bool:
    """Return True if a session of this station is open."""
    unended = select(SessionRow.id).where(SessionRow.station == station, SessionRow.ended_at.is_(None))
    return session.scalar(unended.limit(1)) is not None


def begin(
    session: DatabaseSession,
    patient_id: UUID,
    therapist: str = "",
    programme_version_id: UUID | None = None,
    station: str = "",
    session_id: UUID | None = None,
) -> SessionRow:
    """Begin a session, or continue the patient's open session and fill in its missing fields.

    ``session_id``: id for a new session.

    :raises ProblemError: 404; 409 for an archived patient, or when the programme belongs to another episode.
    """
    patient = patients.get(session, patient_id)
    if patient.archived_at:
        raise ProblemError(409, "archived", texts.PATIENT_ARCHIVED(patient=patient.name), texts.RESTORE_PATIENT_FIRST())
    row = open_of(session, patient.id)
    if row is None:
        episode_id = patient.episode.id if patient.episode else None
        row = new(session_id or uuid4(), patient.id, episode_id, station, utc_now())
        session.add(row)
        session.flush()
        session.refresh(row)
    if therapist and not row.therapist:
        row.therapist = therapist
        session.execute(update(SessionStopRow).where(SessionStopRow.session_id == row.id).values(therapist=therapist))
    if programme_version_id and row.programme_version_id is None:
        plans.choose(session, row, programme_version_id)
        session.flush()
    return row


def new(id_: UUID, patient_id: UUID, episode_id: UUID | None, station: str, started_at: datetime) -> SessionRow:
    """Return a new row of a session. The row is not added to a database."""
    return SessionRow(
        id=id_,
        patient_id=patient_id,
        episode_id=episode_id,
        station=station,
        started_at=started_at,
        ended_at=None,
        note="",
        updated_at=started_at,
    )


def remove_unannounced(session: DatabaseSession, session_id: UUID) -> None:
    """Delete a session whose beginning was not reported to its user."""
    row = session.get(SessionRow, session_id)
    if row and not row.runs:
        session.delete(row)


def get(session: DatabaseSession, session_id: UUID) -> SessionRow:
    """Return one session.

    :raises ProblemError: 404.
    """
    row = session.get(SessionRow, session_id)
    if row is None:
        raise not_found(texts.SESSION_NOT_FOUND)
    return row


def open_of(session: DatabaseSession, patient_id: UUID) -> SessionRow | None:
    """Return the patient's open session, or None."""
    unended = select(SessionRow).where(SessionRow.patient_id == patient_id, SessionRow.ended_at.is_(None))
    return session.scalars(unended.order_by(SessionRow.started_at.desc())).first()


def to_change(session: DatabaseSession, session_id: UUID, seen_at: datetime | None = None) -> SessionRow:
    """Return a session that may still change, and lock its row.

    ``seen_at``: the ``updated_at`` that the editor saw.

    :raises ProblemError: 404; 409 when the session is signed or was changed meanwhile.
    """
    row = session.get(SessionRow, session_id, with_for_update=True)
    if row is None:
        raise not_found(texts.SESSION_NOT_FOUND)
    if row.signed_at:
        raise ProblemError(409, "signed", texts.SESSION_SIGNED(), texts.WRITE_ADDENDUM())
    patients.check_not_erased(row.patient)
    check_version(row.updated_at, seen_at)
    return row


def end(session: DatabaseSession, session_id: UUID, reason: EndReason | None = None) -> SessionRow:
    """End a session. If the session has already ended, only the reason can change.

    :raises ProblemError: 404; 409 while a run in it has not ended, or when the session is signed.
    """
    row = to_change(session, session_id)
    ending.check_played(row.runs)
    row.ended_at = row.ended_at or utc_now()
    row.end_reason = reason or row.end_reason or ending.suggested_reason(plans.items(row), row.runs)
    row.updated_at = utc_now()
    return row


def change(session: DatabaseSession, session_id: UUID, update: SessionUpdate) -> SessionRow:
    """Change only the given fields.

    :raises ProblemError: 404; 409 when the session is signed or was changed meanwhile, or the programme belongs to another episode.
    """
    row = to_change(session, session_id, update.updated_at)
    fields = update.model_dump(exclude_unset=True, exclude={"updated_at", "programme_version_id"})
    for name, value in fields.items():
        if value is not None or name in _MAY_BE_EMPTIED:
            setattr(row, name, value)
    if update.programme_version_id:
        plans.choose(session, row, update.programme_version_id)
    elif "programme_version_id" in update.model_fields_set:
        row.programme_version = None
    row.updated_at = utc_now()
    return row


def as_session(row: SessionRow) -> Session:
    """Return the response model."""
    angles = patient_angles.of_session(row)
    return Session(
        id=row.id,
        patient=SessionPatient.model_validate(row.patient),
        episode_id=row.episode_id,
        side=row.side,
        therapist=row.therapist,
        station=row.station,
        simulated=bool(row.simulated),
        programme=plans.as_programme(row),
        started_at=row.started_at,
        ended_at=row.ended_at,
        end_reason=row.end_reason,
        checks=[CheckAnswer.model_validate(check) for check in row.checks],
        pain_before=row.pain_before,
        pain_during=row.pain_during,
        pain_after=row.pain_after,
        note=row.note,
        signed_at=row.signed_at,
        signed_by=row.signed_by,
        addenda=[Addendum.model_validate(addendum) for addendum in row.addenda],
        updated_at=row.updated_at,
        goniometer_readings=[GoniometerReading.model_validate(reading) for reading in row.goniometer_readings],
        runs=[runs.as_run(run, angles=angles) for run in row.runs],
    )
