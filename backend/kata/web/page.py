"""The page: built files, and index.html for every address that is a screen of it."""

import secrets
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from fastapi.responses import FileResponse, HTMLResponse, PlainTextResponse, Response
from starlette.exceptions import HTTPException

from kata.web.hardening import page_policy

_IN_PACKAGE: Final = Path(__file__).parent / "page"
_IN_REPOSITORY: Final = Path(__file__).parents[3] / "frontend" / "dist"
_NONCE: Final = "KATA-NONCE"
"""Stands in the built index.html (``frontend/vite.config.ts``) for a word that is new each time."""
_FOR_EVER: Final = "public, max-age=31536000, immutable"


def install(app: FastAPI) -> None:
    """Serve it below everything else."""
    folder = _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY

    @app.get("/{path:path}", include_in_schema=False)
    def page(path: str) -> Response:
        """A file of the page, or the page itself."""
        if path == "api" or path.startswith("api/"):
            raise HTTPException(404, "There is no such address")
        file = (folder / path).resolve()
        if path not in ("", "index.html") and file.is_relative_to(folder.resolve()) and file.is_file():
            # Names of built assets change with their content.
            cache = _FOR_EVER if path.startswith("assets/") else "no-cache"
            return FileResponse(file, headers={"Cache-Control": cache})
        if "." in path.rpartition("/")[2]:
            raise HTTPException(404, "There is no such file")
        if not (folder / "index.html").is_file():
            return PlainTextResponse("The page has not been built yet: `make run` builds it.", 503)
        return _shell((folder / "index.html").read_text())


def _shell(built: str) -> HTMLResponse:
    nonce = secrets.token_urlsafe(18)
    headers = {"Cache-Control": "no-store", "Content-Security-Policy": page_policy(nonce)}
    return HTMLResponse(built.replace(_NONCE, nonce), headers=headers)
