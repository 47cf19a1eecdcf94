"""The clinic's letterhead: name, address, telephone and logo."""

import base64
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.parsers import expat

LARGEST_LOGO: Final = 256 * 1024
"""Bytes. The logo is part of every printed page."""
_LARGEST_SIDE: Final = 4000
_PNG: Final = b"\x89PNG\r\n\x1a\n"
_HEADER_LENGTH: Final = 24


class LetterheadError(ValueError):
    """The letterhead cannot be used. The message has the reason."""


@dataclass(frozen=True)
class Letterhead:
    """The head of a report. Empty parts are left out."""

    name: str = ""
    address: tuple[str, ...] = ()
    phone: str = ""
    logo: str = ""
    """A ``data:`` URL, so that the page fetches nothing."""


def read(name: str, address: str, phone: str, logo: Path | None) -> Letterhead:
    """Return the letterhead of the settings. ``|`` separates the lines of the address.

    :raises LetterheadError: when the logo cannot be used.
    """
    lines = tuple(line.strip() for line in address.split("|") if line.strip())
    return Letterhead(name.strip(), lines, phone.strip(), _logo(logo) if logo else "")


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
    return "" if all(0 < side <= _LARGEST_SIDE for side in sides) else f"has more than {_LARGEST_SIDE} pixels a side"


def _wrong_svg(image: bytes) -> str:
    """Return the errors of an SVG. An image element runs no scripts and fetches nothing; an SVG that tries to is refused nevertheless."""
    wrong: list[str] = []
    names: list[str] = []

    def begins(name: str, attributes: dict[str, str]) -> None:
        names.append(name.rpartition(":")[2])
        if names[-1] in ("script", "foreignObject") or any(key.lower().startswith("on") for key in attributes):
            wrong.append("is an SVG with a script or foreign parts")
        if any(
            key.rpartition(":")[2] == "href" and not value.startswith(("#", "data:image/"))
            for key, value in attributes.items()
        ):
            wrong.append("is an SVG with external content")

    def declares(*declared: object) -> None:
        wrong.append("is an SVG with a document type")

    parser = expat.ParserCreate()
    parser.StartElementHandler = begins
    parser.StartDoctypeDeclHandler = declares
    try:
        parser.Parse(image, True)
    except expat.ExpatError:
        return "is neither PNG nor SVG"
    if names[0] != "svg":
        return "is neither PNG nor SVG"
    return wrong[0] if wrong else ""
