"""Prints an HTML page as PDF on A4 with Kata's font."""

import io
from datetime import datetime
from typing import Final

import plutoprint
import pylopdf_fonts_cjk

from kata import __version__

_FONT: Final = "kata:sans"
_FONT_STYLE: Final = f'@font-face {{ font-family: "Kata Sans"; src: url("{_FONT}") }}'


class _OnlyOurs(plutoprint.ResourceFetcher):
    """Provide only the font and ``data:`` URLs, because a page has no other resources."""

    def fetch_url(self, url: str) -> plutoprint.ResourceData:
        if url == _FONT:
            return plutoprint.ResourceData(pylopdf_fonts_cjk.sans_path().read_bytes(), "font/otf")
        if url.startswith("data:"):
            return plutoprint.default_resource_fetcher.fetch_url(url)
        raise ValueError("a report fetches nothing")


def as_pdf(html: str, author: str, at: datetime) -> bytes:
    """Return the page as PDF, with its author and time (UTC) as metadata."""
    book = plutoprint.Book(plutoprint.PAGE_SIZE_A4, plutoprint.PAGE_MARGINS_NONE, plutoprint.MEDIA_TYPE_PRINT)
    book.custom_resource_fetcher = _OnlyOurs()
    book.load_html(html, user_style=_FONT_STYLE)
    book.set_metadata(plutoprint.PDF_METADATA_CREATOR, f"Kata {__version__}")
    book.set_metadata(plutoprint.PDF_METADATA_AUTHOR, author)
    book.set_metadata(plutoprint.PDF_METADATA_CREATION_DATE, at.strftime("%Y-%m-%dT%H:%M:%SZ"))
    stream = io.BytesIO()
    book.write_to_pdf_stream(stream)
    return stream.getvalue()
