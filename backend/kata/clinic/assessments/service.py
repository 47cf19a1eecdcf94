"""Read and write assessments. The caller commits."""

from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime, timedelta
from typing import Any, Final
from uuid import UUID, uuid4

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from kata.clinic import texts
from kata.clinic.assessments import rom, spadi
from kata.clinic.assessments.schemas import (
    Assessment,
    AssessmentCreate,
    AssessmentForm,
    AssessmentUpdate,
    QuestionnaireScore,
    RomEntry,
    RomMeasure,
    RomZero,
    SpadiItem,
    SpadiScore,
    has_findings,
)
from kata.clinic.assessments.tables import AssessmentRow, RomRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.patients import service as patients
from kata.clinic.questionnaires.definitions import DEFINITIONS, score
from kata.database.base import utc_now
from kata.errors import ProblemError, check_version, not_found
from kata.pagination import Keyset

_NEWEST_FIRST: Final = Keyset(tuple[datetime, UUID], AssessmentRow.assessed_at, AssessmentRow.id, descending=True)
_MAY_BE_EMPTIED: Final = {"pain_rest", "pain_active", "pain_passive", "pain_average", "spadi"}


def form() -> AssessmentForm:
    """Return the content of the form."""
    measures = [
        RomMeasure(
            motion=measure.motion,
            position=measure.position,
            name=measure.english,
            name_ja=measure.japanese,
            lowest_deg=measure.lowest_deg,
            highest_deg=measure.highest_deg,
            reference_deg=measure.reference_deg,
            other_zero=RomZero(**asdict(measure.other_zero)) if measure.other_zero else None,
        )
        for measure in rom.MEASURES
    ]
    items = [SpadiItem(subscale=item.subscale, text=item.english, text_ja=item.japanese) for item in spadi.ITEMS]
    perhaps, surely = spadi.IMPORTANT_CHANGE
    return AssessmentForm(
        rom=measures,
        spadi=items,
        spadi_mcid_lower=perhaps,
        spadi_mcid_upper=surely,
        spadi_mdc=spadi.DETECTABLE_CHANGE,
    )


def episode_of(session: Session, episode_id: UUID) -> EpisodeRow:
    """Return the episode.

    :raises ProblemError: 404.
    """
    row = session.get(EpisodeRow, episode_id)
    if row is None:
        raise not_found(texts.EPISODE_NOT_FOUND)
    return row


def get(session: Session, assessment_id: UUID) -> AssessmentRow:
    """Return one assessment.

    :raises ProblemError: 404.
    """
    row = session.get(AssessmentRow, assessment_id)
    if row is None:
        raise not_found(texts.ASSESSMENT_NOT_FOUND)
    return row


def of_episode(
    session: Session, episode_id: UUID, limit: int, after: str | None
) -> tuple[Sequence[AssessmentRow], str | None, AssessmentRow | None]:
    """Return a page of an episode's assessments (newest first), the next cursor and the first assessment that was not withdrawn.

    :raises ProblemError: 404; 422 when ``after`` is not a valid cursor.
    """
    episode_of(session, episode_id)
    rows, further = _find(session, AssessmentRow.episode_id == episode_id, limit, after)
    first = (
        select(AssessmentRow)
        .where(AssessmentRow.episode_id == episode_id, AssessmentRow.withdrawn_at.is_(None))
        .order_by(AssessmentRow.assessed_at, AssessmentRow.id)
        .limit(1)
    )
    return rows, further, session.scalars(first).first()


def of_patient(
    session: Session, patient_id: UUID, limit: int, after: str | None
) -> tuple[Sequence[AssessmentRow], str | None]:
    """Return a page of the assessments of all of a patient's episodes (newest first) and the next cursor.

    :raises ProblemError: 404; 422 when ``after`` is not a valid cursor.
    """
    episodes = [episode.id for episode in patients.get(session, patient_id).episodes]
    return _find(session, AssessmentRow.episode_id.in_(episodes), limit, after)


def check_not_archived(session: Session, episode: EpisodeRow) -> None:
    """Check that the patient of an episode is not archived.

    :raises ProblemError: 409.
    """
    patient = patients.get(session, episode.patient_id)
    if patient.archived_at:
        raise ProblemError(409, "archived", texts.PATIENT_ARCHIVED(patient=patient.name), texts.RESTORE_PATIENT_FIRST())


def _check_birth(session: Session, episode: EpisodeRow, assessed_at: datetime) -> None:
    born = patients.get(session, episode.patient_id).birth_date
    # The day of a time differs by at most one between time zones.
    if born and (assessed_at + timedelta(days=1)).date() < born:
        message = texts.ASSESSMENT_BEFORE_BIRTH(birth_date=born)
        raise ProblemError(422, "before_birth", message, texts.CORRECT_DAY_OR_BIRTH_DATE())


def create(
    session: Session,
    episode_id: UUID,
    assessment: AssessmentCreate,
    questionnaires: dict[str, list[int | None]] | None = None,
) -> AssessmentRow:
    """Store an assessment.

    ``questionnaires``: answers by code, for questionnaires other than the SPADI.

    :raises ProblemError: 404; 409 for an archived patient; 422 when it is before birth.
    """
    episode = episode_of(session, episode_id)
    check_not_archived(session, episode)
    _check_birth(session, episode, assessment.assessed_at)
    row = AssessmentRow(
        id=uuid4(),
        episode_id=episode_id,
        updated_at=utc_now(),
        withdrawn_at=None,
        rom=_rows(assessment.rom),
        spadi_score=spadi.total(assessment.spadi),
        questionnaires=questionnaires or {},
        **assessment.model_dump(exclude={"rom"}),
    )
    session.add(row)
    session.flush()
    return row


def change(session: Session, assessment_id: UUID, update: AssessmentUpdate) -> AssessmentRow:
    """Change only the given fields.

    :raises ProblemError: 404; 409 when the assessment was changed meanwhile or was withdrawn; 422 when it would contain no finding, or is
        before birth.
    """
    row = _to_change(session, assessment_id, update.updated_at)
    if row.withdrawn_at:
        raise ProblemError(409, "withdrawn", texts.ASSESSMENT_WITHDRAWN(), texts.ENTER_NEW_ASSESSMENT())
    if update.assessed_at:
        _check_birth(session, episode_of(session, row.episode_id), update.assessed_at)
    for name, value in update.model_dump(exclude_unset=True, exclude={"rom", "updated_at"}).items():
        if value is not None or name in _MAY_BE_EMPTIED:
            setattr(row, name, value)
    if update.rom is not None:
        row.rom = _rows(update.rom)
    if not has_findings(as_assessment(row)):
        raise ProblemError(422, "nothing_found", texts.ASSESSMENT_WOULD_BE_EMPTY(), texts.WITHDRAW_IF_MISTAKEN())
    row.spadi_score = spadi.total(row.spadi)
    row.updated_at = utc_now()
    session.flush()
    return row


def withdraw(session: Session, assessment_id: UUID, seen_version: datetime) -> AssessmentRow:
    """Withdraw an assessment that was entered by mistake. It remains visible, but figures ignore it. A repeated call changes nothing.

    :raises ProblemError: 404; 409 when the assessment was changed meanwhile.
    """
    if (row := get(session, assessment_id)).withdrawn_at:
        return row
    row = _to_change(session, assessment_id, seen_version)
    row.withdrawn_at = row.updated_at = utc_now()
    session.flush()
    return row


def as_assessment(row: AssessmentRow) -> Assessment:
    """Return the response model.

    Measures that only another version knows are left out, so that the rest stays readable.
    """
    entries = sorted(row.rom, key=lambda row: (rom.place_of(row.motion, row.position), row.side, row.kind))
    scored = SpadiScore(**asdict(spadi.score(row.spadi))) if row.spadi else None
    return Assessment(
        id=row.id,
        episode_id=row.episode_id,
        assessed_at=row.assessed_at,
        assessed_by=row.assessed_by,
        rom=[_entry(entry) for entry in entries if rom.measure_of(entry.motion, entry.position)],
        pain_rest=row.pain_rest,
        pain_active=row.pain_active,
        pain_passive=row.pain_passive,
        pain_average=row.pain_average,
        spadi=row.spadi,
        spadi_score=scored,
        questionnaires=[_questionnaire_score(code, answers) for code, answers in row.questionnaires.items()],
        note=row.note,
        updated_at=row.updated_at,
        withdrawn_at=row.withdrawn_at,
    )


def _find(
    session: Session, condition: ColumnElement[bool], limit: int, after: str | None
) -> tuple[Sequence[AssessmentRow], str | None]:
    rows = session.scalars(_NEWEST_FIRST.page(select(AssessmentRow).where(condition), after, limit)).all()
    return _NEWEST_FIRST.cut(rows, limit, lambda row: (row.assessed_at, row.id))


def _to_change(session: Session, assessment_id: UUID, seen_version: datetime) -> AssessmentRow:
    """Return the assessment for a change. PostgreSQL locks the row, because two requests could otherwise change the same version. SQLite
    has one writer.
    """
    row = session.get(AssessmentRow, assessment_id, with_for_update=True, populate_existing=True)
    if row is None:
        raise not_found(texts.ASSESSMENT_NOT_FOUND)
    patients.check_not_erased(patients.get(session, episode_of(session, row.episode_id).patient_id))
    check_version(row.updated_at, seen_version)
    return row


def _questionnaire_score(code: str, answers: list[int | None]) -> QuestionnaireScore:
    """Return a stored questionnaire. It has no score if only another version knows the questionnaire."""
    definition = DEFINITIONS.get(code)
    fits = definition is not None and definition.fits(answers)
    return QuestionnaireScore(
        code=code,
        title=definition.title if definition else code,
        answers=answers,
        total_points=score(definition, answers).total if definition and fits else None,
        highest_points=definition.highest_total if definition else None,
        is_t_score=definition is not None and definition.total == "t_score",
    )


def _entry(row: RomRow) -> RomEntry:
    """Return a stored entry without validation, because other bounds may have applied when it was stored."""
    stored: dict[str, Any] = {"side": row.side, "motion": row.motion, "kind": row.kind, "position": row.position}
    return RomEntry.model_construct(**stored, angle_deg=row.angle_deg)


def _rows(entries: list[RomEntry]) -> list[RomRow]:
    return [RomRow(**entry.model_dump()) for entry in entries]
