"""Read and write episodes of care. The caller commits."""

from datetime import date
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.episodes.schemas import EpisodeClose, EpisodeCreate, EpisodeUpdate, StageCreate
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import PatientRow
from kata.clinic.sessions.tables import SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError, check_version, not_found
from kata.messages import Template
from kata.motion.texts import SIDES

_MAY_BE_EMPTIED: Final = {"onset_on", "max_resistance_level", "max_speed_deg_s"}


def of_patient(session: Session, patient_id: UUID) -> list[EpisodeRow]:
    """Return a patient's episodes, open ones first, then newest first.

    :raises ProblemError: 404.
    """
    newest_first = reversed(patients.get(session, patient_id).episodes)
    return sorted(newest_first, key=lambda row: row.closed_at is not None)


def get(session: Session, episode_id: UUID) -> EpisodeRow:
    """Return one episode.

    :raises ProblemError: 404.
    """
    row = session.get(EpisodeRow, episode_id)
    if row is None:
        raise not_found(texts.EPISODE_NOT_FOUND)
    return row


def open_episode(session: Session, patient_id: UUID, side: str) -> EpisodeRow | None:
    """Return the open episode of a shoulder, or None. A shoulder has at most one."""
    query = select(EpisodeRow).where(EpisodeRow.patient_id == patient_id, EpisodeRow.side == side)
    return session.scalars(query.where(EpisodeRow.closed_at.is_(None))).first()


def open_new(session: Session, patient_id: UUID, episode: EpisodeCreate) -> EpisodeRow:
    """Open an episode of care.

    :raises ProblemError: 404; 409 for an archived patient, and while that shoulder has an open episode; 422 when limits have no doctor, a
        certainty has no diagnosis, or a day is before birth.
    """
    patient = patients.get(session, patient_id, to_change=True)
    _may_open(session, patient, episode.side)
    now = utc_now()
    row = EpisodeRow(id=uuid4(), patient_id=patient_id, opened_at=now, updated_at=now, **episode.model_dump())
    _check(row, patient)
    session.add(row)
    session.flush()
    session.refresh(row)
    return row


def change(session: Session, episode_id: UUID, update: EpisodeUpdate) -> EpisodeRow:
    """Change only the given fields.

    :raises ProblemError: 404; 409 when the episode is closed or was changed meanwhile; 422 when limits have no doctor, a certainty has no
        diagnosis, or the onset is before birth.
    """
    row, patient = _to_change(session, episode_id)
    _must_go_on(row)
    check_version(row.updated_at, update.updated_at)
    for name, value in update.model_dump(exclude_unset=True, exclude={"updated_at"}).items():
        if value is not None or name in _MAY_BE_EMPTIED:
            setattr(row, name, value)
    _check(row, patient)
    row.updated_at = utc_now()
    return row


def close(session: Session, episode_id: UUID, closing: EpisodeClose) -> EpisodeRow:
    """Close an episode of care.

    :raises ProblemError: 404; 409 when the episode is closed, was changed meanwhile, or has an open session.
    """
    row, _ = _to_change(session, episode_id)
    _must_go_on(row)
    check_version(row.updated_at, closing.updated_at)
    unended = select(SessionRow.id).where(SessionRow.episode_id == episode_id, SessionRow.ended_at.is_(None))
    if session.scalars(unended.limit(1)).first():
        raise ProblemError(409, "session_open", texts.EPISODE_SESSION_OPEN(), texts.END_SESSION_THEN_CLOSE())
    row.closed_at = row.updated_at = utc_now()
    row.closing_note = closing.closing_note
    return row


def reopen(session: Session, episode_id: UUID) -> EpisodeRow:
    """Reopen an episode. The closing note stays until the episode is closed again.

    :raises ProblemError: 404; 409 for an archived patient, and while that shoulder has an open episode.
    """
    row, patient = _to_change(session, episode_id)
    _may_open(session, patient, row.side)
    row.closed_at = None
    row.updated_at = utc_now()
    return row


def add_stage(session: Session, episode_id: UUID, new_stage: StageCreate) -> EpisodeRow:
    """Record the stage of the shoulder from a given day on.

    :raises ProblemError: 404; 409 when the episode is closed, or a stage is already recorded for that day; 422 when the day is before
        birth.
    """
    row, patient = _to_change(session, episode_id)
    _must_go_on(row)
    _not_before_birth(new_stage.since, patient, texts.STAGE_BEFORE_BIRTH)
    if any(stage.since == new_stage.since for stage in row.stages):
        raise ProblemError(409, "stage_noted", texts.STAGE_NOTED(), texts.REMOVE_STAGE_OR_OTHER_DAY())
    session.add(StageRow(id=uuid4(), episode_id=episode_id, noted_at=utc_now(), **new_stage.model_dump()))
    session.flush()
    session.refresh(row)
    return row


def remove_stage(session: Session, episode_id: UUID, stage_id: UUID) -> EpisodeRow:
    """Remove a stage that was recorded by mistake.

    :raises ProblemError: 404; 409 when the episode is closed.
    """
    row, _ = _to_change(session, episode_id)
    _must_go_on(row)
    stage = next((stage for stage in row.stages if stage.id == stage_id), None)
    if stage is None:
        raise not_found(texts.STAGE_NOT_FOUND)
    session.delete(stage)
    session.flush()
    session.refresh(row)
    return row


def _to_change(session: Session, episode_id: UUID) -> tuple[EpisodeRow, PatientRow]:
    """Return the episode with its patient.

    The patient's row is locked until the commit, so that of two requests that open an episode, the second is refused.
    """
    patient_id = get(session, episode_id).patient_id
    patient = patients.get(session, patient_id, to_change=True)
    patients.check_not_erased(patient)
    row = get(session, episode_id)
    session.refresh(row)
    return row, patient


def _may_open(session: Session, patient: PatientRow, side: str) -> None:
    if patient.archived_at:
        raise ProblemError(409, "archived", texts.PATIENT_ARCHIVED(patient=patient.name), texts.RESTORE_PATIENT_FIRST())
    if open_episode(session, patient.id, side):
        raise ProblemError(
            409,
            "episode_open",
            texts.EPISODE_OPEN(side=SIDES[side]),
            texts.CONTINUE_OR_CLOSE_EPISODE(),
        )


def _must_go_on(row: EpisodeRow) -> None:
    if row.closed_at:
        raise ProblemError(409, "episode_closed", texts.EPISODE_CLOSED(), texts.REOPEN_FIRST())


def _check(row: EpisodeRow, patient: PatientRow) -> None:
    limited = row.limits or row.max_resistance_level or row.max_speed_deg_s or row.self_paced_permitted
    if limited and not row.limits_by:
        raise ProblemError(
            422,
            "limits_by_nobody",
            texts.LIMITS_WITHOUT_DOCTOR(),
            texts.WRITE_DOCTOR_NAME(),
        )
    if row.verification and not (row.diagnosis or row.diagnosis_code):
        raise ProblemError(422, "no_diagnosis", texts.CERTAINTY_WITHOUT_DIAGNOSIS(), texts.WRITE_DIAGNOSIS())
    if row.onset_on:
        _not_before_birth(row.onset_on, patient, texts.ONSET_BEFORE_BIRTH)


def _not_before_birth(day: date, patient: PatientRow, message: Template) -> None:
    if patient.birth_date and day < patient.birth_date:
        raise ProblemError(
            422,
            "before_birth",
            message(birth_date=patient.birth_date),
            texts.CORRECT_DAY_OR_BIRTH_DATE(),
        )
