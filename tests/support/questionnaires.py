"""Invented texts of questionnaires, in the form in which a clinic imports licensed ones."""

import json
from typing import Any

from kata.clinic.questionnaires import service
from kata.clinic.questionnaires.definitions import DEFINITIONS
from kata.clinic.questionnaires.licensed_texts import read_texts
from kata.database.base import utc_now
from kata.database.engine import Database

_WORDS = {
    "en": (
        "Invented questions",
        "Invented for the tests; nobody's text.",
        "Invented question {}",
        "Not at all",
        "As much as can be",
    ),
    "ja": ("架空の質問", "試験用の架空の文面。", "架空の質問{}", "まったくない", "これ以上ないほど"),
}


def words_of(code: str, language: str) -> dict[str, Any]:
    """Return a FHIR Questionnaire with a text for every item of a definition."""
    title, owner, question, least, most = _WORDS[language]
    items = [
        {
            "linkId": str(number),
            "type": "integer",
            "text": question.format(number),
            "answerOption": [
                {"valueCoding": {"code": str(scale.lowest), "display": least}},
                {"valueCoding": {"code": str(scale.highest), "display": most}},
            ],
        }
        for number, scale in enumerate(DEFINITIONS[code].item_scales, start=1)
    ]
    return {"resourceType": "Questionnaire", "language": language, "title": title, "copyright": owner, "item": items}


def store_words(database: Database, code: str, language: str) -> None:
    """Import the invented texts of a questionnaire."""
    given = read_texts(json.dumps(words_of(code, language)).encode(), DEFINITIONS[code])
    with database.write() as session:
        service.store_texts(session, code, given, utc_now(), may_be_exported=False)
