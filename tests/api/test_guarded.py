"""Commands that can start motion carry the state that their sender saw, and are refused when it has passed."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from fastapi.testclient import TestClient

from kata.auth import login
from kata.bench.running_service import GUARDED
from kata.clinic.sessions import runs
from kata.device import ipc_messages
from kata.station.guard import COMMAND_VALID_S
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.station_api import accepted, load, until, until_mode
from tests.support.station_commands import operate, seen

EACH = sorted(GUARDED)
SEEN_LIMIT = timedelta(seconds=COMMAND_VALID_S)


def shifted(body: dict[str, Any], by: timedelta) -> dict[str, Any]:
    return body | {"seen_at": (datetime.fromisoformat(body["seen_at"]) + by).isoformat()}


def station(client: TestClient) -> Any:
    app: Any = client.app
    return app.state.services.station


def sent(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> list[ipc_messages.Command]:
    """Return a list that collects the commands to the device process."""
    process, heard = station(client)._process, []
    send = process.send

    def listen(message: ipc_messages.ToDevice) -> None:
        if isinstance(message, ipc_messages.Request):
            heard.append(message.command)
        send(message)

    monkeypatch.setattr(process, "send", listen)
    return heard


@pytest.fixture
def recording(client: TestClient, patient: dict[str, Any]) -> dict[str, Any]:
    return taught(client, patient, lifted())


@pytest.mark.parametrize("command", EACH)
def test_a_command_without_the_seen_state_is_refused(
    client: TestClient, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    until_mode(client, "idle")
    heard = sent(client, monkeypatch)
    fresh = seen(client)
    naive = fresh["seen_at"].removesuffix("Z")
    for body in (None, {}, {"stops": 0}, fresh | {"stops": -1}, fresh | {"stops": True}, fresh | {"seen_at": naive}):
        answer = client.post(f"/api/station/{command}", json=body)
        problem(answer, 422, "invalid")
    assert heard == []


@pytest.mark.parametrize("command", EACH)
def test_an_old_state_never_reaches_the_device(
    client: TestClient, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    until_mode(client, "idle")
    heard = sent(client, monkeypatch)

    refusal = problem(operate(client, command, shifted(seen(client), -SEEN_LIMIT)), 409, "expired")
    assert refusal["next_step"]
    problem(operate(client, command, shifted(seen(client), timedelta(seconds=5))), 409, "seen_in_future")

    assert heard == []


def test_an_expired_command_takes_no_lease(client: TestClient) -> None:
    until_mode(client, "idle")
    assert client.delete("/api/station/lease").status_code == 200

    problem(operate(client, "play", shifted(seen(client), -SEEN_LIMIT)), 409, "expired")

    assert client.get("/api/station").json()["live"]["lease"]["holder"] is None


def test_a_command_that_waited_for_the_database_expires(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    until_mode(client, "idle")
    body = seen(client)
    clock = station(client).clock
    now_ns, look_up = clock._now_ns, login.authenticate

    def slowly(*given: Any) -> Any:
        found = look_up(*given)
        clock._now_ns = lambda: now_ns() + int(COMMAND_VALID_S * 1e9)
        return found

    monkeypatch.setattr(clock, "_now_ns", now_ns)
    monkeypatch.setattr("kata.api.authorization.authenticate", slowly)

    problem(operate(client, "play", body), 409, "expired")


def test_the_device_gets_the_counter_and_the_expiry(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    until_mode(client, "idle")
    heard = sent(client, monkeypatch)
    body = seen(client) | {"stops": 41}
    began_ns = station(client).clock._now_ns()

    operate(client, "acknowledge", body)

    (command,) = heard
    assert isinstance(command, ipc_messages.Acknowledge)
    assert command.stops == 41
    assert 0 < command.expires_ns - began_ns <= COMMAND_VALID_S * 1e9


def test_torque_is_released_only_while_stopped(client: TestClient) -> None:
    until_mode(client, "idle")
    problem(operate(client, "release-torque"), 409, "is_idle")


def test_every_message_has_its_own_time(client: TestClient) -> None:
    until_mode(client, "idle")
    with client.websocket_connect("/api/live") as socket:
        lives = [message["live"] for message in (socket.receive_json() for _ in range(20)) if "live" in message]

    assert lives[0]["stops"] >= 0
    assert lives[0]["torque"] == "off"
    times = [datetime.fromisoformat(live["at"]) for live in lives]
    assert times == sorted(set(times))
    assert abs(datetime.now(UTC) - times[-1]) < timedelta(seconds=10)


def test_a_stop_voids_commands_that_were_sent_before(client: TestClient, recording: dict[str, Any]) -> None:
    load(client, {"id": recording["patient_id"]}, recording)
    until_mode(client, "ready")
    before = seen(client)
    accepted(client, "stop")

    problem(operate(client, "approach", before), 409, "stopped_meanwhile")

    live = until_mode(client, "stopped")
    assert live["stops"] > before["stops"]
    assert live["torque"] == "off"
    problem(operate(client, "acknowledge", before), 409, "stopped_meanwhile")
    accepted(client, "acknowledge")
    until_mode(client, "idle")


def test_load_during_playback_reaches_neither_database_nor_device(
    client: TestClient, recording: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The request comes from another page of the operating browser, so the lease does not refuse it."""
    until_mode(client, "idle")
    run = load(client, {"id": recording["patient_id"]}, recording, speed_percent=20.0)
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until_mode(client, "playing")
    heard = sent(client, monkeypatch)
    looked_up: list[str] = []
    monkeypatch.setattr(runs, "prepare", lambda *given: looked_up.append("run"))
    monkeypatch.setattr("kata.api.station_router._begin_teaching", lambda *given: looked_up.append("teaching"))
    body = {"session_id": run["session_id"], "resistance_level": 25, "recording_id": recording["id"]}
    teach = {"patient_id": recording["patient_id"], "fixtures": ["arm_fixer_1"]}

    problem(client.post("/api/station/load", json=body), 409, "is_playing")
    problem(client.post("/api/station/teach", json=teach), 409, "is_playing")

    assert (looked_up, heard) == ([], [])
    accepted(client, "stop")
    until(client, lambda live: live["torque"] == "off" and "acknowledge" not in live["refusals"])
    accepted(client, "acknowledge")
    until_mode(client, "idle")
