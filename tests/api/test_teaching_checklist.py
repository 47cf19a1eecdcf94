"""The checklist before teaching, over HTTP, with a simulated apparatus."""

from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from tests.support.preflight import (
    BY_HAND,
    IDENTIFIERS,
    LOOKED_AT,
    TEACHING_CHECKED,
    WHO,
    open_before_teaching,
    teaching,
    try_estop,
)
from tests.support.responses import problem
from tests.support.service import running
from tests.support.station_api import accepted, until_mode

SECOND = ("arm_fixer_2", "elbow_fixer_1")


@pytest.fixture(scope="module")
def unchecked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Return a service in the morning, before the emergency stop was tested."""
    with running(tmp_path_factory.mktemp("kata")) as made:
        until_mode(made, "idle")
        yield made


def ended(client: TestClient) -> None:
    accepted(client, "finish-teaching")
    until_mode(client, "idle")


def sign_up(client: TestClient, number: str) -> dict[str, Any]:
    body = {"clinic_number": number, "name": "Yamada Hanako", "affected_side": "right"}
    made: dict[str, Any] = client.post("/api/patients", json=body).json()
    return made


def test_teaching_requires_a_tried_estop_and_a_visual_check(unchecked: TestClient) -> None:
    client, patient = unchecked, sign_up(unchecked, "T-1")
    wanted = {"patient_id": patient["id"], "fixtures": list(SECOND), "taught_by": WHO}
    assert open_before_teaching(client, patient["id"], SECOND) == [*BY_HAND, "estop"]
    problem(
        client.post("/api/station/teach", json=wanted | {"looked_at": list(LOOKED_AT)}), 409, "identity_not_confirmed"
    )
    wanted |= {"identifiers": IDENTIFIERS}
    refusal = problem(client.post("/api/station/teach", json=wanted), 409, "checklist_open")
    for part in (
        "The apparatus is set to the right shoulder, and its pin is in",
        "The arm lies in arm fixer 2 and elbow fixer 1, and all fixtures are closed",
        "The belt holds the patient in the seat",
        "The emergency stop was pressed and released today, after the apparatus was connected or turned",
    ):
        assert part in refusal["detail"]
    assert refusal["next_step"] == "Go through the checklist first."
    # A user's answer does not replace the emergency stop's test, which the apparatus detects.
    everything = [*LOOKED_AT, "pedal", "estop"]
    refusal = problem(client.post("/api/station/teach", json=wanted | {"looked_at": everything}), 409, "checklist_open")
    assert (
        refusal["detail"]
        == "These checks are not complete yet: The emergency stop was pressed and released today, after the apparatus was connected or turned."
    )
    until_mode(client, "idle")
    assert client.get(f"/api/patients/{patient['id']}/recordings").json()["items"] == []

    try_estop(client)
    teaching(client, patient["id"])
    for missing in LOOKED_AT:
        looked_at = [check for check in LOOKED_AT if check != missing]
        problem(client.post("/api/station/teach", json=wanted | {"looked_at": looked_at}), 409, "checklist_open")
    accepted(client, "teach", wanted | {"looked_at": list(LOOKED_AT)})
    until_mode(client, "teaching")
    ended(client)
    # Without a session, the answers were valid for one teaching.
    problem(client.post("/api/station/teach", json=wanted), 409, "checklist_open")
    anonymous = {name: value for name, value in wanted.items() if name != "identifiers"}
    problem(client.post("/api/station/teach", json=anonymous), 409, "identity_not_confirmed")


def test_session_answers_are_reused_and_checks_stay_with_it(client: TestClient, patient: dict[str, Any]) -> None:
    until_mode(client, "idle")
    wanted = teaching(client, patient["id"], taught_by=WHO)
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    url = f"/api/sessions/{session['id']}"
    accepted(client, "teach", wanted)
    ended(client)
    stored = client.get(url).json()["checks"]
    assert {(check["check"], check["subject"], check["by"]) for check in stored} == {
        ("identity", "clinic_number+name", WHO),
        ("side", "right", WHO), ("fixtures", "arm_fixer_1", WHO), ("belt", "", WHO), ("pedal", "", ""), ("estop", "", ""),
    }  # fmt: skip

    # With the same fixtures no check is open. With others only the fixtures are; for playback the elbow fixture differs.
    assert open_before_teaching(client, patient["id"]) == []
    assert open_before_teaching(client, patient["id"], SECOND) == ["fixtures"]
    accepted(client, "teach", wanted | {"fixtures": list(SECOND), "looked_at": ["fixtures"], "identifiers": []})
    ended(client)
    assert open_before_teaching(client, patient["id"], SECOND) == []
    assert open_before_teaching(client, patient["id"]) == ["fixtures"]
    assert open_before_teaching(client, patient["id"], SECOND, side="left") == ["side"]

    # The answers end with the session.
    assert client.post(f"{url}/end").status_code == 200
    assert open_before_teaching(client, patient["id"]) == BY_HAND


def test_fixtures_of_the_arm_must_be_given(client: TestClient, patient: dict[str, Any]) -> None:
    wanted = {
        "patient_id": patient["id"],
    } | TEACHING_CHECKED
    problem(client.post("/api/station/teach", json=wanted), 422, "invalid")
    refusal = problem(client.post("/api/station/teach", json=wanted | {"fixtures": []}), 422, "invalid")
    assert [error["pointer"] for error in refusal["errors"]] == ["#/fixtures"]
    checklist = f"/api/patients/{patient['id']}/teaching-checklist"
    twice = client.get(checklist, params={"fixtures": ["arm_fixer_1", "arm_fixer_1"]}).json()["checks"]
    assert [check["subject"] for check in twice if check["check"] == "fixtures"] == ["arm_fixer_1"]
    asked = client.get(checklist)
    problem(asked, 422, "invalid")
