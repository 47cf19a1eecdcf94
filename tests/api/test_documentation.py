"""The documentation at /docs/."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from kata.api import documentation
from kata.settings import Settings

pytestmark = pytest.mark.no_apparatus


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a built site with a manual in two languages, beside a file that is no part of it."""
    (tmp_path / "secret.html").write_text("secret")
    site = tmp_path / "site"
    for language in ("en", "ja"):
        (site / "manual" / language).mkdir(parents=True)
        (site / "manual" / language / "index.html").write_text(f"manual {language}")
    (site / "index.html").write_text("contents")
    return site


@pytest.fixture
def client(folder: Path) -> Iterator[TestClient]:
    app = FastAPI(docs_url=None)

    @app.get("/{path:path}")
    def page(path: str, language: str = "") -> object:
        return documentation.respond(path, language, folder)

    with TestClient(app) as client:
        yield client


def test_folder_shows_its_index(client: TestClient) -> None:
    assert client.get("/docs/").text == "contents"
    assert client.get("/docs/manual/ja/").text == "manual ja"


def test_pages_run_only_their_own_scripts(client: TestClient) -> None:
    policy = client.get("/docs/").headers["content-security-policy"].split("; ")
    assert {"default-src 'none'", "script-src 'self'", "style-src 'self'", "form-action 'self'"} <= set(policy)


def test_folder_without_a_slash_is_redirected(client: TestClient) -> None:
    for path in ("/docs", "/docs/manual/en"):
        answer = client.get(path, follow_redirects=False)
        assert (answer.status_code, answer.headers["location"]) == (307, f"{path}/")


@pytest.mark.parametrize(
    ("accepted", "language"), [("ja", "ja"), ("ja-JP,en;q=0.5", "ja"), ("en,ja;q=0.5", "en"), ("", "en"), ("de", "en")]
)
def test_manual_opens_in_the_browsers_language(client: TestClient, accepted: str, language: str) -> None:
    for path in ("/docs/manual", "/docs/manual/"):
        assert client.get(path, params={"language": accepted}).text == f"manual {language}"


@pytest.mark.parametrize(
    "path",
    ["docs/missing.html", "docs/\0", "docs/" + "a" * 300, "docs/../secret.html", "docs/manual/../../secret.html"],
)
def test_page_outside_the_site_is_not_found(folder: Path, path: str) -> None:
    answer = documentation.respond(path, "", folder)
    assert answer.status_code == 404
    assert "no such page" in bytes(answer.body).decode()


def test_unbuilt_documentation_says_how_to_build_it(tmp_path: Path) -> None:
    answer = documentation.respond("docs/", "", tmp_path)
    assert answer.status_code == 404
    assert "make docs" in bytes(answer.body).decode()
    assert "<style" not in bytes(answer.body).decode()


def test_service_sends_documentation_with_the_strict_policy(tmp_path: Path) -> None:
    from kata.api.app import create_app

    with TestClient(create_app(Settings(data=tmp_path)), base_url="http://127.0.0.1") as client:
        answer = client.get("/docs/missing.html")
        assert answer.status_code == 404
        assert "text/html" in answer.headers["content-type"]
        assert "script-src 'self'; style-src 'self';" in answer.headers["content-security-policy"]
