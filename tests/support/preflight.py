"""The checks that a therapist completes before teaching and playback."""

import time
from typing import Any

import httpx2
from fastapi.testclient import TestClient

from tests.support.station_commands import operate

LIMIT_S = 30.0
WHO = "Ito Mai"
LOOKED_AT = ("side", "fixtures", "belt")
"""Checks that only a person at the apparatus can make, besides the patient's identity."""
IDENTIFIERS = ["clinic_number", "name"]
BY_HAND = ["identity", *LOOKED_AT]
"""Every check that a person answers."""
TEACHING_CHECKED: dict[str, Any] = {"looked_at": list(LOOKED_AT), "identifiers": IDENTIFIERS}
"""The answers of a request to teach."""


def confirmation(check: str, recording_id: str, who: str = WHO) -> dict[str, Any]:
    """Return the body that confirms a check."""
    given: dict[str, Any] = {"checked_by": who, "recording_id": recording_id}
    return given | ({"identifiers": IDENTIFIERS} if check == "identity" else {})


def still_open(client: httpx2.Client, session_id: str, recording_id: str) -> list[str]:
    """Return the names of the unanswered checks."""
    asked = client.get(f"/api/sessions/{session_id}/checklist", params={"recording_id": recording_id})
    assert asked.status_code == 200, asked.text
    return [check["check"] for check in asked.json()["checks"] if not check["given"]]


def until_estop(client: TestClient, state: str) -> None:
    """Wait until the device has read the switch."""
    limit = time.monotonic() + LIMIT_S
    with client.websocket_connect("/api/live") as socket:
        while socket.receive_json()["estop"] != state:
            assert time.monotonic() < limit


def try_estop(client: TestClient) -> None:
    """Press and release the emergency stop, and acknowledge."""
    for pressed, state in ((True, "pressed"), (False, "released")):
        assert client.post("/api/simulator/estop", json={"pressed": pressed}).status_code == 200
        until_estop(client, state)
    limit = time.monotonic() + LIMIT_S
    with client.websocket_connect("/api/live") as socket:
        # Like a person who presses again: a busy computer delays the request, or the drives' settings are being checked once more.
        while (answer := operate(client, "acknowledge")).status_code == 409:
            assert time.monotonic() < limit, answer.text
            socket.receive_json()
    assert answer.status_code == 200, answer.text
    until_estop(client, "closed")


def open_before_teaching(
    client: TestClient, patient_id: str, fixtures: tuple[str, ...] = ("arm_fixer_1",), side: str | None = None
) -> list[str]:
    """Return the names of the failing checks for teaching."""
    params: dict[str, Any] = {"fixtures": fixtures} | ({"side": side} if side else {})
    asked = client.get(f"/api/patients/{patient_id}/teaching-checklist", params=params)
    assert asked.status_code == 200, asked.text
    return [check["check"] for check in asked.json()["checks"] if not check["given"]]


def teaching(client: TestClient, patient_id: str, **more: Any) -> dict[str, Any]:
    """Return the request to teach this patient a motion, with every check answered."""
    if "estop" in open_before_teaching(client, patient_id):
        try_estop(client)
        limit = time.monotonic() + LIMIT_S
        while "estop" in open_before_teaching(client, patient_id):
            # A thread stores the test of the emergency stop.
            assert time.monotonic() < limit
    return {"patient_id": patient_id, "fixtures": ["arm_fixer_1"]} | TEACHING_CHECKED | more


def go_through_checklist(client: TestClient, session_id: str, recording_id: str) -> None:
    """Complete all checks: test the emergency stop if it has not been tested today, and answer the others."""
    for check in still_open(client, session_id, recording_id):
        if check == "estop":
            try_estop(client)
        else:
            body = confirmation(check, recording_id)
            answer = client.put(f"/api/sessions/{session_id}/checklist/{check}", json=body)
            assert answer.status_code == 200, answer.text
    limit = time.monotonic() + LIMIT_S
    while still_open(client, session_id, recording_id):
        # A thread stores the test of the emergency stop.
        assert time.monotonic() < limit, still_open(client, session_id, recording_id)
