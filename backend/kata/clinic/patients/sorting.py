"""The order of patients: Latin names by their letters, other names by their reading in the order of the kana (gojuon).

As in JIS X 4061, voiced and small kana and the long vowel mark count first as the plain kana, and only then differ. Hiragana and
katakana are equal.
"""

import unicodedata
from typing import Final

from kata.clinic.patients.search import folded

MAX_SORT_LETTERS: Final = 200
_PLAIN: Final = str.maketrans("ぁぃぅぇぉっゃゅょゎゕゖ", "あいうえおつやゆよわかけ") | {0x3099: None, 0x309A: None}
"""Small kana become large. The marks of voiced kana are removed."""
_KANA_BY_VOWEL: Final = {
    "あ": "あかさたなはまやらわ",
    "い": "いきしちにひみりゐ",
    "う": "うくすつぬふむゆる",
    "え": "えけせてねへめれゑ",
    "お": "おこそとのほもよろを",
}
_VOWEL: Final = {kana: vowel for vowel, row in _KANA_BY_VOWEL.items() for kana in row}


def sort_key(name: str, kana: str | None) -> str:
    """Return the text that orders a patient in lists. Words are compared one after the other, so the family name counts first."""
    is_latin = "LATIN" in unicodedata.name(name[:1] or " ", "")
    words = [folded(word) for word in (name if is_latin else kana or name).split()]
    return "\n".join((" ".join(_plain(word) for word in words), " ".join(words)))[:MAX_SORT_LETTERS]


def _plain(word: str) -> str:
    letters: list[str] = []
    for letter in unicodedata.normalize("NFD", word).translate(_PLAIN):
        letters.append(_VOWEL.get(letters[-1], letter) if letter == "ー" and letters else letter)
    return "".join(letters)
