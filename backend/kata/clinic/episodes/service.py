"""What is done with episodes of care. Commits nothing: the request does."""

from datetime import date
from typing import Final
from uuid import UUID, uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.episodes.schemas import EpisodeClose, EpisodeCreate, EpisodeUpdate, StageCreate
from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.patients import service as patients
from kata.clinic.patients.tables import PatientRow
from kata.clinic.sessions.tables import SessionRow
from kata.database.base import utc_now
from kata.errors import ProblemError, check_version, not_found

_MAY_BE_EMPTIED: Final = {"onset_on", "max_load_level", "max_speed_deg_s"}


def of_patient(session: Session, patient_id: UUID) -> list[EpisodeRow]:
    """A patient's episodes: those that go on first, then the newest first.

    :raises ProblemError: 404.
    """
    newest_first = reversed(patients.get(session, patient_id).episodes)
    return sorted(newest_first, key=lambda row: row.closed_at is not None)


def get(session: Session, episode_id: UUID) -> EpisodeRow:
    """One episode.

    :raises ProblemError: 404.
    """
    row = session.get(EpisodeRow, episode_id)
    if row is None:
        raise not_found("episode")
    return row


def going_on(session: Session, patient_id: UUID, side: str) -> EpisodeRow | None:
    """The open episode of a shoulder: there is one at most."""
    query = select(EpisodeRow).where(EpisodeRow.patient_id == patient_id, EpisodeRow.side == side)
    return session.scalars(query.where(EpisodeRow.closed_at.is_(None))).first()


def open_new(session: Session, patient_id: UUID, wanted: EpisodeCreate) -> EpisodeRow:
    """Begin the care of a shoulder.

    :raises ProblemError: 404; 409 for an archived patient, and while that shoulder's episode goes on; 422 where limits have no
        doctor, or a day lies before birth.
    """
    patient = patients.get(session, patient_id, to_change=True)
    _may_open(session, patient, wanted.side)
    now = utc_now()
    row = EpisodeRow(id=uuid4(), patient_id=patient_id, opened_at=now, updated_at=now, **wanted.model_dump())
    _check(row, patient)
    session.add(row)
    session.flush()
    session.refresh(row)
    return row


def change(session: Session, episode_id: UUID, given: EpisodeUpdate) -> EpisodeRow:
    """Change what is given, leave the rest.

    :raises ProblemError: 404; 409 when it is closed, or somebody else changed it meanwhile; 422 where limits have no doctor, or
        the onset lies before birth.
    """
    row, patient = _to_change(session, episode_id)
    _must_go_on(row)
    check_version(row.updated_at, given.updated_at)
    for name, value in given.model_dump(exclude_unset=True, exclude={"updated_at"}).items():
        if value is not None or name in _MAY_BE_EMPTIED:
            setattr(row, name, value)
    _check(row, patient)
    row.updated_at = utc_now()
    return row


def close(session: Session, episode_id: UUID, given: EpisodeClose) -> EpisodeRow:
    """End the care of a shoulder, once.

    :raises ProblemError: 404; 409 when it is closed, somebody else changed it meanwhile, or a session in it is open.
    """
    row, _ = _to_change(session, episode_id)
    _must_go_on(row)
    check_version(row.updated_at, given.updated_at)
    unended = select(SessionRow.id).where(SessionRow.episode_id == episode_id, SessionRow.ended_at.is_(None))
    if session.scalars(unended.limit(1)).first():
        raise ProblemError(
            409, "session_open", "A session of this episode has not ended.", "End the session, then close the episode."
        )
    row.closed_at = row.updated_at = utc_now()
    row.closing_note = given.closing_note
    return row


def reopen(session: Session, episode_id: UUID) -> EpisodeRow:
    """Go on with it; the closing note stays to be read, and is written anew at the next closing.

    :raises ProblemError: 404; 409 for an archived patient, and while an episode of that shoulder goes on.
    """
    row, patient = _to_change(session, episode_id)
    _may_open(session, patient, row.side)
    row.closed_at = None
    row.updated_at = utc_now()
    return row


def add_stage(session: Session, episode_id: UUID, given: StageCreate) -> EpisodeRow:
    """Note that from a day on the shoulder is in a stage.

    :raises ProblemError: 404; 409 when the episode is closed, or a stage is noted for that day already; 422 before birth.
    """
    row, patient = _to_change(session, episode_id)
    _must_go_on(row)
    _not_before_birth(given.since, patient, "the stage")
    if any(stage.since == given.since for stage in row.stages):
        raise ProblemError(
            409, "stage_noted", "A stage is noted for that day already.", "Remove that one first, or give another day."
        )
    session.add(StageRow(id=uuid4(), episode_id=episode_id, noted_at=utc_now(), **given.model_dump()))
    session.flush()
    session.refresh(row)
    return row


def remove_stage(session: Session, episode_id: UUID, stage_id: UUID) -> EpisodeRow:
    """Take back a stage that was noted by mistake.

    :raises ProblemError: 404; 409 when the episode is closed.
    """
    row, _ = _to_change(session, episode_id)
    _must_go_on(row)
    stage = next((stage for stage in row.stages if stage.id == stage_id), None)
    if stage is None:
        raise not_found("stage")
    session.delete(stage)
    session.flush()
    session.refresh(row)
    return row


def _to_change(session: Session, episode_id: UUID) -> tuple[EpisodeRow, PatientRow]:
    """With its patient, whose record nobody else changes until this is committed: of two who open one, the second is told."""
    patient_id = get(session, episode_id).patient_id
    patient = patients.get(session, patient_id, to_change=True)
    patients.check_not_erased(patient)
    row = get(session, episode_id)
    session.refresh(row)
    return row, patient


def _may_open(session: Session, patient: PatientRow, side: str) -> None:
    if patient.archived_at:
        raise ProblemError(409, "archived", f"{patient.name} is archived.", "Restore the patient's record first.")
    if going_on(session, patient.id, side):
        raise ProblemError(
            409,
            "episode_open",
            f"The care of the {side} shoulder goes on already.",
            "Go on with that episode, or close it first.",
        )


def _must_go_on(row: EpisodeRow) -> None:
    if row.closed_at:
        raise ProblemError(409, "episode_closed", "This episode is closed.", "Reopen it first.")


def _check(row: EpisodeRow, patient: PatientRow) -> None:
    if (row.limits or row.max_load_level or row.max_speed_deg_s) and not row.limits_by:
        raise ProblemError(
            422,
            "limits_by_nobody",
            "It is not said which doctor set the limits.",
            "Write the doctor's name beside them.",
        )
    if row.onset_on:
        _not_before_birth(row.onset_on, patient, "onset")


def _not_before_birth(day: date, patient: PatientRow, what: str) -> None:
    if patient.birth_date and day < patient.birth_date:
        raise ProblemError(
            422,
            "before_birth",
            f"The day of {what} lies before the patient's birth, {patient.birth_date}.",
            "Correct the day, or the birth date.",
        )
