"""How patients are searched for: their text and the words looked for are brought to one form first."""

import re
import unicodedata
from datetime import date
from typing import Final

LONGEST: Final = 400
_ACCENTS: Final = re.compile("[\u0300-\u036f]")
_TO_HIRAGANA: Final = {katakana: katakana - 0x60 for katakana in range(ord("ァ"), ord("ヶ") + 1)}
_HYPHEN: Final = re.compile("(?<=[0-9A-Za-z])[ー‐‑‒–—―−]")
"""What a Japanese keyboard writes where somebody means a hyphen: while it writes kana, the long vowel."""
_DAY: Final = re.compile(r"(\d{4})[-/.年](\d{1,2})(?:[-/.月](\d{1,2})日?|月)?")


def folded(text: str) -> str:
    """Without what the same name may be written with or not: case, accents, width, kind of kana, spaces."""
    plain = unicodedata.normalize("NFC", _ACCENTS.sub("", unicodedata.normalize("NFKD", text)))
    return "".join(plain.casefold().translate(_TO_HIRAGANA).split())


def text_of(name: str, kana: str | None, clinic_number: str, birth_date: date | None) -> str:
    """What a patient is found by, a line each."""
    parts = (name, kana, clinic_number, birth_date and birth_date.isoformat())
    return "\n".join(folded(part) for part in parts if part)[:LONGEST]


def words_of(search: str) -> list[list[str]]:
    """What somebody looks for, word by word, each as typed and as meant; a day as ISO 8601 writes it, however it was written."""
    words = unicodedata.normalize("NFKC", search).split()
    return [[folded(_DAY.sub(_iso, form)) for form in _forms(word)] for word in words]


def numbers_of(search: str) -> list[str]:
    """The clinic numbers that somebody may mean who looks for a whole one, in whatever width it was typed."""
    typed = search.strip()
    return [typed, *_forms(unicodedata.normalize("NFKC", typed))]


def _forms(word: str) -> list[str]:
    meant = _HYPHEN.sub("-", word)
    return [word] if meant == word else [word, meant]


def _iso(day: re.Match[str]) -> str:
    return "-".join(part.zfill(2) for part in day.groups() if part)
