"""Requests for erasure and their decisions. An erasure removes identifying data; motions and measurements remain anonymously.

The caller commits.
"""

from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import Select, delete, select, update
from sqlalchemy.orm import Session

from kata.clinic import texts as clinic_texts
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.contraindications.tables import ContraindicationRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import ErasureRow, ExportedStatementRow, PatientRow
from kata.clinic.programmes.tables import ProgrammeRow, ProgrammeVersionRow
from kata.clinic.recordings.tables import RecordingRow, TeachingRow
from kata.clinic.sessions.tables import AddendumRow, SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError, not_found
from kata.interop import service, texts
from kata.interop.schemas import ErasureConsent, ErasureRefusal, ErasureRequest

ERASED_NAME: Final = "Erased"


def of_patient(session: Session, patient_id: UUID) -> list[ErasureRow]:
    """Return a patient's requests, oldest first.

    :raises ProblemError: 404.
    """
    patients.get(session, patient_id)
    query = select(ErasureRow).where(ErasureRow.patient_id == patient_id)
    return list(session.scalars(query.order_by(ErasureRow.asked_at, ErasureRow.id)))


def undecided(session: Session, hidden: Select[UUID]) -> list[ErasureRow]:
    """Return the undecided requests, oldest first, except those of ``hidden`` patients (a query of ids)."""
    query = select(ErasureRow).where(ErasureRow.decided_at.is_(None), ErasureRow.patient_id.not_in(hidden))
    return list(session.scalars(query.order_by(ErasureRow.asked_at, ErasureRow.id)))


def request(session: Session, patient_id: UUID, erasure_request: ErasureRequest) -> ErasureRow:
    """Store a request.

    :raises ProblemError: 404; 409 when a request is already open, or the record is erased.
    """
    patients.get(session, patient_id, to_change=True)
    service.identified_patient(session, patient_id)
    if any(row.decided_at is None for row in of_patient(session, patient_id)):
        raise ProblemError(409, "already_asked", texts.ERASURE_ALREADY_REQUESTED(), texts.DECIDE_THAT_REQUEST())
    row = ErasureRow(
        id=uuid4(),
        patient_id=patient_id,
        asked_at=utc_now(),
        reason=erasure_request.reason,
        noted_by=erasure_request.noted_by,
    )
    session.add(row)
    session.flush()
    return row


def refuse(session: Session, erasure_id: UUID, refusal: ErasureRefusal) -> ErasureRow:
    """Refuse a request and store the reason.

    :raises ProblemError: 404; 409 when the request is already decided.
    """
    row = _open(session, erasure_id)
    row.decided_at, row.decided_by = utc_now(), refusal.decided_by
    row.decision, row.explanation = "refused", refusal.explanation
    return row


def erase(session: Session, erasure_id: UUID, consent: ErasureConsent) -> ErasureRow:
    """Erase name, reading, birth date, clinic number and all free texts permanently.

    :raises ProblemError: 404; 409 when the request is already decided or a session is open; 422 when the number is not the patient's.
    """
    row = _open(session, erasure_id)
    patient = patients.get(session, row.patient_id, to_change=True)
    if consent.clinic_number.strip() != patient.clinic_number:
        raise ProblemError(
            422,
            "other_number",
            texts.CLINIC_NUMBER_WRONG(),
            texts.COMPARE_NAME_AND_NUMBER(),
            [("#/clinic_number", texts.CLINIC_NUMBER_WRONG_FIELD())],
        )
    open_sessions = select(SessionRow.id).where(SessionRow.patient_id == patient.id, SessionRow.ended_at.is_(None))
    if session.scalars(open_sessions).first():
        raise ProblemError(409, "session_open", texts.PATIENT_SESSION_OPEN(), clinic_texts.END_FIRST())
    now = utc_now()
    _remove_identifying_data(session, patient)
    patient.erased_at, patient.updated_at = now, now
    patient.archived_at = patient.archived_at or now
    for request_row in of_patient(session, patient.id):
        # The texts of a request may name the patient.
        request_row.reason = request_row.explanation = ""
    row.decided_at, row.decided_by = now, consent.decided_by
    row.decision, row.explanation = "erased", consent.explanation
    session.flush()
    return row


def _open(session: Session, erasure_id: UUID) -> ErasureRow:
    row = session.get(ErasureRow, erasure_id, with_for_update=True)
    if row is None:
        raise not_found(texts.ERASURE_REQUEST_NOT_FOUND)
    if row.decided_at:
        raise ProblemError(409, "decided", texts.ERASURE_DECIDED(), texts.RELOAD_PAGE())
    return row


def _remove_identifying_data(session: Session, patient: PatientRow) -> None:
    patient.name = ERASED_NAME
    patient.clinic_number = f"erased-{patient.id.hex[:24]}"
    patient.kana = patient.birth_date = None
    patient.notes = ""
    episodes = select(EpisodeRow.id).where(EpisodeRow.patient_id == patient.id)
    programmes = select(ProgrammeRow.id).where(ProgrammeRow.episode_id.in_(episodes))
    clinic_sessions = select(SessionRow.id).where(SessionRow.patient_id == patient.id)
    for statement in (
        update(EpisodeRow)
        .where(EpisodeRow.patient_id == patient.id)
        .values(diagnosis="", contraindications="", closing_note=""),
        update(ContraindicationRow).where(ContraindicationRow.patient_id == patient.id).values(note="", resolution=""),
        update(ProgrammeRow).where(ProgrammeRow.episode_id.in_(episodes)).values(name="Programme"),
        update(ProgrammeVersionRow).where(ProgrammeVersionRow.programme_id.in_(programmes)).values(note=""),
        update(AssessmentRow).where(AssessmentRow.episode_id.in_(episodes)).values(note=""),
        update(SessionRow).where(SessionRow.patient_id == patient.id).values(note=""),
        update(AddendumRow).where(AddendumRow.session_id.in_(clinic_sessions)).values(text=""),
        update(TeachingRow).where(TeachingRow.patient_id == patient.id).values(name="Recording"),
        delete(ExportedStatementRow).where(ExportedStatementRow.patient_id == patient.id),
        update(RecordingRow).where(RecordingRow.patient_id == patient.id).values(name="Recording", note=""),
    ):
        session.execute(statement, execution_options={"synchronize_session": False})
