"""Serve the page's built files, and index.html at the address of every screen."""

import secrets
from mimetypes import guess_type
from pathlib import Path
from typing import Final

from fastapi import FastAPI, Request
from fastapi.responses import FileResponse, HTMLResponse, PlainTextResponse, Response
from starlette.exceptions import HTTPException

from kata.api import documentation, texts
from kata.api.security_middleware import page_policy

_IN_PACKAGE: Final = Path(__file__).parent / "page"
_IN_REPOSITORY: Final = Path(__file__).parents[3] / "frontend" / "dist"
_NONCE: Final = "KATA-NONCE"
"""Placeholder in the built index.html (``frontend/vite.config.ts``). Each answer contains a new nonce in its place."""
_MANUAL: Final = "KATA-MANUAL"
"""Placeholder in index.html. It becomes "yes" if the manual is installed, because the page links only to an installed manual."""
_IMMUTABLE: Final = "public, max-age=31536000, immutable"
_FOLDER: Final = _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY
_COMPRESSED: Final = ".gz"
"""Suffix of the compressed form of a built file (``frontend/vite.config.ts``)."""


def install(app: FastAPI, folder: Path = _FOLDER) -> None:
    """Serve the files of ``folder`` at all addresses that no other route matches."""

    @app.get("/{path:path}", include_in_schema=False)
    def page(path: str, request: Request) -> Response:
        """Return a file, or index.html."""
        if path == "api" or path.startswith("api/"):
            raise HTTPException(404, texts.ADDRESS_NOT_FOUND())
        if documentation.is_documentation(path):
            return documentation.respond(path, request.headers.get("accept-language", ""))
        file = documentation.find(folder, path)
        # A compressed file is only another form of its original and has no address.
        is_named = path not in ("", "index.html")
        if is_named and file and file.is_file() and file.suffix != _COMPRESSED:
            # Names of built assets change with their content.
            cache = _IMMUTABLE if path.startswith("assets/") else "no-cache"
            return _file(file, cache, _takes_gzip(",".join(request.headers.getlist("accept-encoding"))))
        if "." in path.rpartition("/")[2]:
            raise HTTPException(404, texts.FILE_NOT_FOUND())
        if not (folder / "index.html").is_file():
            return PlainTextResponse("The page has not been built yet: `make run` builds it.", 503)
        return _index_page((folder / "index.html").read_text())


def _file(file: Path, cache: str, takes_gzip: bool) -> FileResponse:
    """Return a built file or its precompressed form.

    Each form has its own length and ETag, so that a client never joins parts of both (Range, If-Range).
    """
    compressed = file.with_name(file.name + _COMPRESSED)
    headers = {"Cache-Control": cache}
    if not compressed.is_file():
        return FileResponse(file, headers=headers)
    # A shared cache must store both forms.
    headers["Vary"] = "Accept-Encoding"
    if not takes_gzip:
        return FileResponse(file, headers=headers)
    kind, _ = guess_type(file.name)
    return FileResponse(compressed, media_type=kind, headers=headers | {"Content-Encoding": "gzip"})


def _takes_gzip(accepted: str) -> bool:
    """Return whether an Accept-Encoding header (RFC 9110, 12.5.3) allows gzip; False if it cannot be parsed."""
    for encoding in accepted.lower().split(","):
        name, _, weight = encoding.replace(" ", "").partition(";q=")
        if name == "gzip":
            try:
                return float(weight or 1) > 0
            except ValueError:
                return False
    return False


def _index_page(built: str) -> HTMLResponse:
    nonce = secrets.token_urlsafe(18)
    headers = {"Cache-Control": "no-store", "Content-Security-Policy": page_policy(nonce)}
    manual = "yes" if documentation.is_built() else "no"
    return HTMLResponse(built.replace(_NONCE, nonce).replace(_MANUAL, manual), headers=headers)
