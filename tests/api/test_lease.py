"""One browser operates the apparatus and others watch, over REST and WebSocket, with a simulated apparatus."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select

from kata.actor import Role
from kata.audit.tables import AuditRow
from kata.auth.login_session import COOKIE
from kata.clinic.episodes.limits import DoctorLimits
from kata.station.lease import STOP_AND_END_LEASE_AFTER_S
from tests.support.login import signed_in
from tests.support.open_page import shown_message
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.station_api import accepted, load, until, until_mode
from tests.support.station_commands import operate

LIMIT_S = 60.0
OPERATING = (
    "finish-teaching", "unload", "approach", "play", "pause", "reduce-range", "return", "release-torque", "acknowledge",
)  # fmt: skip


@dataclass
class Browser:
    """Another browser, with another user."""

    client: TestClient
    role: Role

    def __post_init__(self) -> None:
        app: Any = self.client.app
        self.headers = {"cookie": f"{COOKIE}={signed_in(app.state.services.database, self.role)}"}
        self.name = f"Test {self.role}"

    def post(self, path: str, body: dict[str, Any] | None = None) -> Any:
        return operate(self.client, path, body, self.headers)

    def live(self) -> dict[str, Any]:
        answer: dict[str, Any] = self.client.get("/api/station", headers=self.headers).json()["live"]
        return answer


class Page:
    """The live state that a page has received. It confirms each message, as a page's script does."""

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self._live: dict[str, Any] = {}

    def until(self, condition: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Receive until the condition holds, and return the state."""
        limit = time.monotonic() + LIMIT_S
        while not self._live or not condition(self._live):
            assert time.monotonic() < limit, (self._live.get("mode"), self._live.get("lease"))
            self._live |= shown_message(self._socket).get("live", {})
        return dict(self._live)


@contextmanager
def page(client: TestClient, browser: Browser | None = None) -> Iterator[Page]:
    """Open a page at the client's browser or at another one."""
    headers = browser.headers if browser else {}
    with client.websocket_connect("/api/live", headers=headers) as socket:
        yield Page(socket)


def noted(client: TestClient, action: str) -> list[str]:
    """Return the details of an action's audit entries."""
    app: Any = client.app
    assert app.state.services.audit_log.until_written()
    with app.state.services.database.read() as session:
        query = select(AuditRow.detail).where(AuditRow.action == action, AuditRow.outcome == "done")
        return list(session.scalars(query.order_by(AuditRow.number)))


@pytest.fixture
def other(client: TestClient) -> Browser:
    return Browser(client, "therapist")


@pytest.fixture(autouse=True)
def nobody_operates_afterwards(client: TestClient, other: Browser) -> Iterator[None]:
    yield
    assert client.post("/api/station/lease", json={"take_over": True}).status_code == 200
    assert client.delete("/api/station/lease").status_code == 200


@pytest.fixture
def recording(client: TestClient, patient: dict[str, Any]) -> dict[str, Any]:
    return taught(client, patient, lifted())


def test_only_one_client_operates_and_others_see_who(client: TestClient, other: Browser) -> None:
    until_mode(client, "idle")
    assert other.live()["lease"]["holder"] is None
    mine = client.post("/api/station/lease", json={}).json()
    assert (mine["holder"], mine["mine"]) == ("Test administrator", True)

    watched = other.live()
    assert (watched["lease"]["holder"], watched["lease"]["mine"]) == ("Test administrator", False)
    assert {refusal["code"] for refusal in watched["refusals"].values()} == {"not_operating"}
    assert set(watched["refusals"]) == {
        "teach", "finish_teaching", "load", "unload", "approach", "play", "pause", "reduce_range", "return", "release_torque",
        "acknowledge",
    }  # fmt: skip
    for command in OPERATING:
        problem(other.post(command), 409, "not_operating")
    problem(other.post("side", {"side": "left"}), 409, "not_operating")
    assert other.post("stop").status_code == 200
    until(client, lambda live: live["stops"] > watched["stops"])
    # The operator receives the device's answer.
    problem(operate(client, "play"), 409, "is_idle")


def test_the_first_command_takes_a_free_lease(client: TestClient, other: Browser) -> None:
    until_mode(client, "idle")
    problem(other.post("play"), 409, "is_idle")
    assert other.live()["lease"]["mine"] is True
    problem(operate(client, "play"), 409, "not_operating")


def test_taking_over_is_shown_at_both_browsers_and_written_down(client: TestClient, other: Browser) -> None:
    until_mode(client, "idle")
    with page(client) as mine, page(client, other) as theirs:
        assert client.post("/api/station/lease", json={}).status_code == 200
        problem(other.post("lease", {}), 409, "not_operating")
        before = noted(client, "take_over")

        taken = other.post("lease", {"take_over": True}).json()

        assert (taken["mine"], taken["holder"], taken["taken_from"]) == (True, "Test therapist", "Test administrator")
        lost = mine.until(lambda live: live["lease"]["holder"] == "Test therapist")
        assert (lost["lease"]["mine"], lost["lease"]["taken_from"]) == (False, "Test administrator")
        assert lost["refusals"]["teach"]["code"] == "not_operating"
        won = theirs.until(lambda live: live["lease"]["mine"])
        assert "teach" not in won["refusals"]
        problem(client.delete("/api/station/lease"), 409, "not_operating")
    assert noted(client, "take_over") == [*before, '{"from":"Test administrator"}']


def test_playback_without_its_browser_pauses_and_releases_after_thirty_seconds(
    client: TestClient, other: Browser, recording: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    until_mode(client, "idle")
    app: Any = client.app
    operating = app.state.services.station.lease_manager
    now = operating._now
    with page(client, other) as watching:
        with page(client) as operating_page:
            run = load(client, {"id": recording["patient_id"]}, recording, speed_percent=20.0)
            accepted(client, "approach")
            operating_page.until(lambda live: live["mode"] == "paused")
            accepted(client, "play")
            operating_page.until(lambda live: live["mode"] == "playing" and live["run"]["position_s"] > 0.5)
            # Releasing the lease would leave a held arm without an operator.
            problem(client.delete("/api/station/lease"), 409, "torque_on")

        lost = watching.until(lambda live: live["mode"] == "paused" and live["lease"]["paused"])
        assert lost["lease"]["holder"] == "Test administrator"
        assert lost["lease"]["unreachable_since"] is not None
        assert lost["torque"] == "on"
        assert lost["run"]["at_start"] is False

        monkeypatch.setattr(operating, "_now", lambda: now().later(STOP_AND_END_LEASE_AFTER_S))
        stopped = watching.until(lambda live: live["mode"] == "stopped" and live["torque"] == "off")
        assert [cause["code"] for cause in stopped["stop"]["causes"]] == ["browser_lost"]
        free = watching.until(lambda live: live["lease"]["holder"] is None)
        assert free["mode"] == "stopped"
        watching.until(lambda live: "acknowledge" not in live["refusals"])
        while (answer := other.post("acknowledge")).status_code == 409:
            # On a busy computer the drives' settings may be checked once more.
            watching.until(lambda live: "acknowledge" not in live["refusals"])
        assert answer.status_code == 200, answer.text
        watching.until(lambda live: live["mode"] == "idle" and live["lease"]["mine"])
        limit = time.monotonic() + LIMIT_S
        while client.get(f"/api/runs/{run['id']}").json()["outcome"] == "loaded":
            assert time.monotonic() < limit
    assert client.get(f"/api/runs/{run['id']}").json()["stop"]["code"] == "browser_lost"
    assert noted(client, "pause_without_browser") == ['{"operator":"Test administrator"}']
    assert noted(client, "stop_without_browser") == ['{"operator":"Test administrator"}']


def test_playback_pauses_when_the_operating_pages_script_hangs(
    client: TestClient, other: Browser, recording: dict[str, Any]
) -> None:
    """The page's connection stays open, and its browser would answer a ping."""
    until_mode(client, "idle")
    with page(client, other) as watching, page(client) as operating_page:
        load(client, {"id": recording["patient_id"]}, recording, speed_percent=20.0)
        accepted(client, "approach")
        operating_page.until(lambda live: live["mode"] == "paused")
        accepted(client, "play")
        operating_page.until(lambda live: live["mode"] == "playing" and live["run"]["position_s"] > 0.5)

        # From here on the operating page receives nothing.
        paused = watching.until(lambda live: live["mode"] == "paused" and live["lease"]["paused"])
        assert paused["lease"]["unreachable_since"] is not None

        # The script confirms states again, so the browser is present again.
        back = operating_page.until(
            lambda live: live["lease"]["unreachable_since"] is None and live["mode"] == "paused"
        )
        assert back["lease"]["mine"] is True
        accepted(client, "return")
        operating_page.until(lambda live: live["mode"] == "idle" and live["torque"] == "off")


# -- checks that take time ----------------------------------------------------------------------------------------------


def test_new_operator_does_not_inherit_a_recording_still_being_checked(
    client: TestClient, other: Browser, recording: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    until_mode(client, "idle")
    check, answers = DoctorLimits.check, []

    def meanwhile(*given: Any) -> Any:
        answers.append(other.post("lease", {"take_over": True}).status_code)
        return check(*given)

    monkeypatch.setattr(DoctorLimits, "check", meanwhile)
    with pytest.raises(AssertionError, match="not_operating"):
        load(client, {"id": recording["patient_id"]}, recording)

    assert answers == [200]
    assert until(client, lambda live: live["mode"] == "idle")["run"] is None
    visit = client.get(f"/api/patients/{recording['patient_id']}/sessions").json()["items"][0]
    assert client.get(f"/api/sessions/{visit['id']}").json()["runs"] == []


def test_limits_changed_during_loading_refuse_the_recording(
    client: TestClient, recording: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    until_mode(client, "idle")
    (episode,) = client.get(f"/api/patients/{recording['patient_id']}/episodes").json()["items"]
    check = DoctorLimits.check

    def meanwhile(*given: Any) -> Any:
        change = {"max_resistance_level": 3, "limits_by": "Dr. Mori"}
        assert client.patch(f"/api/episodes/{episode['id']}", json=change).status_code == 200
        return check(*given)

    monkeypatch.setattr(DoctorLimits, "check", meanwhile)
    with pytest.raises(AssertionError, match="edited_meanwhile"):
        load(client, {"id": recording["patient_id"]}, recording, resistance_level=8)

    assert until(client, lambda live: live["mode"] == "idle")["run"] is None
