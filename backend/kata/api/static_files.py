"""The page: built files, and index.html for every address that is a screen of it."""

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
"""Stands in the built index.html (``frontend/vite.config.ts``) for a word that is new each time."""
_MANUAL: Final = "KATA-MANUAL"
"""Stands in index.html. Replaced by "yes" if the manual is installed: only then the page links to it."""
_FOR_EVER: Final = "public, max-age=31536000, immutable"
_FOLDER: Final = _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY
_COMPRESSED: Final = ".gz"
"""Ends the name of what lies compressed beside a built file (``frontend/vite.config.ts``)."""


def install(app: FastAPI, folder: Path = _FOLDER) -> None:
    """Serve what was built into ``folder``, below everything else."""

    @app.get("/{path:path}", include_in_schema=False)
    def page(path: str, request: Request) -> Response:
        """A file of the page, or the page itself."""
        if path == "api" or path.startswith("api/"):
            raise HTTPException(404, texts.ADDRESS_NOT_FOUND())
        if documentation.is_documentation(path):
            return documentation.respond(path, request.headers.get("accept-language", ""))
        file = (folder / path).resolve()
        # What lies compressed beside a file is another form of it, and has no address of its own.
        named = path not in ("", "index.html") and file.suffix != _COMPRESSED
        if named and file.is_relative_to(folder.resolve()) and file.is_file():
            # Names of built assets change with their content.
            cache = _FOR_EVER if path.startswith("assets/") else "no-cache"
            return _file(file, cache, _takes_gzip(",".join(request.headers.getlist("accept-encoding"))))
        if "." in path.rpartition("/")[2]:
            raise HTTPException(404, texts.FILE_NOT_FOUND())
        if not (folder / "index.html").is_file():
            return PlainTextResponse("The page has not been built yet: `make run` builds it.", 503)
        return _shell((folder / "index.html").read_text())


def _file(file: Path, cache: str, takes_gzip: bool) -> FileResponse:
    """As it was built, or as it was compressed when it was built, so that nobody waits for that here.

    Each form has its own length, and so its own ETag: a part of one (Range, If-Range) is never joined to a part of the other.
    """
    compressed = file.with_name(file.name + _COMPRESSED)
    headers = {"Cache-Control": cache}
    if not compressed.is_file():
        return FileResponse(file, headers=headers)
    # Whoever keeps answers for others is to keep both.
    headers["Vary"] = "Accept-Encoding"
    if not takes_gzip:
        return FileResponse(file, headers=headers)
    kind, _ = guess_type(file.name)
    return FileResponse(compressed, media_type=kind, headers=headers | {"Content-Encoding": "gzip"})


def _takes_gzip(accepted: str) -> bool:
    """Of an Accept-Encoding (RFC 9110, 12.5.3); what cannot be read takes none, since everybody takes a file as it is."""
    for one in accepted.lower().split(","):
        name, _, weight = one.replace(" ", "").partition(";q=")
        if name == "gzip":
            try:
                return float(weight or 1) > 0
            except ValueError:
                return False
    return False


def _shell(built: str) -> HTMLResponse:
    nonce = secrets.token_urlsafe(18)
    headers = {"Cache-Control": "no-store", "Content-Security-Policy": page_policy(nonce)}
    manual = "yes" if documentation.is_built() else "no"
    return HTMLResponse(built.replace(_NONCE, nonce).replace(_MANUAL, manual), headers=headers)
