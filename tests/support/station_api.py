"""Station requests through the API: wait for a state, teach, load."""

import time
from collections.abc import Callable
from typing import Any

from fastapi.testclient import TestClient

from tests.support.open_page import shown_message
from tests.support.preflight import go_through_checklist, teaching
from tests.support.station_commands import operate


def until(client: TestClient, condition: Callable[[dict[str, Any]], object], within_s: float = 30.0) -> dict[str, Any]:
    """Receive from the WebSocket until the live state fulfils the condition; return that state."""
    limit = time.monotonic() + within_s
    live: dict[str, Any] = {}
    with client.websocket_connect("/api/live") as socket:
        while True:
            live |= shown_message(socket).get("live", {})
            if condition(live):
                return live
            assert time.monotonic() < limit, (live["mode"], live["stop"], live["refusals"].get("teach"))


def until_mode(client: TestClient, mode: str, within_s: float = 30.0) -> dict[str, Any]:
    return until(client, lambda live: live["mode"] == mode, within_s)


def accepted(client: TestClient, command: str, body: dict[str, Any] | None = None) -> dict[str, Any]:
    """Send a command; repeat it while the drives' settings are being checked or a busy computer delays it, as the refusal requests."""
    limit = time.monotonic() + 30.0
    answer = operate(client, command, body)
    while (
        answer.status_code == 409 and answer.json()["code"] in {"not_verified", "expired"} and time.monotonic() < limit
    ):
        until(client, lambda live: all(refusal["code"] != "not_verified" for refusal in live["refusals"].values()))
        answer = operate(client, command, body)
    assert answer.status_code == 200, answer.text
    result: dict[str, Any] = answer.json()
    return result


def teach(
    client: TestClient,
    patient: dict[str, Any],
    motion_id: str = "built-in-1",
    side: str = "right",
    fixtures: tuple[str, ...] = ("arm_fixer_1",),
) -> dict[str, Any]:
    """Teach by the simulated hand and return the recording."""
    until_mode(client, "idle")
    wanted = {"name": "Shrug", "side": side, "taught_by": "Sato", "fixtures": list(fixtures)}
    accepted(client, "teach", teaching(client, patient["id"], **wanted))
    assert client.post("/api/simulator/guide", json={"motion_id": motion_id}).status_code == 200
    until(client, lambda live: live["teaching"] and live["teaching"]["takes"] == 1)
    until(client, lambda live: not live["teaching"]["recording"])
    with client.websocket_connect("/api/live") as socket:
        accepted(client, "finish-teaching")
        while (message := shown_message(socket))["kind"] != "saved":
            pass
    assert message["what"] == "recording"
    client.post("/api/simulator/release")
    recording: dict[str, Any] = client.get(f"/api/recordings/{message['id']}").json()
    return recording


def load(client: TestClient, patient: dict[str, Any], recording: dict[str, Any], **settings: Any) -> dict[str, Any]:
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    go_through_checklist(client, session["id"], recording["id"])
    return accepted(
        client,
        "load",
        {"session_id": session["id"], "resistance_level": 25, "recording_id": recording["id"], **settings},
    )
