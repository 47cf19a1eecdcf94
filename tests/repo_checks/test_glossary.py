"""The texts of page, service and reports use the words of the glossary, in both languages."""

import json
import re
from collections.abc import Iterator
from typing import Any, Final

import pytest

from docs.clinical import GLOSSARY, Term
from kata.reporting import note_draft_phrases
from kata.reporting.phrases import PHRASES
from tests.support.paths import ROOT, files

LOCALES: Final = ROOT / "frontend/src/locales"
_PARAMETER: Final = re.compile(r"\{\{?[^}]*\}\}?")


def _texts(part: Any, place: str) -> Iterator[tuple[str, str]]:
    if isinstance(part, dict | list):
        inner = part.items() if isinstance(part, dict) else enumerate(part)
        for name, value in inner:
            yield from _texts(value, f"{place}.{name}")
    else:
        yield place, str(part)


def _both() -> Iterator[tuple[str, str, str]]:
    """Yield every text of page, service and reports: its key, the English and the Japanese text."""
    for file in sorted((LOCALES / "en").glob("*.json")):
        japanese = dict(_texts(json.loads((LOCALES / "ja" / file.name).read_text()), file.stem))
        for key, english in _texts(json.loads(file.read_text()), file.stem):
            # A plural form that Japanese does not have.
            yield key, english, japanese.get(key) or japanese[re.sub("_one$", "_other", key)]
    japanese = json.loads((LOCALES / "ja/server.json").read_text())
    for key, english in json.loads((ROOT / "frontend/server-messages.json").read_text()).items():
        yield f"server.{key}", english, japanese[key]
    for key, (english, translated) in PHRASES.items():
        yield f"report.{key}", english, translated
    for key, (english, translated) in note_draft_phrases.PHRASES.items():
        yield f"note_draft.{key}", english, translated


PAIRS: Final = tuple(_both())
CHECKED: Final = [term for term in GLOSSARY.terms if term.pattern]


@pytest.mark.parametrize("term", CHECKED, ids=[term.english for term in CHECKED])
def test_a_term_has_its_japanese_word_everywhere(term: Term) -> None:
    """``left_out`` lists the texts whose Japanese does without the word, and none that has it."""
    having = [pair for pair in PAIRS if re.search(term.pattern, _PARAMETER.sub("", pair[1]), re.IGNORECASE)]
    assert having
    assert {key for key, _, japanese in having if not any(word in japanese for word in term.japanese)} == set(
        term.left_out
    )


def test_no_text_has_a_word_that_the_glossary_excludes() -> None:
    excluded = {word for term in GLOSSARY.terms for word in term.never}
    assert len(excluded) > 8
    texts = {key: japanese for key, _, japanese in PAIRS}
    texts["manual"] = (ROOT / "docs/manual/ja/index.md").read_text()
    plan = ROOT / "backend/kata/reporting/templates/rehabilitation_plan.html"
    texts["rehabilitation plan"] = plan.read_text()
    correct = re.compile("|".join(re.escape(word) for term in GLOSSARY.terms for word in term.allowed_within))
    texts = {key: correct.sub("", text) for key, text in texts.items()}
    assert [(word, key) for word in sorted(excluded) for key, text in texts.items() if word in text] == []


def test_every_text_writes_angles_with_the_degree_sign() -> None:
    """The page once used "deg" and the sign side by side. Both languages use the sign, also for speeds and stiffness."""
    assert sum("°" in english for _, english, _ in PAIRS) > 100
    written = [(key, text) for key, *both in PAIRS for text in both if re.search(r"\bdeg\b", _PARAMETER.sub("", text))]
    assert written == []


def test_a_range_has_the_wave_dash_of_jis() -> None:
    """The wave dash of JIS X 0208 is U+301C. U+FF5E looks the same, but a search for one does not find the other."""
    texts = files("*.json", "*.toml", "*.md", "*.html", "*.py", "*.ts", "*.tsx", "*.js", "*.css", "*.svg", "*.yml")
    assert any("\u301c" in file.read_text() for file in texts)
    assert [str(file.relative_to(ROOT)) for file in texts if "\uff5e" in file.read_text()] == []


def test_every_term_has_a_known_source_and_two_meanings() -> None:
    assert len(GLOSSARY.terms) > 40
    assert len({term.english for term in GLOSSARY.terms}) == len(GLOSSARY.terms)
    for term in GLOSSARY.terms:
        assert term.source in GLOSSARY.sources, term.english
        assert term.meaning, term.english
        assert re.search(r"[ぁ-ん]", term.meaning_ja), term.english
    assert {term.source for term in GLOSSARY.terms} == set(GLOSSARY.sources)
