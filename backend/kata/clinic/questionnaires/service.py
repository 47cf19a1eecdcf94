"""Store licensed texts, and list the questionnaires. The caller commits."""

from datetime import datetime

import msgspec
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.clinic.questionnaires.definitions import DEFINITIONS, Definition, Threshold
from kata.clinic.questionnaires.licensed_texts import LicensedTexts
from kata.clinic.questionnaires.schemas import ChangeThreshold, Questionnaire
from kata.clinic.questionnaires.tables import QuestionnaireTextsRow


def store_texts(
    session: Session, code: str, licensed: LicensedTexts, now: datetime, *, may_be_exported: bool
) -> QuestionnaireTextsRow:
    """Store the texts of a questionnaire in one language. They replace earlier ones."""
    return session.merge(
        QuestionnaireTextsRow(
            questionnaire=code,
            language=licensed.language,
            title=licensed.title,
            copyright=licensed.copyright,
            items=msgspec.to_builtins(licensed.items),
            may_be_exported=may_be_exported,
            imported_at=now,
        )
    )


def questionnaires(session: Session) -> list[Questionnaire]:
    """Return every questionnaire with the languages of its imported texts."""
    languages: dict[str, list[str]] = {}
    for code, language in session.execute(select(QuestionnaireTextsRow.questionnaire, QuestionnaireTextsRow.language)):
        languages.setdefault(code, []).append(language)
    return [
        _as_questionnaire(definition, sorted(languages.get(definition.code, []))) for definition in DEFINITIONS.values()
    ]


def _as_questionnaire(definition: Definition, languages: list[str]) -> Questionnaire:
    return Questionnaire(
        code=definition.code,
        title=definition.title,
        highest_points=definition.highest_total,
        better=definition.better,
        items=len(definition.item_scales),
        most_unanswered=definition.most_unanswered,
        scoring_source=definition.scoring_source,
        copyright=definition.copyright,
        important=_threshold(definition.important),
        detectable=_threshold(definition.detectable),
        languages=languages,
    )


def _threshold(threshold: Threshold) -> ChangeThreshold:
    return ChangeThreshold(points=threshold.points, up_to_points=threshold.up_to, source=threshold.source)
