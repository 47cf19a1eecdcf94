"""Requests that are refused before their route, and the security headers of every answer."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, cast
from urllib.parse import urlsplit

import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError
from starlette.websockets import WebSocketDisconnect

from kata.api import body_limits, security_middleware
from kata.settings import Settings
from kata.station.station import Station
from tests.support.service import running

_OWN = "http://testserver"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with running(tmp_path_factory.mktemp("kata"), simulate=False) as made:
        yield made


@pytest.mark.parametrize(
    "host", ["evil.example", "testserver.evil.example", "localhost.", "192.0.2.1", "", "a b", "[::2]"]
)
def test_a_host_that_is_not_ours_is_refused(client: TestClient, host: str) -> None:
    answer = client.get("/health/live", headers={"host": host})
    assert (answer.status_code, answer.json()["code"]) == (400, "unknown_host")
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/api/live", headers={"host": host}):
        pass


@pytest.mark.parametrize("host", ["testserver", "TESTSERVER:8000", "localhost:8000", "127.0.0.1", "[::1]:8000"])
def test_loopback_and_named_hosts_are_served(client: TestClient, host: str) -> None:
    assert client.get("/health/live", headers={"host": host}).status_code == 200


def test_repeated_host_header_is_refused(client: TestClient) -> None:
    twice: Any = [("host", "testserver"), ("host", "evil.example")]
    assert client.get("/health/live", headers=twice).status_code == 400


def test_only_the_listening_address_is_accepted_as_host() -> None:
    look = security_middleware.SecurityMiddleware(None, security_middleware.allowed_hosts(Settings()))  # type: ignore[arg-type]
    scope = {"type": "http", "method": "GET", "scheme": "https", "server": ("192.0.2.7", 8000)}
    served = {
        host: look.refusal(scope | {"headers": [(b"host", host)]}) is None for host in (b"192.0.2.7:8000", b"192.0.2.8")
    }
    assert served == {b"192.0.2.7:8000": True, b"192.0.2.8": False}


_FOREIGN: list[dict[str, str]] = [
    {"origin": "http://evil.example"},
    {"origin": "null"},
    {"origin": "https://testserver"},
    {"origin": "http://testserver:8001"},
    {"origin": "http://testserver.evil.example"},
    {"origin": "http://testserver@evil.example"},
    {"sec-fetch-site": "cross-site"},
    {"sec-fetch-site": "same-site"},
    {"sec-fetch-site": "none"},
    {"origin": _OWN, "sec-fetch-site": "cross-site"},
]


@pytest.mark.parametrize("headers", _FOREIGN)
def test_cross_site_changes_and_sockets_are_refused(client: TestClient, headers: dict[str, str]) -> None:
    for method in ("POST", "PUT", "PATCH", "DELETE"):
        answer = client.request(method, "/api/station/stop", headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (403, "foreign_origin")
    with pytest.raises(WebSocketDisconnect), client.websocket_connect("/api/live", headers=headers):
        pass


@pytest.mark.parametrize("headers", [{}, {"origin": _OWN}, {"origin": _OWN, "sec-fetch-site": "same-origin"}])
def test_requests_of_its_own_page_are_accepted(client: TestClient, headers: dict[str, str]) -> None:
    assert client.post("/api/station/side", headers=headers, json={"side": "nowhere"}).status_code == 422
    with client.websocket_connect("/api/live", headers=headers) as socket:
        assert socket.receive_json()["kind"] == "snapshot"


def test_other_sites_may_link_but_neither_embed_nor_read(client: TestClient) -> None:
    foreign = {"sec-fetch-site": "cross-site"}
    linked = foreign | {"sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
    assert client.get("/health/live", headers=linked).status_code == 200
    for embedded in ({"sec-fetch-mode": "no-cors", "sec-fetch-dest": "image"}, {"sec-fetch-mode": "cors"}):
        assert client.get("/health/live", headers=foreign | embedded).status_code == 403
    framed = {"sec-fetch-mode": "navigate", "sec-fetch-dest": "iframe"}
    assert client.get("/health/live", headers=foreign | framed).status_code == 403


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/", {}, None),
        ("/health/live", {}, 200),
        ("/api/nowhere", {}, 404),
        ("/health/live", {"host": "evil.example"}, 400),
        ("/health/ready?broken", {}, 500),
    ],
)
def test_every_answer_carries_the_headers(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, path: str, headers: dict[str, str], status: int | None
) -> None:
    if status == 500:
        monkeypatch.setattr(Station, "live", None)
    lenient = TestClient(client.app, raise_server_exceptions=False, cookies=client.cookies)
    answer = lenient.get(path, headers=headers)
    assert status in (None, answer.status_code)
    policy = dict(part.strip().split(" ", 1) for part in answer.headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == "'self'"
    assert policy["frame-ancestors"] == "'none'"
    assert "unsafe" not in " ".join(policy.values())
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["x-frame-options"] == "DENY"
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert answer.headers["cross-origin-opener-policy"] == "same-origin"
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert answer.headers["cache-control"] == "no-store"
    assert "access-control-allow-origin" not in answer.headers
    assert "strict-transport-security" not in answer.headers


@pytest.mark.parametrize("method", ["TRACE", "CONNECT", "OPTIONS"])
def test_unused_http_method_is_refused(client: TestClient, method: str) -> None:
    assert client.request(method, "/health/live").status_code == 405


def test_tls_answers_require_tls_in_future(client: TestClient) -> None:
    answer = TestClient(client.app, base_url="https://testserver").get("/health/live")
    assert answer.headers["strict-transport-security"] == "max-age=31536000; includeSubDomains"


def test_oversized_request_is_refused_with_or_without_a_length(client: TestClient) -> None:
    long = b'"' + b"a" * body_limits.LARGEST_BODY + b'"'
    json = {"content-type": "application/json"}
    said = client.post("/api/patients", content=long, headers=json)
    counted = client.post("/api/patients", content=iter([long[:1000], long[1000:]]), headers=json)
    assert (said.status_code, said.json()["code"]) == (413, "content_too_large")
    assert (counted.status_code, counted.json()["code"]) == (413, "content_too_large")


IMPORT: Final = "/api/patients/00000000-0000-0000-0000-000000000000/recordings/import/preview?side=right"


@pytest.mark.parametrize(
    ("path", "kind", "status"),
    [
        ("/api/sign-in", "text/csv", 413),
        ("/api/sign-in", "application/json", 413),
        ("/api/nowhere", "text/csv", 405),
        ("/api/patients", "application/json", 401),
        ("/api/patients", "text/csv", 401),
        (IMPORT, "text/csv", 401),
        ("/api/patients/import/fhir?affected_side=left", "application/fhir+json", 401),
    ],
)
def test_little_is_read_of_a_client_without_a_login(client: TestClient, path: str, kind: str, status: int) -> None:
    piece, received, answered = b"a" * (1 << 14), 0, []

    async def receive() -> dict[str, Any]:
        nonlocal received
        received += len(piece)
        return {"type": "http.request", "body": piece, "more_body": received < body_limits.LARGEST_FILE}

    async def send(message: Any) -> None:
        answered.append(message.get("status"))

    url = urlsplit(path)
    headers = [(b"host", b"testserver"), (b"content-type", kind.encode())]
    scope: dict[str, Any] = {
        "type": "http",
        "method": "POST",
        "path": url.path,
        "query_string": url.query.encode(),
        "headers": headers,
    }
    scope |= {
        "http_version": "1.1",
        "scheme": "http",
        "server": ("testserver", 80),
        "client": ("192.0.2.1", 1),
        "state": {},
    }
    assert client.portal is not None
    client.portal.call(cast(Any, client.app), scope, receive, send)
    assert answered[0] == status
    assert received <= body_limits.ANONYMOUS_BODY + len(piece)


def test_large_file_is_taken_on_file_routes_only(client: TestClient) -> None:
    long = "time_s\n" + "0\n" * body_limits.LARGEST_BODY
    answer = client.post("/api/patients", content=long, headers={"content-type": "text/csv"})
    assert (answer.status_code, answer.json()["code"]) == (413, "content_too_large")


def test_a_file_may_be_longer_than_a_form(client: TestClient) -> None:
    long = "time_s\n" + "0\n" * body_limits.LARGEST_BODY
    answer = client.post(IMPORT, content=long, headers={"content-type": "text/csv"})
    assert answer.status_code == 404


@pytest.mark.parametrize(
    "wrong",
    [
        {"allowed_hosts": "*"},
        {"allowed_hosts": "https://kata.example"},
        {"trusted_proxies": "*"},
        {"trusted_proxies": "proxy.example"},
        {"tls_certificate": Path("certificate.pem")},
        {"tls_key": Path("key.pem")},
    ],
)
def test_settings_that_would_open_everything_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Settings(**wrong)


@pytest.mark.parametrize(
    ("given", "encrypted"),
    [
        ({}, False),
        ({"host": "localhost"}, False),
        ({"host": "::1"}, False),
        ({"host": "0.0.0.0"}, True),
        ({"host": "::"}, True),
        ({"host": "192.0.2.7"}, True),
        ({"host": "kata.clinic.example"}, True),
        ({"host": "0.0.0.0", "plain_http": True}, False),
        ({"tls_certificate": Path("c.pem"), "tls_key": Path("k.pem")}, True),
    ],
)
def test_service_uses_tls_off_loopback_unless_set_otherwise(given: dict[str, Any], encrypted: bool) -> None:
    assert Settings(**given).encrypted is encrypted
