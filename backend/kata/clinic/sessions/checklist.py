"""The checklist before a patient's arm is taught or a motion is played. Pure functions.

An answer is valid for the side and the fixtures for which it was given. If the next motion needs others, only the checks that differ are
asked again. They are also asked again when a motion returns to the first fixtures, because the apparatus was changed in between. Side, pin,
belt and arm fixer 1 are the same in teaching and playback. The fixture of the elbow differs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import reduce
from typing import Final, Literal

from kata.clinic import texts
from kata.messages import NO_TEXT, Text
from kata.types import Fixture, Side

CheckName = Literal["identity", "side", "fixtures", "belt", "pedal", "estop"]
_FIXTURE_WORDS: Final[dict[Fixture, Text]] = {
    "arm_fixer_1": texts.FIXTURE_ARM_FIXER_1(),
    "arm_fixer_2": texts.FIXTURE_ARM_FIXER_2(),
    "elbow_fixer_1": texts.FIXTURE_ELBOW_FIXER_1(),
    "elbow_fixer_2": texts.FIXTURE_ELBOW_FIXER_2(),
}


@dataclass(frozen=True)
class Need:
    """One required check."""

    check: CheckName
    subject: str
    """Side or fixtures for which an answer is valid; empty if every answer is valid."""
    sentence: Text
    detected: bool
    """True if the apparatus itself answers the check. A user cannot confirm such a check."""


@dataclass(frozen=True)
class Answer:
    """An answer of a user or of the apparatus, stored with the session."""

    check: CheckName
    subject: str
    """Side or fixtures for which the answer was given; for ``identity``, the compared identifiers."""
    at: datetime
    by: str
    """Name of the person; empty if the apparatus answered."""


@dataclass(frozen=True)
class CheckState:
    """A required check and its answer, which is None while the check is open."""

    need: Need
    answer: Answer | None


def playback_fixtures(taught_with: Sequence[str], *, rotates: bool) -> tuple[Fixture, ...]:
    """Return the fixtures for playback: the arm fixer of the teaching, or the one that the motion needs if it is unknown.

    In teaching the therapist holds the elbow with elbow fixer 1. In playback elbow fixer 2 holds it.
    """
    taught_arm_fixers = {fixer for fixer in taught_with if fixer.startswith("arm_fixer")}
    second = "arm_fixer_2" in taught_arm_fixers if taught_arm_fixers else rotates
    return ("arm_fixer_2", "elbow_fixer_2") if second else ("arm_fixer_1",)


def required_checks(side: Side, fixtures: Sequence[Fixture]) -> tuple[Need, ...]:
    """Return all required checks, in the order of the checklist."""
    return (
        Need("identity", "", texts.CHECK_IDENTITY(), detected=False),
        Need("side", side, texts.CHECK_LEFT_SIDE() if side == "left" else texts.CHECK_RIGHT_SIDE(), detected=False),
        Need("fixtures", "+".join(fixtures), texts.CHECK_FIXTURES(fixtures=_fixtures_text(fixtures)), detected=False),
        Need("belt", "", texts.CHECK_BELT(), detected=False),
        Need("pedal", "", texts.CHECK_PEDAL(), detected=True),
        Need(
            "estop",
            "",
            texts.CHECK_ESTOP(),
            detected=True,
        ),
    )


def _fixtures_text(fixtures: Sequence[Fixture]) -> Text:
    words = [_FIXTURE_WORDS[fixture] for fixture in fixtures]
    return reduce(lambda first, second: texts.FIXTURES_AND(first=first, second=second), words) if words else NO_TEXT


def match_answers(
    needs: Sequence[Need], answers: Sequence[Answer], detected: Mapping[CheckName, datetime | None]
) -> tuple[CheckState, ...]:
    """Return each required check with its newest answer, provided that it was given for the same side or fixtures.

    ``detected``: time at which the apparatus answered each of its own checks, None if it has not.
    """

    def of(need: Need) -> Answer | None:
        if need.detected:
            at = detected[need.check]
            return Answer(need.check, need.subject, at, "") if at else None
        newest = max(
            (answer for answer in answers if answer.check == need.check), key=lambda answer: answer.at, default=None
        )
        return newest if newest and need.subject in ("", newest.subject) else None

    return tuple(CheckState(need, of(need)) for need in needs)
