"""Errors name the field, by codes that the page translates."""

import ast
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from pydantic_core._pydantic_core import list_all_errors

from kata import i18n
from kata.messages import Text, key_of
from tests.support.paths import ROOT
from tests.support.responses import problem
from tests.support.service import api_document

pytestmark = pytest.mark.no_apparatus

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
    return api_document()


def _asked_for(document: dict[str, Any]) -> Iterator[tuple[str | None, dict[str, Any]]]:
    """Yield every schema of a request with the name of its field."""
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


def _codes(text: Text) -> Iterator[str]:
    """Return the codes of a text and of its nested texts."""

    def codes(text: dict[str, Any]) -> Iterator[str]:
        yield text["code"]
        for value in text["params"].values():
            if isinstance(value, dict):
                yield from codes(value)

    return codes(text.nested)


def _own_errors() -> dict[str, set[str]]:
    """Yield each own error type with its parameters."""
    found = {}
    sources = (path.read_text() for path in (ROOT / "backend/kata").rglob("*.py"))
    for source in (text for text in sources if "PydanticCustomError" in text):
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "PydanticCustomError":
                assert isinstance(node.args[0], ast.Constant)
                answer = node.args[2].keys if len(node.args) > 2 and isinstance(node.args[2], ast.Dict) else []
                found[str(node.args[0].value)] = {str(key.value) for key in answer if isinstance(key, ast.Constant)}
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
    without_code = {name for name in fields if key_of(i18n.name([name])) is None or "" in _codes(i18n.name([name]))}
    assert without_code == set(), "add these to _NAMES in i18n.py, without their unit"


def test_error_sentences_use_only_placeholders_their_error_provides() -> None:
    known: dict[str, set[str]] = {error["type"]: set(error.get("example_context") or {}) for error in list_all_errors()}
    known |= {**_own_errors(), "string_empty": set()}
    for kind, template in i18n.SENTENCES.items():
        assert template.params.keys() <= known[kind], kind


def test_error_names_the_field_and_its_bound(client: TestClient, patient: dict[str, Any]) -> None:
    url = f"/api/patients/{patient['id']}/episodes"
    body = {"side": "left", "limits": [{"motion": 4, "highest_deg": 400}]}
    refusal = problem(client.post(url, json=body), 422, "invalid")
    (wrong,) = refusal["errors"]
    assert (wrong["pointer"], wrong["field"]) == ("#/limits/0/highest_deg", "doctor's limits 1, highest (°)")
    assert wrong["detail"] == "must be 190 or less"
    assert wrong["detail_key"] == {"code": "invalid_less_than_equal", "params": {"le": 190.0}}
    outer, inner = (wrong["field_key"]["params"][name] for name in ("outer", "inner"))
    assert (wrong["field_key"]["code"], outer["code"], inner["code"]) == (
        "field_within", "field_numbered", "field_with_unit",
    )  # fmt: skip
    assert inner["params"]["unit"] == {"code": "unit_deg", "params": {}, "text": "°"}
    assert refusal["detail"] == "Please check what was entered: doctor's limits 1, highest (°) must be 190 or less."
    assert refusal["detail_key"]["code"] == "invalid_input"


def test_what_is_no_field_is_the_request(client: TestClient) -> None:
    headers = {"content-type": "application/json"}
    answer = client.post("/api/patients", content=b"{", headers=headers).json()
    (wrong,) = answer["errors"]
    assert (wrong["pointer"], wrong["field"], wrong["detail"]) == ("#/", "the request", "is not JSON")


def test_a_place_without_a_name_has_no_code() -> None:
    assert key_of(i18n.name([0])) is None
    assert (i18n.name([0]), i18n.name(["of_others"])) == ("1", "of others")
