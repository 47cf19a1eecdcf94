"""Give a browser to a patient, and store the answers. The caller commits.

The locked screen limits the login session. The service refuses everything except the state of the apparatus without a patient, Stop,
unlocking, and this questionnaire.
"""

from datetime import datetime
from uuid import UUID

from sqlalchemy.orm import Session

from kata.actor import Actor
from kata.auth import login_session
from kata.auth.tables import LoginSessionRow
from kata.clinic import texts
from kata.clinic.assessments import service as assessments
from kata.clinic.assessments.schemas import AssessmentCreate
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.patient_mode.schemas import (
    AnswerOption,
    PatientAnswers,
    PatientModeStart,
    PatientQuestion,
    PatientQuestionnaire,
)
from kata.clinic.patient_mode.tables import PatientModeRow
from kata.clinic.questionnaires.definitions import DEFINITIONS, Definition
from kata.clinic.questionnaires.tables import QuestionnaireTextsRow
from kata.errors import ProblemError, not_found
from kata.types import Side, side_of

_Mode = tuple[PatientModeRow, Definition, QuestionnaireTextsRow, Side]


def start(session: Session, actor: Actor, episode_id: UUID, requested: PatientModeStart, now: datetime) -> None:
    """Give this browser to the patient: lock its screen and show the questionnaire.

    :raises ProblemError: 404; 409 when the texts are missing, for an archived patient, and for a demonstration account.
    """
    assessments.check_not_archived(session, assessments.episode_of(session, episode_id))
    definition = DEFINITIONS.get(requested.questionnaire)
    if definition is None or session.get(QuestionnaireTextsRow, (requested.questionnaire, requested.language)) is None:
        raise ProblemError(409, "no_texts", texts.NO_LICENSED_TEXTS(), texts.IMPORT_LICENSED_TEXTS())
    login_session.lock(session, actor.login_session_id, now)
    session.merge(
        PatientModeRow(
            login_session_id=actor.login_session_id,
            episode_id=episode_id,
            questionnaire=definition.code,
            language=requested.language,
            answers=[None] * len(definition.item_scales),
            started_at=now,
            finished_at=None,
        )
    )


def present(session: Session, actor: Actor) -> PatientQuestionnaire | None:
    """Return the questionnaire of this browser, or None if it is not in the patient's mode."""
    mode = _find(session, actor)
    return _as_questionnaire(mode) if mode else None


def _as_questionnaire(mode: _Mode) -> PatientQuestionnaire:
    row, definition, words, side = mode
    questions = [
        PatientQuestion(
            text=item["text"],
            options=[
                AnswerOption(answer=answer, label=item["options"].get(str(answer), ""))
                for answer in range(scale.lowest, scale.highest + 1)
            ],
        )
        for item, scale in zip(words.items, definition.item_scales, strict=True)
    ]
    return PatientQuestionnaire(
        title=words.title,
        side=side,
        language=row.language,
        copyright=words.copyright,
        questions=questions,
        answers=row.answers,
        finished=row.finished_at is not None,
    )


def answer(session: Session, actor: Actor, patient_answers: PatientAnswers, now: datetime) -> PatientQuestionnaire:
    """Store the answers so far; when the patient has finished, store them as an assessment. Return the questionnaire.

    :raises ProblemError: 404 when the browser is not in the patient's mode; 409 when the questionnaire is already finished; 422 for answers
        that an item does not have.
    """
    mode = _find(session, actor)
    if mode is None:
        raise not_found(texts.NO_PATIENT_MODE)
    row, definition, *_ = mode
    if row.finished_at:
        raise ProblemError(409, "finished", texts.QUESTIONNAIRE_FINISHED(), texts.GIVE_TABLET_BACK())
    if not definition.fits(patient_answers.answers):
        raise ProblemError(422, "answers_unfit", texts.ANSWERS_DO_NOT_FIT(), texts.RELOAD_QUESTIONNAIRE())
    row.answers = list(patient_answers.answers)
    if patient_answers.finished:
        row.answers, row.finished_at = [], now
        # Without any answer there is no finding.
        if any(given_answer is not None for given_answer in patient_answers.answers):
            _store(session, row.episode_id, definition, list(patient_answers.answers), actor.name, now)
    return _as_questionnaire(mode)


def _store(
    session: Session, episode_id: UUID, definition: Definition, answers: list[int | None], by: str, now: datetime
) -> AssessmentRow:
    if definition.code == "spadi":
        return assessments.create(session, episode_id, AssessmentCreate(assessed_at=now, assessed_by=by, spadi=answers))
    assessment = AssessmentCreate.model_construct(assessed_at=now, assessed_by=by, rom=[], spadi=None, note="")
    return assessments.create(session, episode_id, assessment, questionnaires={definition.code: answers})


def _find(session: Session, actor: Actor) -> _Mode | None:
    row = session.get(PatientModeRow, actor.login_session_id, with_for_update=True)
    if row is None or not actor.locked:
        return None
    # Unlocking authenticates the user again and so ends the mode, because a later lock must not show an old questionnaire.
    if session.get_one(LoginSessionRow, actor.login_session_id).proved_at > row.started_at:
        return None
    definition = DEFINITIONS.get(row.questionnaire)
    words = session.get(QuestionnaireTextsRow, (row.questionnaire, row.language))
    side = side_of(assessments.episode_of(session, row.episode_id).side)
    return (row, definition, words, side) if definition and words else None
