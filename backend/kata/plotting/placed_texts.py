"""Collects the texts of a figure or table with their places. The page translates each text at its place."""

import json
from collections.abc import Iterator
from typing import Any

from kata.messages import Text


def with_texts(content: dict[str, Any]) -> dict[str, Any]:
    """Return JSON content with every Text as a plain string, and add ``texts``: code, parameters and places of each Text.

    A string that a person typed, such as a recording's name, is not a Text and not in the list. A place is a JSON pointer (RFC
    6901) into the
    content.
    """
    entries: dict[str, dict[str, Any]] = {}
    for pointer, text in _texts(content, ""):
        key = text.key
        entry = {"code": key.code, "params": key.params, "places": []}
        entries.setdefault(json.dumps([key.code, key.params]), entry)["places"].append(pointer)
    plain: dict[str, Any] = _plain(content)
    return plain | {"texts": list(entries.values())}


def _texts(content: Any, pointer: str) -> Iterator[tuple[str, Text]]:
    if isinstance(content, Text):
        yield pointer, content
    elif isinstance(content, dict):
        for name, value in content.items():
            if isinstance(value, dict | list | Text):
                yield from _texts(value, f"{pointer}/{name}")
    elif isinstance(content, list):
        for place, value in enumerate(content):
            if isinstance(value, dict | list | Text):
                yield from _texts(value, f"{pointer}/{place}")


def _plain(content: Any) -> Any:
    if isinstance(content, Text):
        return str(content)
    if isinstance(content, dict):
        return {name: _plain(value) for name, value in content.items()}
    if isinstance(content, list):
        return [_plain(value) for value in content]
    return content
