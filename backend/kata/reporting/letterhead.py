"""The clinic's letterhead: name, address, telephone and logo."""

import base64
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.parsers import expat

from kata.settings import address_lines

LARGEST_LOGO: Final = 256 * 1024
"""Maximum number of bytes of a logo, because every printed page contains it."""
_LARGEST_SIDE: Final = 4000
_PNG: Final = b"\x89PNG\r\n\x1a\n"
_HEADER_LENGTH: Final = 24
_DEEPEST_SVG: Final = 100
_SVG_ELEMENTS: Final = frozenset(
    {
        "svg", "g", "defs", "symbol", "title", "desc", "metadata", "path", "rect", "circle", "ellipse", "line", "polyline", "polygon",
        "text", "tspan", "textPath", "use", "image", "style", "linearGradient", "radialGradient", "stop", "clipPath", "mask", "pattern",
        "marker", "switch", "filter", "feBlend", "feColorMatrix", "feComponentTransfer", "feComposite", "feDropShadow", "feFlood", "feFuncA",
        "feFuncB", "feFuncG", "feFuncR", "feGaussianBlur", "feMerge", "feMergeNode", "feMorphology", "feOffset", "feTile",
    }
)  # fmt: skip
"""Allowed elements of an SVG. Animation is not allowed, because it could insert an address later."""
_MOST_COPIES: Final = 10
"""Maximum number of ``use`` elements, because each can copy elements that are already copies."""
_EDITORS: Final = ("sodipodi", "inkscape", "rdf", "cc", "dc")
"""Namespace prefixes of elements that drawing programs add."""


class LetterheadError(ValueError):
    """The letterhead cannot be used. The message says why."""


@dataclass(frozen=True)
class Letterhead:
    """The head of a report. Empty parts are not printed."""

    name: str = ""
    address: tuple[str, ...] = ()
    phone: str = ""
    logo: str = ""
    """The logo as a ``data:`` URL, so that the page fetches nothing."""


def read(name: str, address: str, phone: str, logo: Path | None) -> Letterhead:
    """Return the letterhead of the settings. ``address``: in the form that :func:`kata.settings.address_lines` accepts.

    :raises LetterheadError: when the logo cannot be used.
    """
    return Letterhead(name.strip(), address_lines(address), phone.strip(), _logo(logo) if logo else "")


def _logo(file: Path) -> str:
    try:
        with file.open("rb") as opened:
            image = opened.read(LARGEST_LOGO + 1)
    except OSError as error:
        raise LetterheadError(f"The clinic's logo {file} cannot be read: {error.strerror}.") from error
    if len(image) > LARGEST_LOGO:
        raise LetterheadError(f"The clinic's logo {file} is larger than {LARGEST_LOGO // 1024} kB.")
    kind = "image/png" if image.startswith(_PNG) else "image/svg+xml"
    what_is_wrong = _wrong_png(image) if kind == "image/png" else _wrong_svg(image)
    if what_is_wrong:
        raise LetterheadError(f"The clinic's logo {file} {what_is_wrong}.")
    return f"data:{kind};base64,{base64.b64encode(image).decode()}"


def _wrong_png(image: bytes) -> str:
    if len(image) < _HEADER_LENGTH or image[12:16] != b"IHDR":
        return "is a damaged PNG"
    sides = struct.unpack(">II", image[16:24])
    return "" if all(0 < side <= _LARGEST_SIDE for side in sides) else f"has more than {_LARGEST_SIDE} pixels on a side"


def _wrong_svg(image: bytes) -> str:
    """Return the errors of an SVG. An image element runs no script and fetches nothing, but an SVG that tries to do so is still refused."""
    wrong: list[str] = []
    names: list[str] = []
    depth = 0

    def begins(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        prefix, _, local = name.rpartition(":")
        names.append(local)
        if local.lower() == "script" or any(key.lower().startswith("on") for key in attributes):
            wrong.append("is an SVG with a script or foreign parts")
        if local not in _SVG_ELEMENTS and prefix not in _EDITORS:
            wrong.append(f"is an SVG with the element {name[:40]}, which a logo does not need")
        if any(_is_external(key, value) for key, value in attributes.items()):
            wrong.append("is an SVG with external content")
        if depth > _DEEPEST_SVG:
            wrong.append("is an SVG whose elements are nested too deeply")

    def ends(name: str) -> None:
        nonlocal depth
        depth -= 1

    def writes(text: str) -> None:
        styles.append(text if names[-1:] == ["style"] else "")

    def declares(*declared: object) -> None:
        wrong.append("is an SVG with a document type")

    def instructs(*instruction: object) -> None:
        wrong.append("is an SVG with external content")

    styles: list[str] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = begins
    parser.EndElementHandler = ends
    parser.CharacterDataHandler = writes
    parser.StartDoctypeDeclHandler = declares
    parser.ProcessingInstructionHandler = instructs
    try:
        parser.Parse(image, True)
    except expat.ExpatError:
        return "is neither PNG nor SVG"
    if names.count("use") > _MOST_COPIES:
        wrong.append("is an SVG with too many copies (use)")
    if names[0] != "svg":
        return "is neither PNG nor SVG"
    if _style_fetches("".join(styles)):
        wrong.append("is an SVG with external content")
    return wrong[0] if wrong else ""


def _is_external(name: str, value: str) -> bool:
    if name.startswith("xmlns"):
        return False
    if name.rpartition(":")[2] in ("href", "src", "base"):
        # An SVG inside the SVG is refused, because it would also have to be checked.
        return not value.startswith(("#", "data:image/png;", "data:image/jpeg;"))
    return _style_fetches(value)


def _style_fetches(text: str) -> bool:
    """Return whether CSS refers to anything outside the image. A backslash is refused because it could hide such a reference."""
    lower = text.lower()
    addresses = re.findall(r"url\s*\(\s*['\"]?(.?)", lower, re.DOTALL)
    return "\\" in text or "@import" in lower or "image-set" in lower or any(first != "#" for first in addresses)
