"""Definitions of questionnaires: one file each in ``definitions/``, with structure, score and the changes that matter.

A definition has no item texts: most questionnaires are protected by copyright. A clinic imports the texts that it has a licence for
(:mod:`kata.clinic.questionnaires.licensed_texts`). A new file adds a questionnaire without code.

PROMIS is missing: its scores come from item-response tables that a definition of this form cannot hold.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final, Literal

import msgspec

_FOLDER: Final = Path(__file__).parent / "definitions"


class ItemScale(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A group of items in a row. Its score is ``factor`` times the mean of its answers plus ``constant``."""

    code: str
    items: int
    lowest: int
    highest: int
    factor: float
    constant: float = 0.0


class Threshold(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A change of the total, in points."""

    points: float
    source: str
    up_to: float | None = None
    """The upper end where a source gives a range."""


class Definition(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One questionnaire."""

    code: str
    title: str
    total: Literal["mean", "sum"]
    """Of the scales' scores."""
    highest_total: float
    better: Literal["lower", "higher"]
    most_unanswered: int
    """With more unanswered items there is no score."""
    scoring_source: str
    copyright: str
    scales: tuple[ItemScale, ...]
    important: Threshold
    """The smallest change that patients call important."""
    detectable: Threshold
    """A change of one patient up to this may be chance."""

    @property
    def item_scales(self) -> list[ItemScale]:
        """Return the scale of every item, in the order of the items."""
        return [scale for scale in self.scales for _ in range(scale.items)]

    def fits(self, answers: Sequence[int | None]) -> bool:
        """True if there is an answer or None for every item, and every answer is one that the item has."""
        scales = self.item_scales
        return len(answers) == len(scales) and all(
            answer is None or scale.lowest <= answer <= scale.highest
            for scale, answer in zip(scales, answers, strict=True)
        )


class Scores(msgspec.Struct, frozen=True):
    """Scores of one answered questionnaire. None if too many items are unanswered."""

    scales: Mapping[str, float | None]
    total: float | None


def score(definition: Definition, answers: Sequence[int | None]) -> Scores:
    """Return the scores. ``answers``: one for each item, None if unanswered. An unanswered item is left out of its scale's mean."""
    found: dict[str, float | None] = {}
    first = 0
    complete = sum(answer is None for answer in answers) <= definition.most_unanswered
    for scale in definition.scales:
        answered = [answer for answer in answers[first : first + scale.items] if answer is not None]
        first += scale.items
        found[scale.code] = (
            scale.factor * sum(answered) / len(answered) + scale.constant if complete and answered else None
        )
    known = [value for value in found.values() if value is not None]
    if len(known) < len(found):
        return Scores(dict.fromkeys(found), None)
    return Scores(found, sum(known) / len(known) if definition.total == "mean" else sum(known))


def _load() -> Mapping[str, Definition]:
    found = [msgspec.toml.decode(path.read_bytes(), type=Definition) for path in sorted(_FOLDER.glob("*.toml"))]
    return MappingProxyType({definition.code: definition for definition in found})


DEFINITIONS: Final = _load()
"""Every questionnaire by its code."""
SPADI: Final = DEFINITIONS["spadi"]
