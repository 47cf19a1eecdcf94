"""Login by the clinic's OpenID provider: accepted and refused logins."""

import threading
from collections.abc import Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import pytest
from fastapi.testclient import TestClient
from joserfc.jwk import RSAKey
from starlette.websockets import WebSocketDisconnect

from kata.auth.openid import OpenIdError
from kata.auth.openid_provider import Provider as OurSide
from kata.cli.doctor import examine
from kata.errors import ProblemError
from kata.settings import Settings
from tests.support.login_service import Clinic, code
from tests.support.openid_provider import CLIENT, SECRET, Provider, provider
from tests.support.second_factor import enrol
from tests.support.service import running


def settings(folder: Path, made: Provider, **more: Any) -> dict[str, Any]:
    """Return the settings of a clinic with this provider."""
    file = folder / "openid-secret"
    file.write_text(SECRET)
    file.chmod(0o600)
    return {
        "openid_issuer": made.issuer,
        "openid_client_id": CLIENT,
        "openid_secret_file": file,
        "openid_name": "Clinic ID",
        "openid_second_factor": "mfa",
    } | more


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Clinic, Provider]]:
    folder = tmp_path_factory.mktemp("openid")
    with provider() as made, running(folder, simulate=False, **settings(folder, made)) as client:
        clinic = Clinic(client)
        made.now = clinic.clock.now
        yield clinic, made


@pytest.fixture
def clinic(served: tuple[Clinic, Provider]) -> Clinic:
    # No failed attempts are counted yet.
    served[0].clock.forward(4000)
    return served[0]


@pytest.fixture
def theirs(served: tuple[Clinic, Provider]) -> Iterator[Provider]:
    """Return the provider in its correct state before each test, and reset it afterwards."""
    _, made = served
    yield made
    made.claims, made.header, made.metadata = {}, {}, {}
    made.signs_with, made.forged, made.moved, made.status = None, "", "", 200


def linked(clinic: Clinic, theirs: Provider, role: Any = "therapist") -> str:
    """Create an account that is linked with the provider's present user; return its user name."""
    username = clinic.account(role)
    theirs.subject = f"subject-of-{username}"
    path = f"/api/accounts/{clinic.id_of(username)}"
    answer = clinic.administrator.patch(path, json={"openid": theirs.subject})
    assert answer.status_code == 200, answer.text
    assert answer.json()["openid"] == theirs.subject
    return username


def begin(browser: TestClient, to: str = "/patients") -> str:
    answer = browser.post("/api/sign-in/openid/begin", json={"to": to})
    assert answer.status_code == 200, answer.text
    address: str = answer.json()["address"]
    return address


def come_back(browser: TestClient, theirs: Provider, **spoilt: str) -> Any:
    """Begin a login, sign in at the provider and return, with changed parameters of the callback."""
    return browser.post("/api/sign-in/openid", json=theirs.authorize(begin(browser)) | spoilt)


def until_closed(socket: Any) -> None:
    with suppress(WebSocketDisconnect):
        while True:
            socket.receive_json()


def last_row(clinic: Clinic) -> dict[str, Any]:
    """Return the last audit row of a login by OpenID Connect."""
    rows = clinic.administrator.get("/api/audit", params={"action": "sign_in_by_openid", "limit": 1}).json()["items"]
    row: dict[str, Any] = rows[0]
    return row


def test_linked_user_signs_in_and_returns_to_the_requested_page(clinic: Clinic, theirs: Provider) -> None:
    username = linked(clinic, theirs)
    browser = clinic.browser()
    assert browser.get("/api/sign-in").json() == {"openid": "Clinic ID"}
    answer = come_back(browser, theirs)
    assert answer.status_code == 200, answer.text
    assert (answer.json()["me"]["username"], answer.json()["to"]) == (username, "/patients")
    assert browser.get("/api/me").json()["openid"] == "Clinic ID"
    row = last_row(clinic)
    assert (row["outcome"], row["account_id"], row["detail"]) == (
        "done",
        str(clinic.id_of(username)),
        {"method": "oidc"},
    )


def test_provider_is_asked_only_for_the_subject_and_every_time(clinic: Clinic, theirs: Provider) -> None:
    address = begin(clinic.browser())
    assert address.startswith(f"{theirs.issuer}/authorize?")
    asked = dict(parse_qsl(urlsplit(address).query))
    assert asked.pop("state") != asked.pop("nonce")
    assert len(asked.pop("code_challenge")) == 43
    assert asked == {
        "response_type": "code",
        "client_id": CLIENT,
        "redirect_uri": "http://testserver/sign-in/openid",
        "scope": "openid",
        "code_challenge_method": "S256",
        "prompt": "login",
        "max_age": "0",
    }


def test_no_token_of_the_provider_reaches_the_browser(clinic: Clinic, theirs: Provider) -> None:
    linked(clinic, theirs)
    answer = come_back(clinic.browser(), theirs)
    assert answer.status_code == 200
    for found in ("eyJ", "token"):
        assert found not in answer.text
    cookies = answer.headers.get_list("set-cookie")
    assert all("HttpOnly" in cookie and "SameSite=strict" in cookie for cookie in cookies)


def test_signing_in_at_the_provider_creates_no_account(clinic: Clinic, theirs: Provider) -> None:
    theirs.subject = "somebody-else"
    before = len(clinic.administrator.get("/api/accounts").json()["items"])
    browser = clinic.browser()
    answer = come_back(browser, theirs)
    assert code(answer, 403) == "not_linked"
    assert "somebody-else" in answer.json()["next_step"], "the user can give the subject to an administrator"
    assert browser.get("/api/me").status_code == 401
    assert len(clinic.administrator.get("/api/accounts").json()["items"]) == before
    row = last_row(clinic)
    assert (row["outcome"], row["account_id"], row["subject"], row["detail"]) == (
        "refused",
        None,
        "openid somebody-else",
        {"why": "not_linked"},
    )


def test_a_disabled_account_stays_out_and_is_put_out(clinic: Clinic, theirs: Provider) -> None:
    username = linked(clinic, theirs)
    browser = clinic.browser()
    assert come_back(browser, theirs).status_code == 200
    with browser.websocket_connect("/api/live") as socket:
        socket.receive_json()
        path = f"/api/accounts/{clinic.id_of(username)}"
        assert clinic.administrator.patch(path, json={"disabled": True}).status_code == 200
        until_closed(socket)
    assert browser.get("/api/me").status_code == 401
    assert code(come_back(browser, theirs), 403) == "account_disabled"
    row = last_row(clinic)
    assert (row["outcome"], row["account_id"]) == ("refused", str(clinic.id_of(username)))


@pytest.mark.parametrize("what", ["another state", "another browser", "too late", "without having begun"])
def test_login_not_begun_in_this_browser_is_refused(clinic: Clinic, theirs: Provider, what: str) -> None:
    linked(clinic, theirs)
    browser = clinic.browser()
    given = theirs.authorize(begin(browser))
    if what == "another state":
        given["state"] = theirs.authorize(begin(clinic.browser()))["state"]
    elif what == "another browser":
        browser = clinic.browser()
        begin(browser)
    elif what == "too late":
        clinic.clock.forward(601)
    else:
        browser = clinic.browser()
    assert code(browser.post("/api/sign-in/openid", json=given), 401) == "openid_not_begun"
    assert browser.get("/api/me").status_code == 401
    assert (last_row(clinic)["outcome"], last_row(clinic)["detail"]) == ("refused", {"why": "openid_not_begun"})


@pytest.mark.parametrize(
    ("claims", "header"),
    [
        pytest.param({"nonce": "another"}, {}, id="another nonce"),
        pytest.param({"nonce": None}, {}, id="no nonce"),
        pytest.param({"aud": "another service"}, {}, id="another audience"),
        pytest.param({"aud": [CLIENT, "another"], "azp": "another"}, {}, id="given to another"),
        pytest.param({"iss": "http://127.0.0.1:1"}, {}, id="another issuer"),
        pytest.param({"exp": 1}, {}, id="expired"),
        pytest.param({"exp": None}, {}, id="without end"),
        pytest.param({"iat": 10**11}, {}, id="of tomorrow"),
        pytest.param({"sub": ""}, {}, id="nobody"),
        pytest.param({"sub": 7}, {}, id="a number"),
        pytest.param({"auth_time": 1}, {}, id="signed in there long ago"),
        pytest.param({"auth_time": None}, {}, id="nobody knows when"),
        pytest.param({"at_hash": "of another"}, {}, id="of another access token"),
        pytest.param({}, {"kid": "unknown"}, id="an unknown key"),
    ],
)
def test_id_token_for_another_login_is_refused(
    clinic: Clinic, theirs: Provider, claims: dict[str, Any], header: dict[str, Any]
) -> None:
    linked(clinic, theirs)
    theirs.claims, theirs.header = claims, header
    browser = clinic.browser()
    assert code(come_back(browser, theirs), 401) == "openid_refused"
    assert browser.get("/api/me").status_code == 401
    assert (last_row(clinic)["outcome"], last_row(clinic)["detail"]) == ("refused", {"why": "openid_refused"})


def test_id_token_signed_by_another_key_is_refused(clinic: Clinic, theirs: Provider) -> None:
    linked(clinic, theirs)
    theirs.signs_with = RSAKey.generate_key(2048, {"kid": "one"})
    assert code(come_back(clinic.browser(), theirs), 401) == "openid_refused"


@pytest.mark.parametrize("algorithm", ["none", "HS256"])
def test_unsigned_or_publicly_signable_id_token_is_refused(clinic: Clinic, theirs: Provider, algorithm: str) -> None:
    linked(clinic, theirs)
    theirs.forged = algorithm
    assert code(come_back(clinic.browser(), theirs), 401) == "openid_refused"


def test_a_code_is_good_once(clinic: Clinic, theirs: Provider) -> None:
    linked(clinic, theirs)
    browser = clinic.browser()
    given = theirs.authorize(begin(browser))
    cookie = browser.cookies["kata_openid"]
    assert browser.post("/api/sign-in/openid", json=given).status_code == 200
    assert "kata_openid" not in browser.cookies
    thief = clinic.browser()
    assert code(thief.post("/api/sign-in/openid", json=given), 401) == "openid_not_begun"
    thief.cookies.set("kata_openid", cookie)
    assert code(thief.post("/api/sign-in/openid", json=given), 401) == "openid_refused"


def test_refusal_by_the_provider_or_others_is_no_login(clinic: Clinic, theirs: Provider) -> None:
    linked(clinic, theirs)
    assert code(come_back(clinic.browser(), theirs, code=""), 401) == "openid_refused"
    assert code(come_back(clinic.browser(), theirs, code="made-up"), 401) == "openid_refused"
    assert code(come_back(clinic.browser(), theirs, iss="https://evil.example"), 401) == "openid_refused"


@pytest.mark.parametrize(
    "to",
    [
        "https://evil.example",
        "//evil.example",
        "/\\evil.example",
        "\\\\evil.example",
        "javascript:alert(1)",
        "/ /x",
        "/\t/x",
        "x",
    ],
)
def test_redirects_to_other_sites_are_refused(clinic: Clinic, to: str) -> None:
    answer = clinic.browser().post("/api/sign-in/openid/begin", json={"to": to})
    assert answer.status_code == 422, answer.text


@pytest.mark.parametrize("to", ["", "/", "/patients", "/sessions?therapist=Ito%20Mai", "/patients/0f3c#x"])
def test_every_screen_can_be_wanted(clinic: Clinic, to: str) -> None:
    assert clinic.browser().post("/api/sign-in/openid/begin", json={"to": to}).status_code == 200


def test_locked_screen_is_unlocked_only_by_its_user(clinic: Clinic, theirs: Provider) -> None:
    username = linked(clinic, theirs)
    browser = clinic.browser()
    assert come_back(browser, theirs).status_code == 200
    before = [item["id"] for item in browser.get("/api/me/sign-ins").json()["items"]]
    assert browser.post("/api/me/lock").status_code == 204
    assert code(browser.get("/api/patients"), 423) == "locked"
    answer = come_back(browser, theirs).json()["me"]
    assert (answer["username"], answer["locked"]) == (username, False)
    assert [item["id"] for item in browser.get("/api/me/sign-ins").json()["items"]] == before, "the lease does not move"
    assert last_row(clinic)["detail"] == {"method": "again"}

    # Another user gets a new login session, not the locked one.
    browser.post("/api/me/lock")
    another = linked(clinic, theirs)
    assert come_back(browser, theirs).json()["me"]["username"] == another
    assert len(browser.get("/api/me/sign-ins").json()["items"]) == 1


def test_user_without_password_reauthenticates_at_the_provider(clinic: Clinic, theirs: Provider) -> None:
    username = linked(clinic, theirs)
    reset = clinic.administrator.post(f"/api/accounts/{clinic.id_of(username)}/reset", json={})
    assert reset.json()["account"]["password"] is False
    browser = clinic.browser()
    assert come_back(browser, theirs).json()["me"]["password"] is False
    clinic.clock.forward(660)
    assert code(browser.post("/api/me/second-factor", json={}), 403) == "openid_needed"
    assert come_back(browser, theirs).status_code == 200
    assert browser.post("/api/me/second-factor", json={}).status_code == 200


def test_providers_second_factor_counts_only_with_configured_values(clinic: Clinic, theirs: Provider) -> None:
    linked(clinic, theirs, "administrator")
    for claims, enrolling in (
        ({}, True),
        ({"amr": ["pwd", "otp"]}, True),
        ({"amr": ["pwd", "mfa"]}, False),
        ({"acr": "mfa"}, False),
        ({"acr": 7, "amr": [["mfa"]]}, True),
    ):
        theirs.claims = claims
        assert come_back(clinic.browser(), theirs).json()["me"]["enrolling"] is enrolling, claims


def test_own_second_factor_is_required_when_provider_asks_none(clinic: Clinic, theirs: Provider) -> None:
    username = linked(clinic, theirs)
    app, _ = enrol(clinic.sign_in(username), clinic.clock.seconds())
    clinic.clock.forward(60)
    browser = clinic.browser()
    found = come_back(browser, theirs).json()
    assert (found["me"], found["to"]) == (None, "/patients")
    assert browser.get("/api/me").status_code == 401
    assert last_row(clinic)["detail"] == {"needed": "second_factor"}
    assert code(browser.post("/api/sign-in/openid/code", json={"code": "000000"}), 401) == "wrong_code"
    answer = browser.post("/api/sign-in/openid/code", json={"code": app.at(clinic.clock.seconds())})
    assert (answer.json()["me"]["username"], answer.json()["me"]["enrolling"]) == (username, False)
    assert code(browser.post("/api/sign-in/openid/code", json={"code": "000000"}), 401) == "openid_not_begun"

    theirs.claims = {"amr": ["mfa"]}
    assert come_back(clinic.browser(), theirs).json()["me"]["username"] == username


def test_codes_are_guessed_no_faster_than_passwords(clinic: Clinic, theirs: Provider) -> None:
    username = linked(clinic, theirs)
    enrol(clinic.sign_in(username), clinic.clock.seconds())
    browser = clinic.browser()
    come_back(browser, theirs)
    for _ in range(5):
        answer = browser.post("/api/sign-in/openid/code", json={"code": "000000"})
    assert code(answer, 401) == "wrong_code"
    assert code(browser.post("/api/sign-in/openid/code", json={"code": "000000"}), 429) == "too_many_tries"


def test_unlinking_ends_login_sessions_and_identities_are_unique(clinic: Clinic, theirs: Provider) -> None:
    username = linked(clinic, theirs)
    browser = clinic.browser()
    assert come_back(browser, theirs).status_code == 200
    administrator = clinic.administrator
    other = f"/api/accounts/{clinic.id_of(clinic.account())}"
    assert code(administrator.patch(other, json={"openid": theirs.subject}), 409) == "openid_taken"
    answer = administrator.patch(f"/api/accounts/{clinic.id_of(username)}", json={"openid": ""})
    assert answer.json()["openid"] is None
    assert browser.get("/api/me").status_code == 401
    assert code(come_back(browser, theirs), 403) == "not_linked"
    assert administrator.patch(other, json={"openid": theirs.subject}).status_code == 200
    rows = administrator.get("/api/audit", params={"action": "update_account", "limit": 2}).json()["items"]
    assert all("oidc_subject" in str(row["detail"]) for row in rows)


def test_unreachable_provider_is_reported_in_a_sentence(clinic: Clinic, theirs: Provider) -> None:
    linked(clinic, theirs)
    browser = clinic.browser()
    given = theirs.authorize(begin(browser))
    theirs.status = 500
    answer = browser.post("/api/sign-in/openid", json=given)
    assert code(answer, 503) == "provider_down"
    assert "password" in answer.json()["next_step"]
    assert (last_row(clinic)["outcome"], last_row(clinic)["detail"]) == ("refused", {"why": "provider_down"})


def test_redirected_provider_request_sends_nothing(clinic: Clinic, theirs: Provider) -> None:
    linked(clinic, theirs)
    asked: list[str] = []

    class Elsewhere(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)

        do_POST = do_GET  # noqa: N815

    with ThreadingHTTPServer(("127.0.0.1", 0), Elsewhere) as elsewhere:
        threading.Thread(target=elsewhere.serve_forever).start()
        try:
            browser = clinic.browser()
            given = theirs.authorize(begin(browser))
            theirs.moved = f"http://127.0.0.1:{elsewhere.server_port}/"
            assert code(browser.post("/api/sign-in/openid", json=given), 503) == "provider_down"
            ours = OurSide(Settings(data=Path("/nowhere"), openid_issuer=theirs.issuer, openid_client_id="kata"))
            with pytest.raises(ProblemError, match="does not answer"):
                ours.count_keys()
        finally:
            elsewhere.shutdown()
    assert asked == []


def test_hanging_provider_delays_no_one_else(clinic: Clinic, theirs: Provider) -> None:
    linked(clinic, theirs)
    browser = clinic.browser()
    given = theirs.authorize(begin(browser))
    theirs.hangs = threading.Event()
    answers: list[Any] = []
    waiting = threading.Thread(target=lambda: answers.append(browser.post("/api/sign-in/openid", json=given)))
    waiting.start()
    try:
        assert clinic.browser().get("/api/sign-in").status_code == 200
        assert answers == [], "the one still waits, the other was answered"
    finally:
        theirs.hangs.set()
        waiting.join(30)
        theirs.hangs = None
    assert answers[0].status_code == 200


@pytest.mark.parametrize(
    "metadata",
    [
        {"issuer": "https://evil.example"},
        {"token_endpoint": "http://192.0.2.1/token"},
        {"jwks_uri": None},
        {"authorization_endpoint": "javascript:alert(1)"},
    ],
)
def test_wrong_or_unencrypted_provider_is_refused(tmp_path: Path, theirs: Provider, metadata: dict[str, Any]) -> None:
    theirs.metadata = metadata
    ours = OurSide(Settings(data=tmp_path, **settings(tmp_path, theirs)))
    with pytest.raises(Exception, match="does not answer"):
        ours.count_keys()
    found = {finding.name: finding for finding in examine(Settings(data=tmp_path, **settings(tmp_path, theirs)))}[
        "OpenID provider"
    ]
    assert found.state == "problem"


def test_doctor_reports_whether_the_provider_answers(tmp_path: Path, theirs: Provider) -> None:
    given = Settings(data=tmp_path, **settings(tmp_path, theirs))
    answer = {finding.name: finding for finding in examine(given)}["OpenID provider"]
    assert (answer.state, answer.message) == ("ok", f"{theirs.issuer} answers and offers 1 keys.")
    given = Settings(data=tmp_path, **settings(tmp_path, theirs) | {"openid_issuer": "http://127.0.0.1:9"})
    answer = {finding.name: finding for finding in examine(given)}["OpenID provider"]
    assert answer.state == "problem"
    assert "OpenID provider" not in {finding.name for finding in examine(Settings(data=tmp_path))}


def test_client_secret_readable_by_others_is_refused(tmp_path: Path, theirs: Provider) -> None:
    given = settings(tmp_path, theirs)
    given["openid_secret_file"].chmod(0o604)
    with pytest.raises(OpenIdError, match="chmod 600"):
        OurSide(Settings(data=tmp_path, **given))
    with pytest.raises(OpenIdError, match="cannot be read"):
        OurSide(Settings(data=tmp_path, **given | {"openid_secret_file": tmp_path / "none"}))


@pytest.mark.parametrize(
    "given",
    [
        {"openid_issuer": "https://id.example"},
        {"openid_client_id": "kata"},
        {"openid_issuer": "http://id.example", "openid_client_id": "kata"},
        {"openid_issuer": "https://id.example?x", "openid_client_id": "kata"},
    ],
)
def test_incomplete_provider_settings_are_refused(given: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"OPENID|https"):
        Settings(**given)


def test_clinic_without_a_provider_reports_this(tmp_path: Path) -> None:
    with running(tmp_path, simulate=False) as client:
        clinic = Clinic(client)
        assert client.get("/api/sign-in").json() == {"openid": None}
        assert code(client.post("/api/sign-in/openid/begin", json={}), 404) == "no_openid"
        path = f"/api/accounts/{clinic.id_of(clinic.account())}"
        assert code(clinic.administrator.patch(path, json={"openid": "somebody"}), 422) == "no_openid"
