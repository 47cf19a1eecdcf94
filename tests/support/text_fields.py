"""Every text field of the API document, and the text fields present in an answer."""

from collections.abc import Iterator
from typing import Any, Final

_NO_TEXT: Final = ("date", "date-time", "uuid", "binary")


def text_fields(schema: Any, schemas: Any, name: str = "", seen: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield ``Schema.field`` of each free-text string in a schema, at any depth."""
    if "$ref" in schema:
        inner = schema["$ref"].rpartition("/")[2]
        if inner not in seen:
            yield from text_fields(schemas[inner], schemas, inner, (*seen, inner))
        return
    if _is_text(schema):
        yield name
    for field, subschema in schema.get("properties", {}).items():
        yield from text_fields(subschema, schemas, f"{name.partition('.')[0]}.{field}", seen)
    for part in _parts(schema):
        yield from text_fields(part, schemas, name, seen)


def texts_in(value: Any, schema: Any, schemas: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Yield the same fields with their values in an answer."""
    if "$ref" in schema:
        inner = schema["$ref"].rpartition("/")[2]
        yield from texts_in(value, schemas[inner], schemas, inner)
        return
    if isinstance(value, str) and _is_text(schema):
        yield name, value
    if isinstance(value, dict):
        for field, subschema in schema.get("properties", {}).items():
            if field in value:
                yield from texts_in(value[field], subschema, schemas, f"{name.partition('.')[0]}.{field}")
    if isinstance(value, list) and "items" in schema:
        for item in value:
            yield from texts_in(item, schema["items"], schemas, name)
    for variant in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from texts_in(value, variant, schemas, name)


def _is_text(schema: Any) -> bool:
    return (
        schema.get("type") == "string" and not {"enum", "const"} & set(schema) and schema.get("format") not in _NO_TEXT
    )


def _parts(schema: Any) -> Iterator[Any]:
    yield from schema.get("anyOf", ())
    yield from schema.get("oneOf", ())
    if "items" in schema:
        yield schema["items"]
