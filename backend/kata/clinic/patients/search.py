"""Search text of patients. Stored text and search words are normalized in the same way."""

import re
import unicodedata
from datetime import date
from typing import Final

MAX_SEARCH_LETTERS: Final = 400
_ACCENTS: Final = re.compile("[\u0300-\u036f]")
_TO_HIRAGANA: Final = {katakana: katakana - 0x60 for katakana in range(ord("ァ"), ord("ヶ") + 1)}
_HYPHEN: Final = re.compile("(?<=[0-9A-Za-z])[ー‐‑‒–—―−]")
"""Characters that a Japanese keyboard types instead of a hyphen. In kana mode it types the long vowel mark."""
_DAY: Final = re.compile(r"(\d{4})[-/.年](\d{1,2})(?:[-/.月](\d{1,2})日?|月)?")


def folded(text: str) -> str:
    """Return the text without the differences that a name may have in writing: case, accents, width, kind of kana, spaces."""
    plain = unicodedata.normalize("NFC", _ACCENTS.sub("", unicodedata.normalize("NFKD", text)))
    return "".join(plain.casefold().translate(_TO_HIRAGANA).split())


def text_of(name: str, kana: str | None, clinic_number: str, birth_date: date | None) -> str:
    """Return the text by which a patient is found, one line per field."""
    parts = (name, kana, clinic_number, birth_date and birth_date.isoformat())
    return "\n".join(folded(part) for part in parts if part)[:MAX_SEARCH_LETTERS]


def words_of(search: str) -> list[list[str]]:
    """Return the search words, each as typed and with the hyphens that the user probably meant. A date becomes ISO 8601."""
    words = unicodedata.normalize("NFKC", search).split()
    return [[folded(_DAY.sub(_iso, form)) for form in _forms(word)] for word in words]


def numbers_of(search: str) -> list[str]:
    """Return the clinic numbers that a search for a complete number may mean. Width makes no difference."""
    typed = search.strip()
    return [typed, *_forms(unicodedata.normalize("NFKC", typed))]


def _forms(word: str) -> list[str]:
    with_hyphen = _HYPHEN.sub("-", word)
    return [word] if with_hyphen == word else [word, with_hyphen]


def _iso(day: re.Match[str]) -> str:
    return "-".join(part.zfill(2) for part in day.groups() if part)
