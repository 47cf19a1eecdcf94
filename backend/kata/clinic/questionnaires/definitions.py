"""Definitions of questionnaires. Each is a file with structure, score and the changes that are important.

Kata's own files are in ``built_in/``, a clinic's files in the folder ``questionnaires`` of its data. A new file adds a questionnaire
without any code.

A definition has no item texts, because most questionnaires are protected by copyright. A clinic imports the texts for which it has a
licence (:mod:`kata.clinic.questionnaires.licensed_texts`). For the same reason Kata contains no table of T-scores: a clinic adds the
definition of a PROMIS short form with the table in its own manual.
"""

import logging
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

log = logging.getLogger(__name__)

_BUILT_IN: Final = Path(__file__).parent / "built_in"


class ItemScale(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A group of consecutive items. Its score is ``factor`` times the mean of its answers plus ``constant``."""

    code: str
    items: int
    lowest: int
    highest: int
    factor: float
    constant: float = 0.0


class Threshold(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A change of the total in points."""

    points: float
    source: str
    up_to: float | None = None
    """Upper end of the range, if the source gives a range."""


class Definition(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One questionnaire."""

    code: Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_]{0,31}$")]
    title: Annotated[str, Meta(min_length=1, max_length=200)]
    total: Literal["mean", "sum", "t_score"]
    """Method that computes the total from the scores of the scales. ``t_score``: from the sum of all answers by ``conversion``."""
    highest_total: float
    better: Literal["lower", "higher"]
    most_unanswered: int
    """Maximum number of unanswered items. With more there is no score."""
    scoring_source: str
    copyright: str
    scales: tuple[ItemScale, ...]
    important: Threshold
    """Smallest change that patients call important (minimal clinically important difference, MCID)."""
    detectable: Threshold
    """Smallest detectable change (SDC): a change of one patient that is not larger may be due to chance."""
    conversion: tuple[float, ...] = ()
    """T-score of each sum of the answers, from the lowest sum to the highest. A T-score of 50 is the mean of a reference population, and
    10 is its standard deviation.
    """

    def __post_init__(self) -> None:
        """Check that every answered questionnaire gets a score.

        :raises ValueError: when the definition is invalid. The message names the error.
        """
        if not self.scales or any(scale.items < 1 or scale.lowest >= scale.highest for scale in self.scales):
            raise ValueError("every scale must have an item, and a highest answer above the lowest")
        if self.total != "t_score":
            if self.conversion:
                raise ValueError("a conversion belongs to the total t_score")
            return
        sums = sum(scale.items * (scale.highest - scale.lowest) for scale in self.scales) + 1
        if len(self.conversion) != sums:
            raise ValueError(f"conversion must have {sums} T-scores, one for each sum, not {len(self.conversion)}")
        if any(later <= earlier for earlier, later in pairwise(self.conversion)):
            raise ValueError("conversion must rise from each sum to the next")
        if self.most_unanswered:
            raise ValueError("a T-score needs every answer: most_unanswered must be 0")
        if self.highest_total != self.conversion[-1]:
            raise ValueError("highest_total must be the last T-score of conversion")

    @property
    def item_scales(self) -> list[ItemScale]:
        """Return the scale of every item, in the order of the items."""
        return [scale for scale in self.scales for _ in range(scale.items)]

    @property
    def lowest_total(self) -> float:
        """Return the lowest total: 0, except for a T-score."""
        return self.conversion[0] if self.conversion else 0.0

    def fits(self, answers: Sequence[int | None]) -> bool:
        """Return True if the answers match the items in number, and each answer is None or one that its item has."""
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
    """Return the scores. ``answers``: one per item, None if unanswered. The mean of a scale leaves out unanswered items."""
    scores: dict[str, float | None] = {}
    first = 0
    complete = sum(answer is None for answer in answers) <= definition.most_unanswered
    for scale in definition.scales:
        answered = [answer for answer in answers[first : first + scale.items] if answer is not None]
        first += scale.items
        scores[scale.code] = (
            scale.factor * sum(answered) / len(answered) + scale.constant if complete and answered else None
        )
    known_scores = [value for value in scores.values() if value is not None]
    if len(known_scores) < len(scores):
        return Scores(dict.fromkeys(scores), None)
    if definition.total == "t_score":
        lowest = sum(scale.lowest for scale in definition.item_scales)
        return Scores(scores, definition.conversion[sum(answer or 0 for answer in answers) - lowest])
    return Scores(scores, sum(known_scores) / len(known_scores) if definition.total == "mean" else sum(known_scores))


def read_definition(file: Path) -> Definition:
    """Return the definition in a file.

    :raises ValueError: when the definition is invalid. The message names the error.
    :raises OSError: when the file cannot be read.
    """
    return msgspec.toml.decode(file.read_bytes(), type=Definition)


def _by_code(folder: Path) -> dict[str, Definition]:
    definitions = [read_definition(path) for path in sorted(folder.glob("*.toml"))]
    return {definition.code: definition for definition in definitions}


_ours: Final = _by_code(_BUILT_IN)
_registered: Final = dict(_ours)
DEFINITIONS: Final[Mapping[str, Definition]] = MappingProxyType(_registered)
"""Every questionnaire by its code: those of Kata and those of the clinic's folder (:func:`use_folder`)."""
SPADI: Final = _ours["spadi"]


def clinic_folder(data: Path) -> Path:
    """Return the folder of the clinic's own definitions. Backups contain this folder."""
    return data / "questionnaires"


def use_folder(folder: Path) -> None:
    """Use the definitions of a clinic's folder in addition to Kata's. They replace those of an earlier call. An unusable file is logged
    and left out.
    """
    _registered.clear()
    _registered.update(_ours)
    for file in sorted(folder.glob("*.toml")):
        try:
            definition = read_definition(file)
            check_new(definition)
        except (ValueError, OSError) as error:
            log.error("the questionnaire in %s is not used: %s", file, error)
        else:
            _registered[definition.code] = definition


def check_new(definition: Definition) -> None:
    """Check that a clinic's definition does not replace one of Kata's.

    :raises ValueError: when its code is that of one of Kata's definitions.
    """
    if definition.code in _ours:
        raise ValueError(f"Kata has its own definition of {definition.code}; choose another code")
