"""Shoulder Pain and Disability Index (SPADI): its 13 items, their score, and the change that matters.

Roach, Budiman-Mak, Songsiridej and Lertratanakul 1991, Arthritis Care Res 4(4), 143-149; items answered 0 to 10 as in Williams, Holleman
and Simel 1995, J Rheumatol 22(4), 727-732. The item texts are our own words. They remind the person who types the answers in; the patient
fills in the questionnaire itself.

An item that does not apply or is unanswered is left out of its subscale's sum and of the highest possible sum. The total is the mean of
both subscales (Roach et al.). Some printed forms divide the sum of all 13 items by 130, which weighs disability more. Do not mix their
totals with these.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

Subscale = Literal["pain", "disability"]
HIGHEST: Final = 10
MOST_UNANSWERED: Final = 2
"""A subscale with more unanswered items has no score."""
IMPORTANT_CHANGE: Final = (8.0, 13.0)
"""The least change that patients call important lies between these: Roy, MacDermid and Woodhouse 2009, Arthritis Rheum 61(5), 623-632.

A smaller change is not important, a larger one is. (For a single patient a change below 17 or 18 may also be chance: the same authors;
Tveita et al. 2008, BMC Musculoskelet Disord 9, 161, in adhesive capsulitis.)
"""


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
class Score:
    """Scores from 0 (none) to 100 (worst). None if too many items are unanswered."""

    pain: float | None
    disability: float | None
    total: float | None
    """The mean of both subscales."""


def score(answers: Sequence[int | None]) -> Score:
    """Return the score of 13 answers in the items' order, 0 to 10 each, None if unanswered."""
    pain, disability = (_subscale(answers, subscale) for subscale in ("pain", "disability"))
    total = None if pain is None or disability is None else (pain + disability) / 2
    return Score(pain, disability, total)


def _subscale(answers: Sequence[int | None], subscale: str) -> float | None:
    asked = [answer for item, answer in zip(ITEMS, answers, strict=True) if item.subscale == subscale]
    answered = [answer for answer in asked if answer is not None]
    if len(asked) - len(answered) > MOST_UNANSWERED:
        return None
    return 100 / HIGHEST * sum(answered) / len(answered)
