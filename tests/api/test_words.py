"""Errors name the field in the user's language."""

import ast
import string
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from pydantic_core._pydantic_core import list_all_errors

from kata.api import i18n
from kata.api.app import create_app
from kata.settings import Settings
from tests.support.paths import ROOT
from tests.support.responses import problem

_BY_KEYWORD = {
    "minLength": {"string_too_short"},
    "maxLength": {"string_too_long"},
    "pattern": {"string_pattern_mismatch"},
    "minimum": {"greater_than_equal"},
    "exclusiveMinimum": {"greater_than"},
    "maximum": {"less_than_equal"},
    "exclusiveMaximum": {"less_than"},
    "minItems": {"too_short"},
    "maxItems": {"too_long"},
    "uniqueItems": {"set_type"},
    "enum": {"literal_error"},
    "const": {"literal_error"},
    "required": {"missing"},
    "additionalProperties": {"extra_forbidden"},
    "discriminator": {"union_tag_not_found", "union_tag_invalid"},
}
_BY_TYPE = {
    "string": {"string_type", "string_unicode"},
    "integer": {"int_type", "int_parsing", "int_parsing_size", "int_from_float"},
    "number": {"float_type", "float_parsing", "finite_number"},
    "boolean": {"bool_type", "bool_parsing"},
    "array": {"list_type"},
    "object": {"model_type", "model_attributes_type", "dict_type"},
    "null": set(),
}
_BY_FORMAT = {
    "uuid": {"uuid_type", "uuid_parsing"},
    "date": {"date_type", "date_parsing", "date_from_datetime_parsing", "date_from_datetime_inexact"},
    "date-time": {
        "datetime_type", "datetime_parsing", "datetime_from_date_parsing", "datetime_object_invalid", "timezone_aware",
    },
    "binary": {"bytes_type"},
}  # fmt: skip


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return create_app(Settings()).openapi()


def _asked_for(document: dict[str, Any]) -> Iterator[tuple[str | None, dict[str, Any]]]:
    """Every schema of what a request may hold, and the name of the field that it is of."""
    seen: set[str] = set()

    def walk(name: str | None, schema: dict[str, Any]) -> Iterator[tuple[str | None, dict[str, Any]]]:
        if "$ref" in schema:
            if schema["$ref"] in seen:
                return
            seen.add(schema["$ref"])
            schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
        yield name, schema
        for field, inner in schema.get("properties", {}).items():
            yield from walk(field, inner)
        for kind in ("anyOf", "oneOf", "allOf", "prefixItems"):
            for inner in schema.get(kind, []):
                yield from walk(name, inner)
        if "items" in schema:
            yield from walk(name, schema["items"])

    for operations in document["paths"].values():
        for operation in operations.values():
            for parameter in operation.get("parameters", []):
                yield from walk(parameter["name"], parameter["schema"])
            for content in operation.get("requestBody", {}).get("content", {}).values():
                yield from walk(None, content["schema"])


def _own_errors() -> dict[str, set[str]]:
    """Each kind of error of our own, and what it tells besides its sentence."""
    found = {}
    for path in (ROOT / "backend/kata").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "PydanticCustomError":
                assert isinstance(node.args[0], ast.Constant)
                told = node.args[2].keys if len(node.args) > 2 and isinstance(node.args[2], ast.Dict) else []
                found[str(node.args[0].value)] = {str(key.value) for key in told if isinstance(key, ast.Constant)}
    return found


def test_every_request_error_has_a_sentence_in_both_languages(document: dict[str, Any]) -> None:
    kinds = {"json_invalid"} | set(_own_errors())
    for _, schema in _asked_for(document):
        for keyword in schema:
            kinds |= _BY_KEYWORD.get(keyword, set())
        if "type" in schema:
            kinds |= _BY_FORMAT[schema["format"]] if "format" in schema else _BY_TYPE[schema["type"]]
    assert len(kinds) > 30
    assert kinds - set(i18n.SENTENCES) == set()


def test_every_request_field_has_a_japanese_name(document: dict[str, Any]) -> None:
    fields = {name for name, _ in _asked_for(document) if name}
    plain = {name for name in fields if i18n.name([name], "ja").isascii()}
    assert plain == set(), "add these to NAMES in api/i18n.py, without their unit"


def test_error_sentences_use_only_placeholders_their_error_provides() -> None:
    known: dict[str, set[str]] = {error["type"]: set(error.get("example_context") or {}) for error in list_all_errors()}
    known |= {**_own_errors(), "string_empty": set()}
    for kind, sentences in i18n.SENTENCES.items():
        for told in sentences:
            assert {name for _, name, _, _ in string.Formatter().parse(told) if name} <= known[kind], kind


@pytest.mark.parametrize(
    ("accepted", "language"),
    [
        ("ja", "ja"),
        ("ja-JP,ja;q=0.9,en-US;q=0.8,en;q=0.7", "ja"),
        ("en-US,en;q=0.9,ja;q=0.8", "en"),
        ("de,ja;q=0.5", "ja"),
        ("ja;q=0", "en"),
        ("ja;q=nonsense, *", "en"),
        ("de", "en"),
        ("", "en"),
    ],
)
def test_language_is_the_browsers_best_supported_preference(accepted: str, language: str) -> None:
    assert i18n.preferred(accepted) == language


def test_error_names_the_field_and_its_bound(client: TestClient, patient: dict[str, Any]) -> None:
    url = f"/api/patients/{patient['id']}/episodes"
    body = {"side": "left", "limits": [{"motion": 4, "highest_deg": 400}]}
    told = problem(client.post(url, json=body), 422, "invalid")
    assert told["errors"] == [
        {
            "pointer": "#/limits/0/highest_deg",
            "field": "limits 1, highest (degrees)",
            "detail": "must be 190 or less",
        }
    ]
    japanese = client.post(url, json=body, headers={"accept-language": "ja"})
    assert japanese.headers["content-language"] == "ja"
    assert japanese.json()["errors"][0] == {
        "pointer": "#/limits/0/highest_deg",
        "field": "医師による制限 1, 上限 (度)",
        "detail": "190以下にしてください",
    }
    assert (
        japanese.json()["detail"] == "入力内容を確認してください。医師による制限 1, 上限 (度): 190以下にしてください。"
    )


def test_error_without_a_field_concerns_the_request(client: TestClient) -> None:
    headers = {"content-type": "application/json", "accept-language": "ja"}
    told = client.post("/api/patients", content=b"{", headers=headers).json()
    assert told["errors"] == [{"pointer": "#/", "field": "全体", "detail": "JSONとして読み取れません"}]
