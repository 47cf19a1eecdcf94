"""Every list of the API has the same envelope: `items` and the cursor `next`."""

import json
from collections.abc import Iterator
from typing import Any, Final

import pytest

from kata.pagination import Page
from tests.support.paths import ROOT

NO_LISTS: Final = {"get_session_plan": "its items are those of the session's programme"}
"""GET operations whose `items` are a part of the object, with the reason."""
_NEXT: Final = Page[str].model_json_schema()["properties"]["next"]


def wrong_lists(document: dict[str, Any]) -> Iterator[str]:
    """Yield each GET operation that returns a list without the envelope."""
    schemas = document["components"]["schemas"]
    for path, operations in document["paths"].items():
        operation = operations.get("get", {})
        answer = operation.get("responses", {}).get("200", {}).get("content", {}).get("application/json", {})
        schema = answer.get("schema", {})
        schema = schemas[schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema
        properties = schema.get("properties", {})
        is_list = (
            schema.get("type") == "array"
            or "items" in properties
            or operation.get("operationId", "").startswith("list_")
        )
        has_envelope = properties.get("items", {}).get("type") == "array" and properties.get("next") == _NEXT
        if is_list and not has_envelope and operation["operationId"] not in NO_LISTS:
            yield f"GET {path}"


def test_every_list_has_the_envelope() -> None:
    document = json.loads((ROOT / "frontend/openapi.json").read_text())
    assert list(wrong_lists(document)) == []
    names = {operation["get"]["operationId"] for operation in document["paths"].values() if "get" in operation}
    assert names >= NO_LISTS.keys()


@pytest.mark.parametrize(
    "schema",
    [
        {"type": "array", "items": {}},
        {"type": "object", "properties": {"items": {"type": "array"}}},
        {"type": "object", "properties": {"items": {"type": "array"}, "next": {"type": "integer"}}},
        {"$ref": "#/components/schemas/Rows"},
    ],
)
def test_list_without_the_envelope_is_found(schema: dict[str, Any]) -> None:
    answer = {"200": {"content": {"application/json": {"schema": schema}}}}
    document = {
        "components": {"schemas": {"Rows": {"properties": {"rows": {"type": "array"}}}}},
        "paths": {"/api/rows": {"get": {"operationId": "list_rows", "responses": answer}}},
    }
    assert list(wrong_lists(document)) == ["GET /api/rows"]
