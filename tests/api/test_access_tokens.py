"""Access tokens: a program reads what its owner may read, and changes nothing."""

import json
from collections.abc import Iterator
from typing import Any
from uuid import UUID, uuid4

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select
from starlette.websockets import WebSocketDisconnect

from kata.actor import Role
from kata.audit.tables import AuditRow
from kata.auth.access_tokens import MAX_TOKENS, PREFIX
from kata.auth.tables import AccessTokenRow
from kata.auth.throttle import ADDRESS_POLICY
from tests.support.login_service import OTHER, PASSWORD, Clinic, clinic, code

DAY_S = 86_400.0
PATIENT = {"clinic_number": "T-1", "name": "N", "affected_side": "left"}


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Clinic]:
    with clinic(tmp_path_factory.mktemp("tokens")) as made:
        yield made


def created(browser: TestClient, name: str = "Nightly export", days: int = 30) -> dict[str, Any]:
    answer = browser.post("/api/me/access-tokens", json={"name": name, "valid_days": days})
    assert answer.status_code == 201, answer.text
    token: dict[str, Any] = answer.json()
    return token


def program(shared: Clinic, token: str, address: str = "127.0.0.1") -> TestClient:
    """Return a program that sends a token and has no cookie."""
    client = shared.browser(address)
    client.headers["authorization"] = f"Bearer {token}"
    return client


def of_role(shared: Clinic, role: Role) -> tuple[TestClient, TestClient]:
    """Return the browser of a user of this role, and a program with that user's token."""
    browser = shared.sign_in(shared.account(role))
    return browser, program(shared, created(browser)["token"])


def rows(shared: Clinic, action: str) -> list[AuditRow]:
    assert shared.app.state.services.audit_log.until_written()
    with shared.database.read() as session:
        return list(session.scalars(select(AuditRow).where(AuditRow.action == action).order_by(AuditRow.number)))


def test_token_reads_what_its_owner_may_read(shared: Clinic) -> None:
    _, viewers = of_role(shared, "viewer")
    _, technicians = of_role(shared, "technician")
    assert viewers.get("/api/patients").status_code == 200
    assert viewers.get("/api/stations").status_code == 200
    assert code(viewers.get("/api/operation"), 403) == "not_allowed"
    assert technicians.get("/api/operation").status_code == 200
    assert code(technicians.get("/api/patients"), 403) == "not_allowed"


def test_token_changes_nothing_and_stops_nothing(shared: Clinic) -> None:
    browser, programs = of_role(shared, "therapist")
    before = browser.get("/api/patients").json()
    assert code(programs.post("/api/patients", json=PATIENT), 403) == "token_only_reads"
    assert code(programs.post("/api/station/stop"), 403) == "token_only_reads"
    assert code(programs.post("/api/station/lease"), 403) == "token_only_reads"
    assert browser.get("/api/patients").json() == before
    stops = [row for row in rows(shared, "stop") if row.outcome == "refused"]
    assert json.loads(stops[-1].detail)["why"] == "token_only_reads"


def test_token_wins_over_a_cookie_and_never_stops(shared: Clinic) -> None:
    browser, _ = of_role(shared, "therapist")
    assert browser.get("/api/stations").status_code == 200
    browser.headers["authorization"] = f"Bearer {created(browser)['token']}"
    assert code(browser.post("/api/station/stop"), 403) == "token_only_reads"


def test_token_opens_no_websocket(shared: Clinic) -> None:
    _, programs = of_role(shared, "viewer")
    for path in ("/api/live", "/api/stations/live"):
        with pytest.raises(WebSocketDisconnect) as closed, programs.websocket_connect(path):
            pass
        assert (closed.value.code, closed.value.reason) == (1008, "token_only_reads")


def test_token_manages_neither_accounts_nor_tokens(shared: Clinic) -> None:
    programs = program(shared, created(shared.administrator)["token"])
    for path in ("/api/accounts", "/api/audit", "/api/access-tokens", "/api/me", "/api/me/access-tokens"):
        assert code(programs.get(path), 403) == "token_only_reads"
    made = programs.post("/api/me/access-tokens", json={"name": "Another", "valid_days": 366})
    assert code(made, 403) == "token_only_reads"


def test_token_is_shown_once_and_stored_as_a_hash(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    token = created(browser)
    assert token["token"].startswith(PREFIX)
    listed = browser.get("/api/me/access-tokens").json()["items"]
    assert listed == [{name: value for name, value in token.items() if name != "token"}]
    with shared.database.read() as session:
        row = session.get_one(AccessTokenRow, UUID(token["id"]))
        assert token["token"] not in str(vars(row))
    entry = rows(shared, "create_access_token")[-1]
    assert json.loads(entry.detail) == {"added": {"access_tokens": [token["id"]]}}


def test_use_of_a_token_is_recorded_with_the_token(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    token = created(browser)
    assert program(shared, token["token"]).get("/api/patients", params={"search": "export"}).status_code == 200
    entry = rows(shared, "list_patients")[-1]
    assert entry.sign_in_id == UUID(token["id"])
    assert json.loads(entry.detail) == {"access_token": token["id"]}
    while browser.get("/api/me/access-tokens").json()["items"][0]["last_used_at"] is None:
        pass
    assert not [row for row in rows(shared, "list_patients") if "changed" in row.detail]


@pytest.mark.parametrize("end", ["expired", "revoked", "by an administrator", "disabled", "reset", "role"])
def test_ended_token_is_refused_at_once(shared: Clinic, end: str) -> None:
    username = shared.account("viewer")
    browser, administrator = shared.sign_in(username), shared.administrator
    token = created(browser)
    programs, account = program(shared, token["token"]), f"/api/accounts/{shared.id_of(username)}"
    assert programs.get("/api/patients").status_code == 200
    if end == "expired":
        shared.clock.forward(30 * DAY_S)
    elif end == "revoked":
        assert browser.delete(f"/api/me/access-tokens/{token['id']}").status_code == 204
    elif end == "by an administrator":
        assert administrator.delete(f"/api/access-tokens/{token['id']}").status_code == 204
    elif end == "reset":
        assert administrator.post(f"{account}/reset", json={}).status_code == 200
    else:
        change = {"disabled": True} if end == "disabled" else {"role": "therapist"}
        assert administrator.patch(account, json=change).status_code == 200
        if end == "disabled":
            administrator.patch(account, json={"disabled": False})
    assert code(programs.get("/api/patients"), 401) == "token_ended"
    assert rows(shared, "list_patients")[-1].account_id == shared.id_of(username)


def test_user_revokes_only_their_own_tokens(shared: Clinic) -> None:
    token = created(shared.sign_in(shared.account()))
    other = shared.sign_in(shared.account())
    assert code(other.delete(f"/api/me/access-tokens/{token['id']}"), 404) == "not_found"
    assert code(other.delete(f"/api/access-tokens/{token['id']}"), 403) == "not_allowed"
    assert program(shared, token["token"]).get("/api/patients").status_code == 200
    assert code(other.delete(f"/api/me/access-tokens/{uuid4()}"), 404) == "not_found"


def test_passer_by_cannot_create_a_token(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    shared.clock.forward(601)
    given = {"name": "Mine", "valid_days": 30}
    assert code(browser.post("/api/me/access-tokens", json=given), 403) == "password_needed"
    assert code(browser.post("/api/me/access-tokens", json=given | {"password": OTHER}), 403) == "wrong_password"
    assert browser.post("/api/me/access-tokens", json=given | {"password": PASSWORD}).status_code == 201


def test_account_has_a_limited_number_of_tokens(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    tokens = [created(browser) for _ in range(MAX_TOKENS)]
    more = browser.post("/api/me/access-tokens", json={"name": "One more", "valid_days": 1})
    assert code(more, 409) == "too_many_tokens"
    browser.delete(f"/api/me/access-tokens/{tokens[0]['id']}")
    created(browser)


def test_administrator_sees_the_tokens_of_all_accounts(shared: Clinic) -> None:
    username = shared.account()
    token = created(shared.sign_in(username), "Progress of the week")
    listed = shared.administrator.get("/api/access-tokens").json()["items"]
    (found,) = [row for row in listed if row["id"] == token["id"]]
    assert (found["account_id"], found["name"]) == (str(shared.id_of(username)), "Progress of the week")
    assert "token" not in found


def test_guessed_tokens_are_throttled_and_ended_ones_are_not(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    token = created(browser)
    revoked = created(browser)
    browser.delete(f"/api/me/access-tokens/{revoked['id']}")
    stale = program(shared, revoked["token"], "192.0.2.7")
    statuses = [stale.get("/api/patients").status_code for _ in range(ADDRESS_POLICY.attempts_before_wait + 5)]
    assert set(statuses) == {401}, "a forgotten program blocks no other one"
    good = program(shared, token["token"], "192.0.2.7")
    assert good.get("/api/patients").status_code == 200
    for _ in range(ADDRESS_POLICY.attempts_before_wait):
        guesser = program(shared, f"{PREFIX}{uuid4().hex}", "192.0.2.7")
        assert code(guesser.get("/api/patients"), 401) == "token_unknown"
    assert code(guesser.get("/api/patients"), 429) == "too_many_tries"
    assert code(good.get("/api/patients"), 429) == "too_many_tries"
    assert program(shared, token["token"], "192.0.2.8").get("/api/patients").status_code == 200
    shared.clock.forward(ADDRESS_POLICY.first_s + 1.0)
    assert good.get("/api/patients").status_code == 200


def test_break_glass_access_of_the_owner_opens_nothing_to_programs(shared: Clinic) -> None:
    browser, programs = of_role(shared, "therapist")
    path = f"/api/patients/{browser.post('/api/patients', json=PATIENT | {'clinic_number': 'T-2'}).json()['id']}"
    shared.administrator.put(f"{path}/access", json={"restricted": True})
    reason = {"reason": "Acute pain, her therapist is away."}
    assert browser.post(f"{path}/break-glass-accesses", json=reason).status_code == 200
    assert browser.get(path).status_code == 200
    assert code(programs.get(path), 403) == "restricted"
    team = {"restricted": True, "account_ids": [browser.get("/api/me").json()["account_id"]]}
    shared.administrator.put(f"{path}/access", json=team)
    assert programs.get(path).status_code == 200
