"""The page's files: original, or compressed for clients that accept it."""

import gzip
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from kata.api import documentation, static_files

pytestmark = pytest.mark.no_apparatus

SCRIPT = b"export const words = 'all of it, all of it, all of it';" * 50
PACKED = gzip.compress(SCRIPT, mtime=0)
ADDRESS = "/assets/page-1a2b.js"


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    """Return the client of a page with a script and a style in compressed form, too, and an uncompressed picture."""
    assets = tmp_path / "assets"
    assets.mkdir()
    (tmp_path / "index.html").write_text('<meta name="kata-manual" content="KATA-MANUAL" /><p>the page</p>')
    (assets / "picture.svg").write_text("<svg/>")
    for name in ("page-1a2b.js", "page-1a2b.css"):
        (assets / name).write_bytes(SCRIPT)
        (assets / f"{name}.gz").write_bytes(PACKED)
    app = FastAPI()
    static_files.install(app, tmp_path)
    with TestClient(app) as client:
        yield client


@pytest.mark.parametrize(
    ("accepted", "compressed"),
    [
        ("gzip", True),
        ("gzip, deflate, br, zstd", True),
        ("br;q=1.0, GZIP ; q=0.8, *;q=0.1", True),
        ("gzip;q=0.001", True),
        ("", False),
        ("identity", False),
        ("br, deflate", False),
        ("gzip;q=0", False),
        ("gzip; q=0.000, br", False),
        ("gzip;q=much", False),
        ("gzip;level=9", False),
        # "*" does not name gzip, so the client gets the original file.
        ("*", False),
        ("notgzip", False),
    ],
)
def test_client_accepting_gzip_receives_it(client: TestClient, accepted: str, compressed: bool) -> None:
    answer = client.get(ADDRESS, headers={"accept-encoding": accepted})
    assert answer.status_code == 200
    assert answer.headers.get("content-encoding") == ("gzip" if compressed else None)
    assert answer.content == SCRIPT
    assert int(answer.headers["content-length"]) == len(PACKED if compressed else SCRIPT)


def test_two_encoding_headers_count_as_one(client: TestClient) -> None:
    answer = client.get(ADDRESS, headers=[("accept-encoding", "br"), ("accept-encoding", "gzip")])
    assert answer.headers["content-encoding"] == "gzip"


@pytest.mark.parametrize(("name", "kind"), [("page-1a2b.js", "javascript"), ("page-1a2b.css", "text/css")])
def test_static_file_is_unchanged_and_cached_forever_in_both_encodings(
    client: TestClient, name: str, kind: str
) -> None:
    forms = [
        client.get(f"/assets/{name}", headers={"accept-encoding": encoding}).headers
        for encoding in ("gzip", "identity")
    ]
    for headers in forms:
        assert kind in headers["content-type"]
        assert headers["cache-control"] == "public, max-age=31536000, immutable"
        assert headers["vary"] == "Accept-Encoding"
    assert forms[0]["etag"] != forms[1]["etag"]


def test_file_with_one_encoding_does_not_vary(client: TestClient) -> None:
    answer = client.get("/assets/picture.svg", headers={"accept-encoding": "gzip"})
    assert answer.text == "<svg/>"
    assert "vary" not in answer.headers and "content-encoding" not in answer.headers


def test_the_compressed_form_has_no_address_of_its_own(client: TestClient) -> None:
    assert client.get(f"{ADDRESS}.gz").status_code == 404


@pytest.mark.parametrize("path", ["/%00", "/a%00b.js", "/" + "a" * 300 + ".js", "/" + "a/" * 3000 + "x"])
def test_impossible_file_name_is_no_error(client: TestClient, path: str) -> None:
    answer = client.get(path)
    # The page shows an address without a file's suffix as one of its screens.
    assert answer.status_code == (404 if path.endswith(".js") else 200)
    assert answer.status_code == 404 or "the page" in answer.text


def test_resumed_download_keeps_its_encoding(client: TestClient) -> None:
    """An interrupted download continues in the same form. In the other form it starts again."""
    packed = client.get(ADDRESS, headers={"accept-encoding": "gzip"}).headers["etag"]
    rest = {"range": "bytes=20-", "if-range": packed}
    with client.stream("GET", ADDRESS, headers={"accept-encoding": "gzip"} | rest) as same:
        assert same.status_code == 206
        assert b"".join(same.iter_raw()) == PACKED[20:]
    other = client.get(ADDRESS, headers={"accept-encoding": "identity"} | rest)
    assert other.status_code == 200
    assert other.content == SCRIPT


@pytest.mark.parametrize(("built", "content"), [(True, "yes"), (False, "no")])
def test_page_knows_whether_the_manual_is_installed(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, built: bool, content: str
) -> None:
    monkeypatch.setattr(documentation, "is_built", lambda: built)
    assert f'name="kata-manual" content="{content}"' in client.get("/patients").text
