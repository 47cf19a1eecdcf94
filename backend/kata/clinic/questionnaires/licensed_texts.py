"""The texts of a questionnaire in one language. A clinic imports them as a FHIR R4 Questionnaire.

The resource needs ``language``, ``title``, ``copyright`` and one item for each item of the definition, with ``linkId`` "1", "2", ... and
``text``. ``answerOption`` may contain texts of answers: ``valueCoding`` with the answer as ``code`` and its text as ``display``. Groups, and
read-only items such as a calculated score, are ignored.
"""

import json
from collections.abc import Iterator
from typing import Any, Final

import msgspec

from kata.clinic.questionnaires.definitions import Definition

LANGUAGES: Final = ("en", "ja")
_LONGEST: Final = 1000
"""Maximum number of characters of one text."""


class ItemText(msgspec.Struct, frozen=True):
    """One question and the texts of its answers."""

    text: str
    options: dict[str, str] = {}
    """Text of an answer, by answer."""


class LicensedTexts(msgspec.Struct, frozen=True):
    """The texts of one questionnaire in one language."""

    language: str
    title: str
    copyright: str
    items: list[ItemText]


def read_texts(data: bytes, definition: Definition) -> LicensedTexts:
    """Return the texts in a file.

    :raises ValueError: when a part of the file is wrong. The message names the part.
    """
    try:
        resource = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise ValueError("the file is not JSON") from error
    if not isinstance(resource, dict) or resource.get("resourceType") != "Questionnaire":
        raise ValueError("the file is not a FHIR Questionnaire")
    if resource.get("language") not in LANGUAGES:
        raise ValueError(f"language must be one of {', '.join(LANGUAGES)}")
    texts_by_link: dict[str, ItemText] = {}
    for item in _items(resource.get("item")):
        link = str(item.get("linkId"))
        if link in texts_by_link:
            raise ValueError(f"the item {link} occurs twice")
        texts_by_link[link] = ItemText(_text(item, "text", f"item {link}"), _options(item, link))
    scales = definition.item_scales
    expected_links = [str(number) for number in range(1, len(scales) + 1)]
    if sorted(texts_by_link) != sorted(expected_links):
        raise ValueError(
            f"{definition.title} has the items 1 to {len(expected_links)}; the file has {', '.join(texts_by_link) or 'none'}"
        )
    for link, scale in zip(expected_links, scales, strict=True):
        answers = {str(answer) for answer in range(scale.lowest, scale.highest + 1)}
        if strange := sorted(set(texts_by_link[link].options) - answers):
            raise ValueError(f"item {link} is answered {scale.lowest} to {scale.highest}, not {', '.join(strange)}")
    return LicensedTexts(
        resource["language"],
        _text(resource, "title", "the questionnaire"),
        _text(resource, "copyright", "the questionnaire"),
        [texts_by_link[link] for link in expected_links],
    )


def _items(items: Any) -> Iterator[dict[str, Any]]:
    """Yield the items that have an answer, at any depth."""
    for item in items if isinstance(items, list) else []:
        if not isinstance(item, dict):
            continue
        if item.get("type") not in ("group", "display") and item.get("readOnly") is not True:
            yield item
        yield from _items(item.get("item"))


def _text(part: dict[str, Any], name: str, location: str) -> str:
    text = part.get(name)
    if not isinstance(text, str) or not text.strip() or len(text) > _LONGEST or "\0" in text:
        raise ValueError(f"{location} must have a {name} of at most {_LONGEST} characters")
    return text.strip()


def _options(item: dict[str, Any], link: str) -> dict[str, str]:
    options = {}
    for option in item.get("answerOption") or []:
        coding = option.get("valueCoding") if isinstance(option, dict) else None
        if not isinstance(coding, dict):
            raise ValueError(f"item {link}: an answerOption must have a valueCoding")
        options[_text(coding, "code", f"an answer of item {link}")] = _text(
            coding, "display", f"an answer of item {link}"
        )
    return options
