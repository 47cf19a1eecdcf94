"""Passwords, codes, second factor, lock screen, set-up link and accounts, over HTTP."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final
from uuid import UUID

import pytest
from sqlalchemy import select
from starlette.websockets import WebSocketDisconnect

from kata.actor import Role
from kata.audit.tables import AuditRow
from kata.auth import set_up
from kata.auth.login_session import COOKIE
from tests.support.databases import emptied_afterwards
from tests.support.login_service import OTHER, PASSWORD, Clinic, clinic, code
from tests.support.second_factor import enrol
from tests.support.service import running

LIMIT_S: Final = 60.0
"""A busy computer's; the watch looks twice a second."""


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Clinic]:
    with clinic(tmp_path_factory.mktemp("accounts")) as made:
        yield made


def test_second_factor_is_required_and_each_code_works_once(shared: Clinic) -> None:
    username = shared.account()
    app, recovery = enrol(shared.sign_in(username), shared.clock.seconds())
    shared.clock.forward(60)
    given = {"username": username, "password": PASSWORD}
    assert code(shared.browser().post("/api/sign-in", json=given), 403) == "second_factor_needed"
    digits = app.at(shared.clock.seconds())
    assert code(shared.browser().post("/api/sign-in", json=given | {"code": "000000"}), 401) == "wrong_code"
    assert shared.sign_in(username, code=digits).get("/api/me").json()["second_factor"] is True
    assert code(shared.browser().post("/api/sign-in", json=given | {"code": digits}), 401) == "wrong_code"
    typed = recovery[0].replace("-", " ").lower()
    shared.sign_in(username, code=typed)
    assert code(shared.browser().post("/api/sign-in", json=given | {"code": typed}), 401) == "wrong_code"
    assert len(set(recovery)) == 10


def test_an_administrator_has_to_set_a_second_factor_up_first(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account("administrator"))
    assert browser.get("/api/me").json()["enrolling"] is True
    _, recovery = enrol(browser, shared.clock.seconds())
    assert browser.get("/api/me").json()["enrolling"] is False
    proof = {"password": PASSWORD, "code": recovery[0]}
    assert browser.request("DELETE", "/api/me/second-factor", json=proof).status_code == 204
    assert browser.get("/api/me").json()["enrolling"] is True, "a removed second factor is required again at once"


def test_second_factor_is_removed_only_with_password_and_code(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    app, _ = enrol(browser, shared.clock.seconds())
    shared.clock.forward(60)

    def remove(**given: str) -> Any:
        return browser.request("DELETE", "/api/me/second-factor", json=given)

    # Password and code are needed although the user has just signed in.
    digits = app.at(shared.clock.seconds())
    assert remove().status_code == 422
    assert code(remove(code=digits), 403) == "password_needed"
    assert code(remove(code=digits, password=OTHER), 403) == "wrong_password"
    assert code(remove(code="000000", password=PASSWORD), 403) == "wrong_code"
    assert browser.get("/api/me").json()["second_factor"] is True
    assert remove(code=digits, password=PASSWORD).status_code == 204
    assert browser.get("/api/me").json()["second_factor"] is False


def test_codes_of_a_removal_cannot_be_guessed(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    enrol(browser, shared.clock.seconds())
    statuses = [
        browser.request("DELETE", "/api/me/second-factor", json={"password": PASSWORD, "code": "000000"}).status_code
        for _ in range(6)
    ]
    assert statuses == [403] * 5 + [429]


@pytest.fixture(scope="module")
def strict(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Clinic]:
    """Return a service that demands a second factor of everyone."""
    with running(tmp_path_factory.mktemp("strict"), simulate=False, second_factor="everyone") as client:
        yield Clinic(client)


@pytest.mark.parametrize("role", ["viewer", "technician", "therapist", "administrator"])
def test_mandatory_second_factor_blocks_everything_before_enrolment(role: Role, strict: Clinic) -> None:
    browser = strict.sign_in(strict.account(role))
    assert browser.get("/api/me").json()["enrolling"] is True
    for path in ("/api/station", "/api/patients", "/api/accounts", "/api/events"):
        assert browser.get(path).status_code == 403, path
    enrol(browser, strict.clock.seconds())
    assert browser.get("/api/station").status_code == 200


def test_passer_by_cannot_change_credentials_at_an_open_screen(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    shared.clock.forward(660)
    assert code(browser.post("/api/me/second-factor", json={}), 403) == "password_needed"
    assert code(browser.post("/api/me/second-factor", json={"password": OTHER}), 403) == "wrong_password"
    assert browser.post("/api/me/second-factor", json={"password": PASSWORD}).status_code == 200


def test_page_uses_the_accounts_language_in_every_browser(shared: Clinic) -> None:
    username = shared.account()
    browser = shared.sign_in(username)
    assert browser.get("/api/me").json()["language"] == "", "the browser's language, until the user chooses one"
    assert code(browser.put("/api/me/language", json={"language": "klingon"}), 422) == "invalid"
    assert browser.put("/api/me/language", json={"language": "ja"}).json()["language"] == "ja"
    assert shared.sign_in(username).get("/api/me").json()["language"] == "ja"
    assert shared.sign_in(shared.account()).get("/api/me").json()["language"] == ""
    with shared.database.read() as session:
        newest = session.scalars(select(AuditRow).where(AuditRow.action == "choose_language")).all()[-1]
    assert (newest.outcome, newest.account_id) == ("done", UUID(browser.get("/api/me").json()["account_id"]))


def test_a_locked_screen_opens_with_the_password_alone(shared: Clinic) -> None:
    browser = shared.sign_in(shared.account())
    assert browser.post("/api/me/lock").status_code == 204
    assert browser.get("/api/me").json()["locked"] is True
    assert code(browser.post("/api/me/unlock", json={"password": OTHER}), 403) == "wrong_password"
    assert browser.post("/api/me/unlock", json={"password": PASSWORD}).json()["locked"] is False
    shared.clock.forward(901)
    assert browser.get("/api/me").json()["locked"] is True, "the user was inactive for a quarter of an hour"
    for _ in range(5):
        answer = browser.post("/api/me/unlock", json={"password": OTHER})
    assert code(browser.post("/api/me/unlock", json={"password": PASSWORD}), 429) == "too_many_tries", answer.text


@pytest.mark.parametrize("how", ["unlocked", "a new password", "a second factor"])
def test_reauthenticated_user_continues_under_a_new_secret(shared: Clinic, how: str) -> None:
    browser = shared.sign_in(shared.account())
    before, here = browser.cookies[COOKIE], browser.get("/api/me/sign-ins").json()["items"][0]["id"]
    stolen = shared.browser()
    stolen.cookies.set(COOKIE, before)
    if how == "unlocked":
        browser.post("/api/me/lock")
        assert browser.post("/api/me/unlock", json={"password": PASSWORD}).status_code == 200
    elif how == "a new password":
        change = {"old_password": PASSWORD, "password": OTHER}
        assert browser.post("/api/me/password", json=change).status_code == 204
    else:
        enrol(browser, shared.clock.seconds())
    assert browser.cookies[COOKIE] != before
    # Requests under way, such as a Stop, still use the former secret. Afterwards it is invalid.
    for request in (stolen.get("/api/me"), stolen.post("/api/station/stop"), browser.get("/api/me")):
        assert request.status_code in (200, 503), request.text
    shared.clock.forward(11)
    assert stolen.get("/api/me").status_code == 401
    assert stolen.post("/api/station/stop").status_code == 401
    assert browser.get("/api/me/sign-ins").json()["items"][0]["id"] == here, (
        "the login session continues, with its lease and sockets"
    )


def test_new_password_ends_logins_in_other_browsers(shared: Clinic) -> None:
    username = shared.account()
    here, there = shared.sign_in(username), shared.sign_in(username)
    change = {"old_password": OTHER, "password": OTHER}
    assert code(here.post("/api/me/password", json=change), 403) == "wrong_password"
    assert here.post("/api/me/password", json=change | {"old_password": PASSWORD}).status_code == 204
    assert there.get("/api/me").status_code == 401
    assert here.get("/api/me").status_code == 200
    shared.sign_in(username, OTHER)


@pytest.mark.parametrize(
    "weak",
    ["short one", "password1234", "Qwertyuiop", "Passw0rd!!!!!", "abcabcabcabc", "Kata-Clinic-1", "therapist2026!"],
)
def test_a_password_that_is_tried_first_is_refused(shared: Clinic, weak: str) -> None:
    browser = shared.sign_in(shared.account())
    answer = browser.post("/api/me/password", json={"old_password": PASSWORD, "password": weak})
    assert code(answer, 422) == "weak_password"
    assert answer.json()["errors"][0]["pointer"] == "#/password"


def test_password_equal_to_the_user_name_is_refused(shared: Clinic) -> None:
    username = shared.account()
    browser = shared.sign_in(username)
    answer = browser.post("/api/me/password", json={"old_password": PASSWORD, "password": f"{username}1!"})
    assert code(answer, 422) == "weak_password"


def test_an_account_begins_with_a_code_and_ends_disabled(shared: Clinic) -> None:
    given = {"username": "Sato", "name": "Sato Ken", "role": "therapist", "stations": ["east"]}
    made = shared.administrator.post("/api/accounts", json=given)
    assert made.status_code == 201, made.text
    account, one_time = made.json()["account"], made.json()["code"]
    assert account["username"] == "sato"
    assert account["password"] is False
    assert (
        code(shared.administrator.post("/api/accounts", json=given | {"username": "ＳＡＴＯ"}), 409) == "username_taken"
    )
    setting = {"username": "sato", "code": one_time, "password": PASSWORD}
    wrong = shared.browser().post("/api/set-password", json=setting | {"code": "AAAAA-AAAAA-AAAAA-AAAAA"})
    assert code(wrong, 401) == "wrong_code"
    assert shared.browser().post("/api/set-password", json=setting).status_code == 204
    assert code(shared.browser().post("/api/set-password", json=setting), 401) == "wrong_code"
    browser = shared.sign_in("sato")
    assert browser.get("/api/me").json()["stations"] == ["east"]

    seen = shared.administrator.patch(f"/api/accounts/{account['id']}", json={"name": "Sato K."}).json()
    assert browser.get("/api/me").json()["name"] == "Sato K.", "a change of the name ends no login session"
    stale = {"disabled": True, "updated_at": account["updated_at"]}
    assert code(shared.administrator.patch(f"/api/accounts/{account['id']}", json=stale), 409) == "edited_meanwhile"
    shut = stale | {"updated_at": seen["updated_at"]}
    assert shared.administrator.patch(f"/api/accounts/{account['id']}", json=shut).json()["disabled_at"]
    assert browser.get("/api/me").status_code == 401
    refused = shared.browser().post("/api/sign-in", json={"username": "sato", "password": PASSWORD})
    assert code(refused, 401) == "wrong_password"


@pytest.mark.parametrize("change", [{"role": "viewer"}, {"stations": ["west"]}, {"disabled": True}])
def test_changed_rights_end_every_login(shared: Clinic, change: dict[str, Any]) -> None:
    username = shared.account()
    browser = shared.sign_in(username)
    assert shared.administrator.patch(f"/api/accounts/{shared.id_of(username)}", json=change).status_code == 200
    assert browser.get("/api/me").status_code == 401


def test_reset_suspends_the_password_factor_and_logins_until_completed(shared: Clinic) -> None:
    username = shared.account()
    browser = shared.sign_in(username)
    enrol(browser, shared.clock.seconds())
    url = f"/api/accounts/{shared.id_of(username)}/reset"
    one_time = shared.administrator.post(url, json={"second_factor": True}).json()["code"]
    assert browser.get("/api/me").status_code == 401
    refused = shared.browser().post("/api/sign-in", json={"username": username, "password": PASSWORD})
    assert code(refused, 401) == "wrong_password"
    setting = {"username": username, "code": one_time, "password": OTHER}
    assert shared.browser().post("/api/set-password", json=setting).status_code == 204
    shared.sign_in(username, OTHER)
    late = shared.administrator.post(url, json={}).json()["code"]
    shared.clock.forward(24 * 3600)
    again = shared.browser().post("/api/set-password", json=setting | {"code": late})
    assert code(again, 401) == "wrong_code", "the code is valid for a day"


def test_user_locked_out_by_anothers_guessing_returns_with_a_code(shared: Clinic) -> None:
    username = shared.account()
    for _ in range(6):
        answer = shared.browser("10.0.0.9").post("/api/sign-in", json={"username": username, "password": OTHER})
    assert code(answer, 429) == "too_many_tries"
    assert int(answer.headers["retry-after"]) > 0
    one_time = shared.administrator.post(f"/api/accounts/{shared.id_of(username)}/reset", json={}).json()["code"]
    setting = {"username": username, "code": one_time, "password": OTHER}
    assert shared.browser().post("/api/set-password", json=setting).status_code == 204
    shared.sign_in(username, OTHER)


def test_last_active_administrator_cannot_be_removed(tmp_path: Path) -> None:
    with clinic(tmp_path) as alone:
        me = alone.administrator.get("/api/me").json()["account_id"]
        for change in ({"disabled": True}, {"role": "therapist"}):
            answer = alone.administrator.patch(f"/api/accounts/{me}", json=change)
            assert code(answer, 409) == "last_administrator"
        answer = alone.administrator.patch(f"/api/accounts/{me}", json={"name": "Still here"})
        assert answer.status_code == 200


def test_user_lists_and_ends_their_own_login_sessions(shared: Clinic) -> None:
    username = shared.account()
    here, there = shared.sign_in(username), shared.sign_in(username)
    other = next(item["id"] for item in there.get("/api/me/sign-ins").json()["items"] if item["here"])
    assert other in {item["id"] for item in here.get("/api/me/sign-ins").json()["items"] if not item["here"]}
    stranger = shared.sign_in(shared.account())
    assert stranger.request("DELETE", f"/api/me/sign-ins/{other}", json={}).status_code == 404
    assert there.get("/api/me").status_code == 200
    shared.clock.forward(660)
    again = here.request("DELETE", f"/api/me/sign-ins/{other}", json={})
    assert code(again, 403) == "password_needed", "another person at the screen cannot remove the second factor"
    assert here.request("DELETE", f"/api/me/sign-ins/{other}", json={"password": PASSWORD}).status_code == 204
    assert there.get("/api/me").status_code == 401


def test_set_up_link_makes_one_administrator_once(tmp_path: Path) -> None:
    with clinic(tmp_path) as fresh:
        assert fresh.app.state.services.auth.set_up_secret, "the service started without an administrator"
        given = {"secret": "made up", "username": "mori", "name": "Mori Aya", "password": PASSWORD}
        assert code(fresh.browser().post("/api/set-up", json=given), 401) == "link_used"
        given["secret"] = set_up.offer(tmp_path, fresh.clock.now())
        assert (
            code(fresh.browser().post("/api/set-up", json=given | {"password": "password1234"}), 422) == "weak_password"
        )
        first = fresh.browser()
        answer = first.post("/api/set-up", json=given)
        assert answer.status_code == 200, answer.text
        assert answer.json()["role"] == "administrator"
        assert answer.json()["enrolling"] is True
        assert code(fresh.browser().post("/api/set-up", json=given | {"username": "eve"}), 401) == "link_used"

        # Given: a clinic without access, and a link of `kata accounts link` for an existing user.
        enrol(first, fresh.clock.seconds())
        again = given | {"secret": set_up.offer(tmp_path, fresh.clock.now()), "password": OTHER}
        assert fresh.browser().post("/api/set-up", json=again).status_code == 200
        assert first.get("/api/me").status_code == 401
        assert fresh.sign_in("mori", OTHER).get("/api/me").json()["enrolling"] is True
        late = again | {"secret": set_up.offer(tmp_path, fresh.clock.now())}
        fresh.clock.forward(24 * 3600)
        assert code(fresh.browser().post("/api/set-up", json=late), 401) == "link_used"


def _until_closed(socket: Any) -> int:
    """Return the WebSocket's close code, after waiting for it."""
    try:
        while True:
            socket.receive_json()
    except WebSocketDisconnect as closed:
        return closed.code


@pytest.mark.parametrize("how", ["signed out", "disabled", "role", "by another service"])
def test_ended_login_closes_its_socket(shared: Clinic, how: str) -> None:
    username = shared.account()
    browser, other = shared.sign_in(username), shared.sign_in(shared.account())
    with other.websocket_connect("/api/live") as stays:
        stays.receive_json()
        with browser.websocket_connect("/api/live") as socket:
            socket.receive_json()
            if how == "signed out":
                assert browser.post("/api/sign-out").status_code == 204
            elif how == "by another service":
                with shared.database.write() as session:
                    session.connection().exec_driver_sql(
                        f"UPDATE sign_ins SET ended_at = '2026-01-01 00:00:00' WHERE account_id = '{shared.id_of(username).hex}'"
                    )
            else:
                change = {"role": "viewer"} if how == "role" else {"disabled": True}
                answer = shared.administrator.patch(f"/api/accounts/{shared.id_of(username)}", json=change)
                assert answer.status_code == 200
            assert _until_closed(socket) == 1008
        assert stays.receive_json()["kind"] == "change"


@pytest.mark.parametrize("what", ["disabled", "another role", "reset"])
def test_user_shut_out_stops_nothing_from_then_on(shared: Clinic, what: str) -> None:
    username = shared.account()
    browser, path = shared.sign_in(username), f"/api/accounts/{shared.id_of(username)}"
    assert browser.post("/api/station/stop").status_code in (200, 503), "the throttle forgets failures after an hour"
    if what == "reset":
        answer = shared.administrator.post(f"{path}/reset", json={})
    else:
        answer = shared.administrator.patch(path, json={"disabled": True} if what == "disabled" else {"role": "viewer"})
    assert answer.status_code == 200, answer.text
    assert code(browser.post("/api/station/stop"), 401) == "not_signed_in"


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory, postgresql_url: str) -> Iterator[tuple[Clinic, Clinic]]:
    """Return the services of two stations on one database."""
    folder = tmp_path_factory.mktemp("pair")
    with (
        emptied_afterwards(postgresql_url) as url,
        running(folder / "1", simulate=False, database_url=url) as first,
        running(folder / "2", simulate=False, database_url=url) as second,
    ):
        yield Clinic(first), Clinic(second)


@pytest.mark.parametrize("how", ["signed out there", "disabled", "another role", "a new password"])
def test_user_shut_out_by_one_service_is_refused_everywhere(how: str, pair: tuple[Clinic, Clinic]) -> None:
    """The other service refuses the user within a second, also while none of its pages listens."""
    here, there = pair
    username = here.account()
    at_both = here.sign_in(username), there.browser()
    at_both[1].cookies.update(at_both[0].cookies)
    stays = there.sign_in(there.account())
    for browser in (*at_both, stays):
        assert browser.post("/api/station/stop").status_code in (200, 503)
    if how == "signed out there":
        assert at_both[0].post("/api/sign-out").status_code == 204
    elif how == "a new password":
        change = {"old_password": PASSWORD, "password": OTHER}
        other = here.sign_in(username)
        assert other.post("/api/me/password", json=change).status_code == 204
    else:
        path = f"/api/accounts/{here.id_of(username)}"
        rights: Any = {"disabled": True} if how == "disabled" else {"role": "viewer"}
        assert here.administrator.patch(path, json=rights).status_code == 200
    limit = time.monotonic() + LIMIT_S
    while at_both[1].post("/api/station/stop").status_code != 401:
        assert time.monotonic() < limit
    assert stays.post("/api/station/stop").status_code in (200, 503)


def test_sign_in_is_one_audit_row_and_failures_name_accounts(shared: Clinic) -> None:
    username = shared.account()
    shared.sign_in(username)
    shared.browser().post("/api/sign-in", json={"username": username, "password": OTHER})
    wanted = {"account_id": str(shared.id_of(username))}
    rows = shared.administrator.get("/api/audit", params=wanted).json()["items"]
    assert [(row["action"], row["outcome"], row["who"]) for row in rows] == [
        ("sign_in_by_password", "refused", ""),
        ("sign_in_by_password", "done", "Test therapist"),
    ]
