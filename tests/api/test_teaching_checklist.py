"""What has to be in order before an arm is taught a motion, over HTTP, with everything real but the apparatus."""

from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from tests.support.preflight import LOOKED_AT, WHO, open_before_teaching, teaching, try_estop
from tests.support.responses import problem
from tests.support.service import running
from tests.support.station_api import accepted, until_mode

SECOND = ("arm_fixer_2", "elbow_fixer_1")


@pytest.fixture(scope="module")
def unchecked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """In the morning: nobody has tried anything yet."""
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
    assert open_before_teaching(client, patient["id"], SECOND) == [*LOOKED_AT, "estop"]
    told = problem(client.post("/api/station/teach", json=wanted), 409, "checklist_open")
    for part in (
        "The apparatus is set to the right shoulder, and its pin is in",
        "The arm lies in arm fixer 2 and elbow fixer 1, closed",
        "The belt holds the patient in the seat",
        "The emergency stop was pressed and released today, after the apparatus was connected or turned",
    ):
        assert part in told["detail"]
    assert told["next_step"] == "Go through the checklist first."
    # That somebody says so is not enough for what the apparatus itself tells.
    everything = [*LOOKED_AT, "pedal", "estop"]
    told = problem(client.post("/api/station/teach", json=wanted | {"looked_at": everything}), 409, "checklist_open")
    assert (
        told["detail"]
        == "Not everything is in order yet: The emergency stop was pressed and released today, after the apparatus was connected or turned."
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
    # Without a session it was good for this one teaching.
    problem(client.post("/api/station/teach", json=wanted), 409, "checklist_open")


def test_session_answers_are_reused_and_checks_stay_with_it(client: TestClient, patient: dict[str, Any]) -> None:
    until_mode(client, "idle")
    wanted = teaching(client, patient["id"], taught_by=WHO)
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    url = f"/api/sessions/{session['id']}"
    accepted(client, "teach", wanted)
    ended(client)
    kept = client.get(url).json()["checks"]
    assert {(one["check"], one["subject"], one["by"]) for one in kept} == {
        ("side", "right", WHO), ("fixtures", "arm_fixer_1", WHO), ("belt", "", WHO), ("pedal", "", ""), ("estop", "", ""),
    }  # fmt: skip

    # Again in the same fixtures: nothing is open. In others, only they are; and to play it the elbow is held otherwise.
    assert open_before_teaching(client, patient["id"]) == []
    assert open_before_teaching(client, patient["id"], SECOND) == ["fixtures"]
    accepted(client, "teach", wanted | {"fixtures": list(SECOND), "looked_at": ["fixtures"]})
    ended(client)
    assert open_before_teaching(client, patient["id"], SECOND) == []
    assert open_before_teaching(client, patient["id"]) == ["fixtures"]
    assert open_before_teaching(client, patient["id"], SECOND, side="left") == ["side"]

    # The session is over: so is what was answered in it.
    assert client.post(f"{url}/end").status_code == 200
    assert open_before_teaching(client, patient["id"]) == list(LOOKED_AT)


def test_fixtures_of_the_arm_must_be_given(client: TestClient, patient: dict[str, Any]) -> None:
    wanted = {"patient_id": patient["id"], "looked_at": list(LOOKED_AT)}
    problem(client.post("/api/station/teach", json=wanted), 422, "invalid")
    told = problem(client.post("/api/station/teach", json=wanted | {"fixtures": []}), 422, "invalid")
    assert [error["pointer"] for error in told["errors"]] == ["#/fixtures"]
    checklist = f"/api/patients/{patient['id']}/teaching-checklist"
    twice = client.get(checklist, params={"fixtures": ["arm_fixer_1", "arm_fixer_1"]}).json()["checks"]
    assert [one["subject"] for one in twice if one["check"] == "fixtures"] == ["arm_fixer_1"]
    asked = client.get(checklist)
    problem(asked, 422, "invalid")
