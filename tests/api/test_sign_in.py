"""Login with a password or a link, the login session, and its end."""

import time
from collections.abc import Iterator
from datetime import timedelta
from typing import Any

import pytest
from fastapi.testclient import TestClient

from kata.api import errors
from kata.auth import login_session
from kata.auth.login_session import COOKIE
from kata.auth.passwords import Passwords
from kata.auth.tables import AccountRow
from kata.database.base import utc_now
from kata.database.engine import Database
from tests.support.login import signed_in
from tests.support.service import running

pytestmark = pytest.mark.no_apparatus

PASSWORD = "seven slow swans at dawn"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Return a service without an apparatus."""
    with running(tmp_path_factory.mktemp("sign-in"), simulate=False) as made:
        yield made


@pytest.fixture
def stranger(client: TestClient) -> TestClient:
    """Return a browser without a login session."""
    return TestClient(client.app, client=("127.0.0.1", 50_001))


def database_of(client: TestClient) -> Database:
    app: Any = client.app
    database: Database = app.state.services.database
    return database


def with_password(client: TestClient, role: str = "therapist") -> str:
    """Create an account with PASSWORD; return its user name."""
    app: Any = client.app
    passwords: Passwords = app.state.services.auth.passwords
    database = database_of(client)
    cookie = signed_in(database, role)  # type: ignore[arg-type]
    with database.write() as session:
        actor = login_session.find_actor(session, cookie, utc_now())
        assert actor
        row = session.get_one(AccountRow, actor.account_id)
        row.password_hash = passwords.hash(PASSWORD)
        row.totp_confirmed_at = None
        return row.username


def test_request_without_login_has_no_user(stranger: TestClient) -> None:
    answer = stranger.get("/api/me")
    assert answer.status_code == 401
    assert answer.json()["code"] == "not_signed_in"
    stranger.cookies.set(COOKIE, "made-up")
    assert stranger.get("/api/me").status_code == 401


def test_correct_password_logs_in_and_logout_ends_the_session(client: TestClient, stranger: TestClient) -> None:
    username = with_password(client)
    answer = stranger.post("/api/sign-in", json={"username": username.upper(), "password": PASSWORD})
    assert answer.status_code == 200, answer.text
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    assert stranger.get("/api/me").json()["username"] == username
    cookie = stranger.cookies[COOKIE]
    assert stranger.post("/api/sign-out").status_code == 204
    stranger.cookies.set(COOKIE, cookie)
    assert stranger.get("/api/me").status_code == 401, "the cookie is no longer valid"


@pytest.mark.parametrize("what", ["unknown", "wrong", "disabled"])
def test_failed_login_does_not_reveal_its_reason(client: TestClient, stranger: TestClient, what: str) -> None:
    username = with_password(client)
    if what == "disabled":
        with database_of(client).write() as session:
            row = session.query(AccountRow).filter_by(username=username).one()
            row.disabled_at = utc_now()
    given = {"username": "nobody" if what == "unknown" else username, "password": PASSWORD}
    if what == "wrong":
        given["password"] += "!"
    answer = stranger.post("/api/sign-in", json=given)
    assert answer.status_code == 401
    assert answer.json()["code"] == "wrong_password"
    assert "set-cookie" not in answer.headers


def test_a_cookie_over_https_is_this_hosts_alone(client: TestClient) -> None:
    secure = TestClient(client.app, base_url="https://testserver")
    answer = secure.post("/api/sign-in", json={"username": with_password(client), "password": PASSWORD})
    found = answer.headers["set-cookie"]
    assert found.startswith("__Host-kata_sign_in=")
    assert "Secure" in found
    assert "Path=/" in found
    assert "Domain" not in found


def test_login_session_locks_when_idle_and_ends_after_a_day(client: TestClient) -> None:
    database, limits = database_of(client), login_session.Limits()
    cookie, now = signed_in(database), utc_now()
    with database.read() as session:
        early = login_session.find_actor(session, cookie, now + limits.idle - timedelta(seconds=5))
        late = login_session.find_actor(session, cookie, now + limits.idle)
        over = login_session.find_actor(session, cookie, now + limits.longest)
        before = login_session.find_actor(session, cookie, now - timedelta(hours=1))
    assert early
    assert not early.locked
    assert late
    assert late.locked
    assert over is None
    assert before is None, "the clock was set back"


def test_login_session_lasts_while_its_user_operates_a_held_arm(client: TestClient) -> None:
    database, limits = database_of(client), login_session.Limits()
    cookie, other, now = signed_in(database), signed_in(database), utc_now()
    with database.read() as session:
        here = login_session.find_actor(session, cookie, now)
        elsewhere = login_session.find_actor(session, other, now)
        assert here
        assert elsewhere
        both, operator_under_torque = {here.login_session_id, elsewhere.login_session_id}, here.login_session_id

        long_after = now + limits.longest + timedelta(minutes=59)
        assert login_session.find_actor(session, cookie, long_after, limits, operator_under_torque)
        assert login_session.find_actor(session, other, long_after, limits, operator_under_torque) is None
        assert login_session.select_active(session.connection(), both, long_after, limits, operator_under_torque) == {
            operator_under_torque
        }

        too_long = now + limits.longest + limits.extension
        assert login_session.find_actor(session, cookie, too_long, limits, operator_under_torque) is None
        assert login_session.select_active(session.connection(), both, too_long, limits, operator_under_torque) == set()
        assert login_session.select_active(session.connection(), both, long_after, limits) == set()


def test_a_demonstration_link_is_good_once(tmp_path: Any) -> None:
    with running(tmp_path) as client:
        app: Any = client.app
        for role, secret in app.state.services.auth.links.secrets.items():
            browser = TestClient(client.app)
            assert browser.post("/api/sign-in/link", json={"secret": secret}).json()["role"] == role
            assert browser.get("/api/me").json()["demonstration"] is True
            again = TestClient(client.app).post("/api/sign-in/link", json={"secret": secret})
            assert again.status_code == 401
        cookie = browser.cookies[COOKIE]
    # Given: the same clinic with a real apparatus.
    with running(tmp_path, simulate=False) as client:
        assert not dict(client.app.state.services.auth.links.secrets)  # type: ignore[attr-defined]
        client.cookies.set(COOKIE, cookie)
        assert client.get("/api/me").status_code == 401


@pytest.mark.parametrize(
    "settings",
    [
        {"simulate": False},
        {"host": "0.0.0.0"},
        *(pytest.param({"host": host}, marks=pytest.mark.campaign) for host in ("192.168.1.7", "kata")),
    ],
)
def test_demonstration_links_exist_only_on_loopback_with_a_simulated_apparatus(
    tmp_path: Any, settings: dict[str, Any]
) -> None:
    with running(tmp_path, **settings) as client:
        app: Any = client.app
        assert app.state.services.auth.links.secrets == {}
        assert client.post("/api/sign-in/link", json={"secret": ""}).status_code == 422
        assert client.post("/api/sign-in/link", json={"secret": "None"}).status_code == 401


def test_refused_guesses_are_answered_late(
    client: TestClient, stranger: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(errors, "REFUSED_AFTER_S", 0.5)
    guess = {"username": with_password(client), "password": "wrong"}
    while stranger.post("/api/sign-in", json=guess).status_code != 429:
        pass
    began = time.monotonic()
    assert stranger.post("/api/sign-in", json=guess).status_code == 429
    assert time.monotonic() - began >= 0.5


def test_known_and_unknown_names_are_refused_alike(client: TestClient, stranger: TestClient) -> None:
    found = []
    for name in (with_password(client), "nobody-at-all"):
        answers = [stranger.post("/api/sign-in", json={"username": name, "password": "wrong"}) for _ in range(6)]
        found.append([(answer.status_code, answer.json()["code"]) for answer in answers])
    assert found[0] == found[1]
    assert found[0] == [(401, "wrong_password")] * 5 + [(429, "too_many_tries")]
