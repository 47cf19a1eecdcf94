"""Every name in a commissioning record, and every field and unit of a station's file, has words in both languages."""

import ast
import json
import re
from collections.abc import Iterator
from typing import Any, Final

import msgspec
import pytest

from kata.device.bus.dynamixel.registers import configured_registers
from kata.device.config import StationConfig
from kata.device.config_fields import fields_of
from tests.support.paths import ROOT

SOURCES: Final = ROOT / "backend/kata/commissioning"
LANGUAGES: Final = ("en", "ja")
_OF_DRIVES: Final = {"model", "firmware", "voltage_v", "temperature_c"}
"""Names that a loop passes."""


def words(language: str, part: str) -> dict[str, str]:
    file = ROOT / f"frontend/src/locales/{language}/commissioning.json"
    found: dict[str, str] = json.loads(file.read_text("utf-8"))[part]
    return found


def template(node: ast.expr) -> str | None:
    """Return a text, with braces where an f-string has a value. None: neither."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
    return None


def recorded_texts() -> Iterator[str]:
    """Yield the names of all recorded values, and the values that are texts."""
    for file in sorted(SOURCES.glob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "add_value":
                for argument in (*node.args[:1], *(keyword.value for keyword in node.keywords)):
                    if text := template(argument):
                        yield text


def test_every_recorded_name_has_words() -> None:
    config = StationConfig()
    registers = {register.name for axis in config.axes for register in configured_registers(config, axis)}
    names = {*recorded_texts(), *_OF_DRIVES, *registers, "weight", "empty"}
    assert len(names) > 40
    for language in LANGUAGES:
        known = [re.escape(name) for name in words(language, "values")]
        patterns = [re.compile(re.sub(r"\\\{\w+\\\}", "(.+|{})", name)) for name in known]
        assert [name for name in sorted(names) if not any(pattern.fullmatch(name) for pattern in patterns)] == [], (
            language
        )


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_field_and_unit_of_a_station_has_words(language: str) -> None:
    other: Any = msgspec.structs.replace(StationConfig(), protocol="modbus", baud=4_000_000)
    fields = [*fields_of(StationConfig()), *fields_of(other)]
    names = {re.sub(r"\[\d\]", "", field.name) for field in fields}
    assert sorted(names - words(language, "fields").keys()) == []
    assert sorted({field.unit for field in fields if field.unit} - words(language, "units").keys()) == []
