"""Every message of the service has a Japanese translation with the same parameters."""

import ast
import json
import math
import pickle
import re
import string
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

import kata.api.app
import kata.commissioning.texts  # noqa: F401 - of the command `kata commission`
from kata import i18n
from kata.device.faults import FAULTS
from kata.messages import CATALOGUE, MessageKey, message, sent_key, text_of
from tests.support.paths import ROOT

BACKEND: Final = ROOT / "backend/kata"
ENGLISH: Final[dict[str, str]] = json.loads((ROOT / "frontend/server-messages.json").read_text("utf-8"))
RENAMED: Final = {
    "choose_load_level": "CHOOSE_RESISTANCE_LEVEL",
    "emergency_access_not_found": "BREAK_GLASS_ACCESS_NOT_FOUND",
    "emergency_access_reviewed": "BREAK_GLASS_ACCESS_REVIEWED",
    "item_above_load_level": "ITEM_ABOVE_RESISTANCE_LEVEL",
    "item_above_load_level_by": "ITEM_ABOVE_RESISTANCE_LEVEL_BY",
    "load_level_above_limit": "RESISTANCE_LEVEL_ABOVE_LIMIT",
    "load_on_the_way": "RESISTANCE_ON_APPROACH_OR_RETURN",
    "load_repeated": "RESISTANCE_REPEATED",
    "load_while_held": "RESISTANCE_WHILE_HELD",
    "not_playable_load_level": "NOT_PLAYABLE_RESISTANCE_LEVEL",
    "own_emergency_access": "OWN_BREAK_GLASS_ACCESS",
    "way_leaves_limits": "PATH_LEAVES_LIMITS",
}
"""Messages whose constant has another name than their code: the code is stored or published."""
CONSTANTS: Final = {RENAMED.get(code, code.upper()): code for code in CATALOGUE}
JAPANESE: Final[dict[str, str]] = json.loads((ROOT / "frontend/src/locales/ja/server.json").read_text("utf-8"))


def parameters(template: str) -> set[tuple[str, str]]:
    """Return name and type of every placeholder."""
    return {(name, spec or "") for _, name, spec, _ in string.Formatter().parse(template) if name is not None}


def test_the_list_of_messages_is_current() -> None:
    declared = {code: template.english for code, template in CATALOGUE.items()}
    assert declared == ENGLISH, "stale: kata messages --out frontend/server-messages.json"


def test_every_message_is_translated_and_no_other_one() -> None:
    assert sorted(CATALOGUE.keys() - JAPANESE.keys()) == [], "not translated"
    assert sorted(JAPANESE.keys() - CATALOGUE.keys()) == [], "no such message"


def test_a_translation_has_declared_parameters_only() -> None:
    translated = CATALOGUE.keys() & JAPANESE.keys()
    undeclared = {code: parameters(JAPANESE[code]) - parameters(CATALOGUE[code].english) for code in translated}
    assert {code: names for code, names in undeclared.items() if names} == {}


def test_every_type_of_a_parameter_is_known() -> None:
    known = {"d", "g", ".0f", ".1f", ".3g", "name", "sentence", "text", "texts"}
    assert {spec for template in CATALOGUE.values() for spec in template.params.values()} <= known


@pytest.mark.parametrize("language", ["en", "ja"])
def test_every_fault_has_a_short_name_on_the_page(language: str) -> None:
    catalogue = json.loads((ROOT / "frontend/src/locales" / language / "sessions.json").read_text("utf-8"))
    assert catalogue["stops"].keys() == {fault.code for fault in FAULTS}


def calls() -> Iterator[tuple[str, str, set[str]]]:
    """Yield file and line, constant and argument names of every call of a message."""
    for file in sorted(BACKEND.rglob("*.py")):
        source = file.read_text("utf-8")
        for node in ast.walk(ast.parse(source)) if re.search(r"\.[A-Z][A-Z0-9_]*\(", source) else ():
            if not (
                isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in CONSTANTS
            ):
                continue
            names = [keyword.arg for keyword in node.keywords]
            # Unpacked arguments (**values) are checked at run time.
            if None not in names:
                yield f"{file.relative_to(BACKEND)}:{node.lineno}", node.func.attr, {str(name) for name in names}


def test_messages_are_called_with_their_parameters() -> None:
    found = list(calls())
    assert len(found) > 300
    assert [use for use in found if use[2] != set(CATALOGUE[CONSTANTS[use[1]]].params)] == []


def test_every_message_is_used() -> None:
    sources = " ".join(
        file.read_text("utf-8") for file in BACKEND.rglob("*.py") if Path(file).name != "texts.py"
    ) + "".join(file.read_text("utf-8").partition("SIDES:")[2] for file in BACKEND.rglob("texts.py"))
    used = set(re.findall(r"\b[A-Z][A-Z0-9_]+\b", sources))
    # Tables declare fields, units and their errors.
    tables = {template.code for table in (i18n.SENTENCES, i18n.NAMES, i18n.UNITS) for template in table.values()}
    assert [name for name, code in CONSTANTS.items() if code not in tables and name not in used] == []


def test_a_code_is_declared_once() -> None:
    with pytest.raises(ValueError, match="two messages have the code estop_pressed"):
        message("estop_pressed", "Again.")


def test_a_message_refuses_other_parameters_than_its_own() -> None:
    with pytest.raises(TypeError, match="drive_silent needs"):
        CATALOGUE["drive_silent"](motors=3)


def test_a_text_shows_its_parameters_and_sends_their_values() -> None:
    text = CATALOGUE["motor_would_jerk"](motor=4, at_s=3.14159)
    assert text == "motor 4 would jerk at 3.1 s"
    assert text.key == MessageKey("motor_would_jerk", {"motor": 4, "at_s": 3.14159})
    assert sent_key(text) == {"code": "motor_would_jerk", "params": {"motor": 4, "at_s": 3.14159}}
    assert CATALOGUE["motor_would_jerk"](motor=4, at_s=math.inf).key.params["at_s"] == "inf"


def test_a_text_within_another_one_keeps_its_own_code() -> None:
    pedal, belt = CATALOGUE["check_pedal"](), CATALOGUE["check_belt"]()
    text = CATALOGUE["checks_open"](checks=[pedal, belt, "A text without a code."])
    assert text.endswith(": The foot pedal answers; The belt holds the patient in the seat; A text without a code.")
    nested = text.key.params["checks"]
    assert isinstance(nested, list)
    assert [text["code"] for text in nested] == ["check_pedal", "check_belt", ""]
    place = CATALOGUE["imported_place"](place="Patient", problem=pedal)
    assert place == "Patient: The foot pedal answers."


def test_a_text_reaches_another_process_whole() -> None:
    text = CATALOGUE["drive_silent"](motor=3)
    there = pickle.loads(pickle.dumps(text))
    assert (there, there.key) == (text, text.key)


def test_error_text_has_the_code_it_was_raised_with() -> None:
    text = CATALOGUE["drive_silent"](motor=3)
    assert text_of(ValueError(text)) is text
    assert text_of(ValueError("odd")) == "odd"
    assert sent_key(text_of(ValueError("odd"))) is None
    assert text_of(ValueError()) == ""
    assert sent_key("odd") is None
    assert sent_key(None) is None
