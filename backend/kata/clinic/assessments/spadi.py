"""Shoulder Pain and Disability Index (SPADI): its 13 items, their score, and which change is important.

Roach, Budiman-Mak, Songsiridej and Lertratanakul 1991, Arthritis Care Res 4(4), 143-149; items answered 0 to 10 as in Williams, Holleman
and Simel 1995, J Rheumatol 22(4), 727-732. The item texts are our own words. They help the person who types the answers; the patient fills
in the original questionnaire, in Japanese the SPADI-Jp (Sekiguchi, Hagiwara, Ando et al. 2020, "Validation and reliability of a
Japanese version of the Shoulder Pain and Disability Index: A cross-sectional study", copyright The Japanese Orthopaedic Association). We
know of no licence to distribute it, so Kata does not contain it. Our own words are not validated and are never exported.

Score and thresholds are in ``kata/clinic/questionnaires/built_in/spadi.toml``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from kata.clinic.questionnaires import definitions
from kata.clinic.questionnaires.definitions import SPADI

Subscale = Literal["pain", "disability"]
HIGHEST: Final = SPADI.scales[0].highest
IMPORTANT_CHANGE: Final = (SPADI.important.points, SPADI.important.up_to or SPADI.important.points)
"""Lower and upper end of the range in which the sources put the smallest change that patients call important, in points."""
DETECTABLE_CHANGE: Final = SPADI.detectable.points
"""Points. A larger change of one patient is real; a smaller one may be due to chance."""


@dataclass(frozen=True)
class Item:
    """One question, in our own words."""

    subscale: Subscale
    english: str
    japanese: str


ITEMS: Final = (
    Item("pain", "When it is at its worst", "最も痛いとき"),
    Item("pain", "Lying on that side", "患側を下にして寝るとき"),
    Item("pain", "Reaching up to something high", "高い所に手を伸ばすとき"),
    Item("pain", "Touching the nape", "首の後ろに触れるとき"),
    Item("pain", "Pushing with that arm", "患側の腕で押すとき"),
    Item("disability", "Washing the hair", "髪を洗う"),
    Item("disability", "Washing the back", "背中を洗う"),
    Item("disability", "Getting into a pullover or undershirt", "かぶりの服を着る"),
    Item("disability", "Getting into a shirt that buttons in front", "前ボタンの服を着る"),
    Item("disability", "Getting into trousers", "ズボンをはく"),
    Item("disability", "Putting something up high", "高い所に物を置く"),
    Item("disability", "Carrying something heavy (5 kg)", "重い物(5 kg)を運ぶ"),
    Item("disability", "Getting at the back pocket", "後ろのポケットから物を取る"),
)


@dataclass(frozen=True)
class SpadiScore:
    """Scores from 0 (none) to 100 (worst). None if too many items are unanswered."""

    pain: float | None
    disability: float | None
    total: float | None
    """The mean of both subscales."""


def score(answers: Sequence[int | None]) -> SpadiScore:
    """Return the score of 13 answers in the items' order, 0 to 10 each, None if unanswered."""
    scores = definitions.score(SPADI, answers)
    return SpadiScore(scores.scales["pain"], scores.scales["disability"], scores.total)


def total(answers: Sequence[int | None] | None) -> float | None:
    """Return the total score, or None if the questionnaire was not answered or too many items are unanswered."""
    return score(answers).total if answers else None
