"""What has to be in order before a patient's arm is taught a motion, or played one. Pure.

An answer is good for what it was given for: the side, the fixtures. Where what comes next needs others, only that is asked
again; and again when it goes back, for somebody has changed something in between. Side, pin and belt are the same in teaching and
playback, and so is arm fixer 1; what holds the elbow is not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import reduce
from typing import Final, Literal

from kata.clinic import texts
from kata.messages import NO_TEXT, Text
from kata.types import Fixture, Side

CheckName = Literal["side", "fixtures", "belt", "pedal", "estop"]
_FIXTURE_WORDS: Final[dict[Fixture, Text]] = {
    "arm_fixer_1": texts.FIXTURE_ARM_FIXER_1(),
    "arm_fixer_2": texts.FIXTURE_ARM_FIXER_2(),
    "elbow_fixer_1": texts.FIXTURE_ELBOW_FIXER_1(),
    "elbow_fixer_2": texts.FIXTURE_ELBOW_FIXER_2(),
}


@dataclass(frozen=True)
class Need:
    """One thing to be in order."""

    check: CheckName
    subject: str
    """What an answer is good for; empty where there is only one thing it can mean."""
    sentence: Text
    detected: bool
    """The apparatus itself tells; nobody can tick it."""


@dataclass(frozen=True)
class Answer:
    """Somebody has looked, or the apparatus has told; kept with the session."""

    check: CheckName
    subject: str
    at: datetime
    by: str
    """Empty where it was detected."""


@dataclass(frozen=True)
class CheckState:
    """A need and its answer; None while it is open."""

    need: Need
    answer: Answer | None


def playback_fixtures(taught_with: Sequence[str], *, rotates: bool) -> tuple[Fixture, ...]:
    """What holds the arm in playback: the arm fixer that it was taught with, or the one for its motion where nobody has said.

    The therapist held the elbow in teaching (elbow fixer 1), nobody does in playback (elbow fixer 2).
    """
    said = {fixer for fixer in taught_with if fixer.startswith("arm_fixer")}
    second = "arm_fixer_2" in said if said else rotates
    return ("arm_fixer_2", "elbow_fixer_2") if second else ("arm_fixer_1",)


def required_checks(side: Side, fixtures: Sequence[Fixture]) -> tuple[Need, ...]:
    """Everything, in the order in which one goes through it."""
    return (
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
    """Each need with its answer: the newest of its check, and only if that was given for the same.

    ``detected``: when the apparatus told of those that nobody ticks; None while it has not.
    """

    def of(need: Need) -> Answer | None:
        if need.detected:
            at = detected[need.check]
            return Answer(need.check, need.subject, at, "") if at else None
        newest = max(
            (answer for answer in answers if answer.check == need.check), key=lambda answer: answer.at, default=None
        )
        return newest if newest and newest.subject == need.subject else None

    return tuple(CheckState(need, of(need)) for need in needs)
