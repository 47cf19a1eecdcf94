"""Serves the documentation at /docs/, from the files made by ``make docs`` or by the build of the wheel."""

from pathlib import Path
from typing import Final

from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse, Response

from kata.api.security_middleware import DOCUMENTATION_POLICY

_IN_PACKAGE: Final = Path(__file__).parent / "docs"
_IN_REPOSITORY: Final = Path(__file__).parents[3] / "docs" / "_build"
FOLDER: Final = _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY
_MANUAL: Final = "docs/manual"
_NOT_FOUND: Final = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Page not found</title></head>
<body>
<h1>Page not found</h1>
<p>{reason}</p>
<p lang="ja">{reason_ja}</p>
<p><a href="/">Kata</a></p>
</body></html>
"""
_NO_PAGE: Final = ("The manual has no such page.", "この手引きに該当するページはありません。")
_NOT_BUILT: Final = (
    "The manual is not installed on this computer. An administrator can build it with <code>make docs</code>.",
    "このコンピュータに手引きはインストールされていません。管理者が <code>make docs</code> で作成できます。",
)


def is_documentation(path: str) -> bool:
    """Return True if a path (without its first slash) belongs to the documentation."""
    return path == "docs" or path.startswith("docs/")


def is_built(folder: Path = FOLDER) -> bool:
    """Return True if the documentation is installed."""
    return (folder / "index.html").is_file()


def find(folder: Path, path: str) -> Path | None:
    """Return the file or folder at ``path`` within ``folder``, else None. ``path`` may be any text that a client sends."""
    try:
        target = (folder / path.lstrip("/")).resolve(strict=True)
    except (OSError, ValueError):
        # The path does not exist, is too long, or contains a NUL.
        return None
    return target if target.is_relative_to(folder.resolve()) else None


def respond(path: str, accept_language: str, folder: Path = FOLDER) -> Response:
    """Return a file of the documentation, a redirect to a folder's page, or a page that says that the documentation or the file is missing.

    ``path`` does not begin with a slash. ``/docs/manual/`` leads to the manual in the browser's language.
    """
    if not is_built(folder):
        return _missing(*_NOT_BUILT)
    if path.rstrip("/") == _MANUAL:
        language = "ja" if accept_language.strip().lower().startswith("ja") else "en"
        return RedirectResponse(f"/{_MANUAL}/{language}/")
    file = find(folder, path.removeprefix("docs"))
    if file is None:
        return _missing(*_NO_PAGE)
    if file.is_dir() and (file / "index.html").is_file():
        # Relative links of a folder's page need an address that ends with a slash.
        if not path.endswith("/"):
            return RedirectResponse(f"/{path}/")
        file /= "index.html"
    if not file.is_file():
        return _missing(*_NO_PAGE)
    headers = {"Cache-Control": "no-cache", "Content-Security-Policy": DOCUMENTATION_POLICY}
    return FileResponse(file, headers=headers)


def _missing(reason: str, reason_ja: str) -> HTMLResponse:
    return HTMLResponse(_NOT_FOUND.format(reason=reason, reason_ja=reason_ja), 404)
