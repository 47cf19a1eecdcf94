"""No log line, metric or file name contains what people have written: names, numbers, notes and secrets.

The service runs in its own process, as in a clinic, on a database with a canary in every column of text. Every route is asked, every
text of a request is a canary, and much of it is wrong.
"""

import io
import json
import socket
import urllib.parse
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import httpx2
import pytest

from kata.auth.login_session import COOKIE
from tests.support.login import signed_in_at
from tests.support.poisoned_clinic import PoisonedClinic
from tests.support.service import api_document
from tests.support.text_fields import text_fields

_CANARY: Final = "Kanari73"
"""In every text. Letters and digits only, so that no encoding changes it."""
_LAST: Final = {"sign_out", "lock_screen"}
"""These end the login session, so they are asked last."""
_ALWAYS: Final = {"create_patient", "sign_in_by_password"}
"""These have known answers, and are asked even if only every twelfth route is asked."""
_BUNDLE: Final = "get_support_bundle"
"""It takes seconds, and is asked once, after everything that it could contain."""
_DOCUMENT: Final = api_document()
_SCHEMAS: Final = _DOCUMENT["components"]["schemas"]


class _Canaries(PoisonedClinic):
    """A clinic with a canary in every column of text."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, [f"{_CANARY} {n}" for n in range(3)])
        self.folder = folder
        self.bundle = b""
        self.bundle_cookie = ""

    @property
    def log(self) -> str:
        return (self.folder / "service.log").read_text(errors="replace")


def _filled(schema: Any, ids: dict[str, str], name: str = "") -> Any:
    """Return a value of a schema with a canary in every text."""
    if "$ref" in schema:
        return _filled(_SCHEMAS[schema["$ref"].rpartition("/")[2]], ids, name)
    for variants in ("anyOf", "oneOf"):
        if variants in schema:
            return _filled(schema[variants][0], ids, name)
    if "const" in schema or "enum" in schema:
        return schema.get("const", schema.get("enum", [None])[0])
    match schema.get("type"), schema.get("format"):
        case "object", _:
            return {field: _filled(part, ids, field) for field, part in schema.get("properties", {}).items()}
        case "array", _:
            return [_filled(schema["items"], ids, name)]
        case "string", "uuid":
            return ids.get(name, "00000000-0000-4000-8000-000000000000")
        case "string", "date":
            return "1970-01-01"
        case "string", "date-time":
            return "2026-01-01T00:00:00Z"
        case "string", _:
            return f"{_CANARY}-{name}"[: schema.get("maxLength", 100)]
        case (("integer" | "number"), _):
            return schema.get("minimum", 1)
        case "boolean", _:
            return True
    return None


def _requests(ids: dict[str, str]) -> Iterator[tuple[str, str, str, dict[str, Any], Any]]:
    """Yield name, method, path, query and body of a request for every operation."""
    for path, methods in _DOCUMENT["paths"].items():
        for method, operation in methods.items():
            parameters = operation.get("parameters", [])
            known = {p["name"]: str(_filled(p["schema"], ids, p["name"])) for p in parameters if p["in"] == "path"}
            query = {p["name"]: _filled(p["schema"], ids, p["name"]) for p in parameters if p["in"] == "query"}
            content = operation.get("requestBody", {}).get("content", {})
            body = _filled(content["application/json"]["schema"], ids) if "application/json" in content else None
            yield operation["operationId"], method.upper(), path.format_map(known), query, body


def _ask(clinic: _Canaries, every: int) -> dict[str, int]:
    """Ask every ``every``-th route with canaries. Return the status codes of the answers by operation."""
    codes = {}
    with (
        httpx2.Client(base_url=clinic.url, cookies={COOKIE: clinic.cookie}, timeout=60) as client,
        httpx2.Client(base_url=clinic.url, cookies={COOKIE: f"{_CANARY}cookie"}, timeout=60) as stranger,
    ):
        requests = [*_requests(clinic.poison.ids)]
        chosen = [request for n, request in enumerate(requests) if n % every == 0 or request[0] in _ALWAYS]
        for name, method, path, query, body in sorted(chosen, key=lambda request: request[0] in _LAST):
            # With a login session that does not exist.
            stranger.request(method, path, json=body)
            if name == _BUNDLE:
                continue
            given = {key: value for key, value in query.items() if value is not None}
            answer = client.request(method, path, params=given, json=body)
            if answer.status_code == 422:
                # Without the filter or cursor that is refused, so that the operation itself is reached too.
                answer = client.request(method, path, json=body)
            codes[name] = answer.status_code
            if method != "GET":
                # A body that cannot be read.
                client.request(method, path, content=f'{{"name": "{_CANARY}'.encode())
        httpx2.get(f"{clinic.url}/patients/{_CANARY}?q={_CANARY}")
    return codes


def _send_no_http(port: int) -> None:
    """Send requests that the HTTP server itself refuses and may log."""
    for data in (
        f"GET /{_CANARY} HTTP/9.9\r\n\r\n",
        f"{_CANARY}\r\n\r\n",
        f"GET / HTTP/1.1\r\nHost: {_CANARY}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n",
    ):
        with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
            connection.sendall(data.encode())
            connection.recv(4096)


@pytest.fixture(scope="module", params=[24, pytest.param(1, marks=pytest.mark.campaign)])
def asked(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[_Canaries, dict[str, int]]]:
    """Return a clinic after requests to every twenty-fourth or every route, and the status codes of the answers by operation."""
    clinic = _Canaries(tmp_path_factory.mktemp("canaries"))
    try:
        codes = _ask(clinic, request.param)
        _send_no_http(clinic.port)
        clinic.bundle_cookie = signed_in_at(clinic.folder)
        bundle = httpx2.get(f"{clinic.url}/api/support-bundle", cookies={COOKIE: clinic.bundle_cookie}, timeout=60)
        codes[_BUNDLE], clinic.bundle = bundle.status_code, bundle.content
        yield clinic, codes
    finally:
        clinic.close()


@pytest.mark.timeout(600)
def test_no_log_line_contains_what_people_have_written(asked: tuple[_Canaries, dict[str, int]]) -> None:
    clinic, codes = asked
    lines = clinic.log.splitlines()
    assert len(lines) > 3, "the service has written a log"
    assert [line for line in lines if _CANARY in urllib.parse.unquote(line)] == []
    assert [name for name, code in codes.items() if code == 500] == []


def test_routes_are_reached_with_the_canaries(asked: tuple[_Canaries, dict[str, int]]) -> None:
    """Otherwise nothing could have been logged."""
    _, codes = asked
    reads = {name: code for name, code in codes.items() if name.startswith(("get_", "list_"))}
    assert sum(code == 200 for code in reads.values()) > len(reads) * 0.7, reads
    assert {codes["create_patient"], codes["sign_in_by_password"]} == {201, 401}, codes


def test_no_metric_contains_what_people_have_written(asked: tuple[_Canaries, dict[str, int]]) -> None:
    clinic, _ = asked
    fresh = signed_in_at(clinic.folder)
    metrics = httpx2.get(f"{clinic.url}/metrics", cookies={COOKIE: fresh})
    assert metrics.status_code == 200
    assert "kata_" in metrics.text
    assert _CANARY not in metrics.text


def test_no_file_name_contains_what_people_have_written(asked: tuple[_Canaries, dict[str, int]]) -> None:
    clinic, _ = asked
    names = [str(file.relative_to(clinic.folder)) for file in clinic.folder.rglob("*")]
    assert any(name.startswith("journal") for name in names), names
    assert [name for name in names if _CANARY in name] == []


def test_support_bundle_contains_nothing_that_people_have_written(asked: tuple[_Canaries, dict[str, int]]) -> None:
    clinic, codes = asked
    assert codes[_BUNDLE] == 200
    with zipfile.ZipFile(io.BytesIO(clinic.bundle)) as bundle:
        parts = {name: bundle.read(name).decode() for name in bundle.namelist()}
    assert [
        name for name, text in parts.items() if _CANARY in urllib.parse.unquote(text) or "could not be made" in text
    ] == []
    assert "kata_" in parts["metrics.txt"]
    assert "WARNING kata.cli.serve" in parts["log.txt"]
    assert json.loads(parts["database.json"])["rows"]["patients"] > 0
    assert len(json.loads(parts["events.json"])) > 0
    assert clinic.bundle_cookie not in "".join(parts.values())


def test_every_request_with_text_holds_a_canary() -> None:
    for name, _, _, query, body in _requests({}):
        content = next(
            op.get("requestBody", {}).get("content", {})
            for methods in _DOCUMENT["paths"].values()
            for op in methods.values()
            if op["operationId"] == name
        )
        if "application/json" in content and [*text_fields(content["application/json"]["schema"], _SCHEMAS)]:
            assert _CANARY in json.dumps([query, body]), name
