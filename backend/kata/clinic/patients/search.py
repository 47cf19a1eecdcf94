"""How patients are searched for: their text and the words looked for are brought to one form first."""

import re
import unicodedata
from datetime import date
from typing import Final

LONGEST: Final = 400
_ACCENTS: Final = re.compile("[\u0300-\u036f]")
_TO_HIRAGANA: Final = {katakana: katakana - 0x60 for katakana in range(ord("ァ"), ord("ヶ") + 1)}
_DAY: Final = re.compile(r"(\d{4})[-/.年](\d{1,2})(?:[-/.月](\d{1,2})日?|月)?")


def folded(text: str) -> str:
    """Without what the same name may be written with or not: case, accents, width, kind of kana, spaces."""
    plain = unicodedata.normalize("NFC", _ACCENTS.sub("", unicodedata.normalize("NFKD", text)))
    return "".join(plain.casefold().translate(_TO_HIRAGANA).split())


def text_of(name: str, kana: str | None, clinic_number: str, birth_date: date | None) -> str:
    """What a patient is found by, a line each."""
    parts = (name, kana, clinic_number, birth_date and birth_date.isoformat())
    return "\n".join(folded(part) for part in parts if part)[:LONGEST]


def words_of(search: str) -> list[str]:
    """What somebody looks for, word by word; a day as ISO 8601 writes it, however it was written."""
    return [folded(_DAY.sub(_iso, word)) for word in unicodedata.normalize("NFKC", search).split()]


def _iso(day: re.Match[str]) -> str:
    return "-".join(part.zfill(2) for part in day.groups() if part)
