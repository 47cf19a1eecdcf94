"""Invented texts of questionnaires, in the form in which a clinic imports licensed ones."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest

from kata.clinic.questionnaires import service
from kata.clinic.questionnaires.definitions import DEFINITIONS, clinic_folder, use_folder
from kata.clinic.questionnaires.licensed_texts import read_texts
from kata.database.base import utc_now
from kata.database.engine import Database
from tests.support.paths import ROOT

PROMIS: Final = "promis_upper_extremity_7a"
TEMPLATE: Final = ROOT / f"docs/questionnaires/{PROMIS}.toml"
T_SCORES: Final = tuple(20.0 + number for number in range(29))
"""Invented: the real table is not ours to pass on."""

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


def promis_file(file: Path) -> Path:
    """Write the published template of a PROMIS short form with an invented table."""
    table = ", ".join(str(score) for score in T_SCORES)
    text = TEMPLATE.read_text().replace("conversion = []", f"conversion = [{table}]")
    file.write_text(text.replace("highest_total = 0", f"highest_total = {T_SCORES[-1]}"))
    return file


@pytest.fixture
def clinics_promis(tmp_path: Path) -> Iterator[Path]:
    """Let the clinic have a PROMIS short form. Return its folder of definitions."""
    folder = clinic_folder(tmp_path)
    folder.mkdir()
    promis_file(folder / f"{PROMIS}.toml")
    use_folder(folder)
    yield folder
    use_folder(folder / "nothing")
