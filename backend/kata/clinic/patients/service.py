"""Read and write patients. The caller commits."""

from collections.abc import Sequence
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import ColumnElement, Select, or_, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, joinedload

from kata.clinic import texts
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients.schemas import PatientCreate, PatientUpdate
from kata.clinic.patients.search import numbers_of, words_of
from kata.clinic.patients.tables import PatientRow
from kata.database.base import utc_now
from kata.errors import ProblemError, check_version, not_found
from kata.pagination import Keyset

_BY_NAME: Final = Keyset(tuple[str, UUID], PatientRow.sort_key, PatientRow.id)
_MAY_BE_EMPTIED: Final = {"kana", "birth_date", "dominant_side"}


def find(
    session: Session, *, search: str, archived: bool, limit: int, after: str | None, hidden: Select[UUID] | None = None
) -> tuple[Sequence[PatientRow], str | None]:
    """Return a page of patients found by name, kana, number or birth date, in their order (``sorting``), and the next cursor.

    Patients in ``hidden`` (a query of ids) are found only by their complete number.

    :raises ProblemError: 422 when ``after`` is not a valid cursor.
    """
    # Find the ids first, which needs only one index; then load one page of records.
    query = select(PatientRow.id)
    query = query.where(PatientRow.archived_at.is_not(None) if archived else PatientRow.archived_at.is_(None))
    for forms in words_of(search):
        query = query.where(or_(*(PatientRow.search_text.contains(form, autoescape=True) for form in forms)))
    if hidden is not None:
        is_shown: ColumnElement[bool] = PatientRow.id.not_in(hidden)
        if search.strip():
            # A separate query, so that the list still needs only its index.
            exactly_numbered = select(PatientRow.id).where(PatientRow.clinic_number.in_(numbers_of(search)))
            is_shown = or_(is_shown, PatientRow.id.in_(exactly_numbered))
        query = query.where(is_shown)
    page_ids = _BY_NAME.page(query, after, limit).subquery()
    records = (
        select(PatientRow).join(page_ids, page_ids.c.id == PatientRow.id).order_by(PatientRow.sort_key, PatientRow.id)
    )
    # One query, because a second one with the ids of the page would take longer than the join with a few episodes.
    rows = session.scalars(records.options(joinedload(PatientRow.episodes).lazyload(EpisodeRow.stages))).unique().all()
    return _BY_NAME.cut(rows, limit, lambda row: (row.sort_key, row.id))


def get(session: Session, patient_id: UUID, *, to_change: bool = False) -> PatientRow:
    """Return one patient. ``to_change`` locks the row until the commit.

    :raises ProblemError: 404.
    """
    row = session.get(PatientRow, patient_id, with_for_update=to_change or None)
    if row is None:
        raise not_found(texts.PATIENT_NOT_FOUND)
    return row


def create(session: Session, patient: PatientCreate) -> PatientRow:
    """Register a patient and open the episode of care.

    :raises ProblemError: 409 when the clinic number is taken.
    """
    now = utc_now()
    values = patient.model_dump(exclude={"affected_side"})
    row = PatientRow(id=uuid4(), created_at=now, updated_at=now, archived_at=None, **values)
    row.episodes = [EpisodeRow(id=uuid4(), side=patient.affected_side, opened_at=now, updated_at=now)]
    session.add(row)
    _flush(session, patient.clinic_number)
    return row


def update(session: Session, patient_id: UUID, change: PatientUpdate) -> PatientRow:
    """Change only the given fields.

    :raises ProblemError: 404; 409 when the record was changed meanwhile or was erased, or the clinic number is taken.
    """
    row = get(session, patient_id, to_change=True)
    check_not_erased(row)
    check_version(row.updated_at, change.updated_at)
    values = change.model_dump(exclude_unset=True, exclude={"archived", "updated_at"})
    for name, value in values.items():
        if value is not None or name in _MAY_BE_EMPTIED:
            setattr(row, name, value)
    if change.archived is not None:
        row.archived_at = (row.archived_at or utc_now()) if change.archived else None
    row.updated_at = utc_now()
    _flush(session, row.clinic_number)
    return row


def check_not_erased(row: PatientRow) -> None:
    """Reject writes to an erased patient.

    :raises ProblemError: 409.
    """
    if row.erased_at:
        raise ProblemError(409, "erased", texts.RECORD_ERASED(), texts.REGISTER_PATIENT_ANEW())


def _flush(session: Session, clinic_number: str) -> None:
    try:
        session.flush()
    except IntegrityError as error:
        raise ProblemError(
            409,
            "number_taken",
            texts.CLINIC_NUMBER_TAKEN(clinic_number=clinic_number),
            texts.CHOOSE_ANOTHER_CLINIC_NUMBER(),
        ) from error
