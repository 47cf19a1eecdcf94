"""The OpenAPI document: valid, complete, and the one that the page's client was generated from."""

import json
import re
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from kata.api.app import create_app
from kata.settings import Settings
from tests.support.paths import ROOT


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return create_app(Settings()).openapi()


@pytest.mark.campaign
def test_document_is_valid_openapi(document: dict[str, Any]) -> None:
    # The import takes three seconds, which each worker would spend when it collects the tests.
    from openapi_spec_validator import validate

    validate(document)


def test_the_pages_copy_is_fresh(document: dict[str, Any]) -> None:
    stored = json.loads((ROOT / "frontend/openapi.json").read_text())
    assert stored == json.loads(json.dumps(document)), "stale: kata openapi --out frontend/openapi.json, npm run client"


def test_every_operation_describes_its_purpose_and_failures(document: dict[str, Any]) -> None:
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            where = f"{method} {path}"
            assert operation["summary"], where
            assert operation["description"], where
            assert operation["tags"], where
            failures = {status: answer for status, answer in operation["responses"].items() if status >= "400"}
            if "{" in path or method != "get":
                assert failures, where
            for answer in failures.values():
                assert list(answer["content"]) == ["application/problem+json"], where


def test_every_number_has_a_unit_or_a_range(document: dict[str, Any]) -> None:
    """Every number has a unit in its description or a range."""
    units = ("_deg", "_deg_s", "_nm", "_s", "_ms", "_hz")
    for name, schema in document["components"]["schemas"].items():
        for field, answer in schema.get("properties", {}).items():
            if field.endswith(units):
                bounded = any(key in json.dumps(answer) for key in ("minimum", "exclusiveMinimum"))
                assert answer.get("description") or bounded, f"{name}.{field}"


def test_the_live_messages_are_described(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    for kind in ("Snapshot", "Change", "Event", "Saved"):
        properties = schemas[f"{kind}Message"]["properties"]
        assert {"sequence", "estop", "mode"} <= set(properties)


def subclasses(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for subclass in model.__subclasses__():
        yield subclass
        yield from subclasses(subclass)


def test_boolean_parameters_must_be_given_explicitly(document: dict[str, Any]) -> None:
    """The document says boolean, so 0 and "no" are refused."""
    bodies = json.dumps(
        [operation.get("requestBody") for path in document["paths"].values() for operation in path.values()]
    )
    asked = set(re.findall(r"#/components/schemas/(\w+)", bodies))
    flags = {
        f"{model.__name__}.{name}": TypeAdapter(field.rebuild_annotation())
        for model in subclasses(BaseModel)
        if model.__name__ in asked and model.__module__.startswith("kata.")
        for name, field in model.model_fields.items()
        if bool in (field.annotation, *get_args(field.annotation))
    }
    assert "LeaseRequest.take_over" in flags
    assert all(takes(flag, True) for flag in flags.values())
    assert [name for name, flag in flags.items() if takes(flag, 0) or takes(flag, "no")] == []


def takes(flag: TypeAdapter[Any], value: object) -> bool:
    try:
        flag.validate_python(value)
    except ValidationError:
        return False
    return True
