"""What is done with patients. Commits nothing: the request does."""

from uuid import UUID, uuid4

from sqlalchemy import func, or_, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from kata.clinic.patients.schemas import PatientCreate, PatientUpdate
from kata.clinic.patients.tables import PatientRow
from kata.clinic.problems import ProblemError, not_found
from kata.database.base import utc_now

_MAY_BE_EMPTIED = {"kana", "birth_date"}


def find(session: Session, *, search: str, archived: bool, limit: int, offset: int) -> tuple[list[PatientRow], int]:
    """Patients by name, kana or number, in the order of their names; and how many there are in all."""
    query = select(PatientRow)
    query = query.where(PatientRow.archived_at.is_not(None) if archived else PatientRow.archived_at.is_(None))
    for word in search.split():
        columns = (PatientRow.name, PatientRow.kana, PatientRow.clinic_number)
        query = query.where(or_(*(column.icontains(word, autoescape=True) for column in columns)))
    total = session.scalar(select(func.count()).select_from(query.subquery())) or 0
    rows = session.scalars(query.order_by(PatientRow.name, PatientRow.id).limit(limit).offset(offset))
    return list(rows), total


def get(session: Session, patient_id: UUID) -> PatientRow:
    """One patient.

    :raises ProblemError: 404.
    """
    row = session.get(PatientRow, patient_id)
    if row is None:
        raise not_found("patient")
    return row


def create(session: Session, patient: PatientCreate) -> PatientRow:
    """Sign a patient up.

    :raises ProblemError: 409 when the clinic number is taken.
    """
    now = utc_now()
    row = PatientRow(id=uuid4(), created_at=now, updated_at=now, archived_at=None, **patient.model_dump())
    session.add(row)
    _flush(session, patient.clinic_number)
    return row


def update(session: Session, patient_id: UUID, change: PatientUpdate) -> PatientRow:
    """Change what is given, leave the rest.

    :raises ProblemError: 404; 409 when somebody else changed it meanwhile, or the clinic number is taken.
    """
    row = get(session, patient_id)
    if change.updated_at and change.updated_at != row.updated_at:
        raise ProblemError(
            409,
            "edited_meanwhile",
            "Somebody else has changed this record in the meantime.",
            "Reload it, and make your change again.",
        )
    given = change.model_dump(exclude_unset=True, exclude={"archived", "updated_at"})
    for name, value in given.items():
        if value is not None or name in _MAY_BE_EMPTIED:
            setattr(row, name, value)
    if change.archived is not None:
        row.archived_at = (row.archived_at or utc_now()) if change.archived else None
    row.updated_at = utc_now()
    _flush(session, row.clinic_number)
    return row


def _flush(session: Session, clinic_number: str) -> None:
    try:
        session.flush()
    except IntegrityError as error:
        raise ProblemError(
            409,
            "number_taken",
            f"Another patient has the clinic number {clinic_number}.",
            "Choose another number, or look the patient up: archived ones keep theirs.",
        ) from error
