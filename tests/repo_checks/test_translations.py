"""What the service says in sentences, the page says in Japanese too: ``frontend/src/shared/told.ja.json`` has each of them."""

import ast
import itertools
import json
import re
from collections.abc import Iterator, Mapping
from typing import Final, get_args

import pytest

from kata.access.passwords import SHORTEST
from kata.clinic.assessments import rom
from kata.clinic.sessions import checklist, replay
from kata.device import refusals
from kata.device.faults import FAULTS
from kata.motion.axes import BASIC_MOTIONS, Side
from tests.support.paths import ROOT

KATA: Final = ROOT / "backend/kata"
TOLD: Final[dict[str, str]] = json.loads((ROOT / "frontend/src/shared/told.ja.json").read_text("utf-8"))

SAYS: Final[dict[str, tuple[int | str, ...]]] = {
    "ProblemError": (2, "message", 3, "next_step", 4),
    "document": (2, 3),
    "Refusal": ("message", "next_step"),
    "EditError": (0,),
    "TrajectoryError": (0,),
    "OutOfReachError": (0,),
    "HandRefusedError": (0,),
    "_UnusableError": (0,),
    "TableError": (0,),
    "Complaint": (2,),
    "_emit": (1,),
    "tell": (1,),
    "_named": (1,),
}
"""Which arguments are said, of every call that says something."""
ONLY_WHAT_ANOTHER_SAYS: Final = {
    "{1}: {2}",
    "{1} (missing: {2})",
    "{1}.",
    "{1}{2}.",
    "{1}",
    "{1} only",
    "{1} % of the range{2}",
}
IN_THE_LANGUAGE_ALREADY: Final = "Please check what was entered: {1}."


def said_in(node: ast.expr, known: Mapping[str, ast.expr]) -> Iterator[str]:
    """The sentences of an argument, with {1}, {2} for values; nothing of what comes from elsewhere."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.JoinedStr):
        number = itertools.count(1)
        yield "".join(
            str(part.value) if isinstance(part, ast.Constant) else f"{{{next(number)}}}" for part in node.values
        )
    elif isinstance(node, ast.IfExp):
        yield from said_in(node.body, known)
        yield from said_in(node.orelse, known)
    elif isinstance(node, ast.List | ast.Tuple):
        for part in node.elts:
            yield from said_in(part, known)
    elif isinstance(node, ast.Name) and node.id in known:
        yield from said_in(known[node.id], {})


def spoken() -> Iterator[str]:
    """Every sentence in the service's own source, wherever it is said, and those of its tables."""
    for file in sorted(KATA.rglob("*.py")):
        tree = ast.parse(file.read_text("utf-8"))
        known = {
            target.id: node.value
            for node in ast.walk(tree)
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.value
            for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
            if isinstance(target, ast.Name)
        }
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if name == "not_found":
                yield f"There is no such {next(said_in(node.args[0], known))}."
            for which in SAYS.get(name, ()):
                given = (
                    node.args[which : which + 1]
                    if isinstance(which, int)
                    else [one.value for one in node.keywords if one.arg == which]
                )
                for one in given:
                    yield from said_in(one, known)
    for fault in FAULTS:
        yield from (fault.message.replace("{motor}", "{1}"), fault.next_step)
    for words in refusals._WHAT_IS_ON.values():
        yield from words
    for side, rotates in itertools.product(get_args(Side), (False, True)):
        for need in checklist.needed(side, checklist.playback_fixtures((), rotates=rotates)):
            yield need.sentence
    yield from replay.CHANGED.values()
    yield from (sentence.replace("{pain}", "{1}") for sentence in replay.NOT_KEPT.values())
    yield from (measure.english for measure in rom.MEASURES)
    yield from (motion.name for motion in BASIC_MOTIONS)
    yield f"must have {SHORTEST} characters or more"


def is_told(sentence: str) -> bool:
    """As the page looks it up: whole, as a clause of a sentence, or by its pattern."""
    if {sentence, f"{sentence[:1].upper()}{sentence[1:]}."} & set(TOLD):
        return True
    patterns = (re.escape(one) for one in TOLD if "{1}" in one)
    return any(re.fullmatch(re.sub(r"\\\{\d\\\}", "(.+?)", one), sentence) for one in patterns)


def test_every_service_sentence_has_a_japanese_translation() -> None:
    said = {
        one
        for one in spoken()
        if " " in one
        and one not in ONLY_WHAT_ANOTHER_SAYS | {IN_THE_LANGUAGE_ALREADY}
        and "There is no such {" not in one
    }
    assert len(said) > 300, "the sentences are not found where they are said"
    assert sorted(one for one in said if not is_told(one)) == []


@pytest.mark.parametrize("sentence", ["Nobody has ever said this.", "Motor 3 is tired."])
def test_untranslated_sentence_is_found(sentence: str) -> None:
    assert not is_told(sentence)
