"""REST for episodes of care and their stages; a doctor's limits at loading."""

from datetime import timedelta
from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient

from kata.database.base import utc_now
from kata.device.ipc_messages import Load
from kata.station.station import Station
from tests.support.preflight import go_through_checklist
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.station_api import accepted, until_mode


@pytest.fixture
def episode(client: TestClient, patient: dict[str, Any]) -> dict[str, Any]:
    """Return the episode that the patient's registration has opened, of the right shoulder."""
    made: dict[str, Any] = client.get(f"/api/patients/{patient['id']}/episodes").json()["items"][0]
    return made


def test_an_episode_is_changed_closed_and_reopened(client: TestClient, episode: dict[str, Any]) -> None:
    url = f"/api/episodes/{episode['id']}"
    assert (episode["side"], episode["stages"], episode["closed_at"]) == ("right", [], None)
    given: dict[str, Any] = {
        "diagnosis": "Adhesive capsulitis", "onset_on": "2026-05-01", "contraindications": "No traction.",
        "limits": [{"motion": 4, "lowest_deg": None, "highest_deg": 90.0}], "max_resistance_level": 12, "limits_by": "Dr. Mori",
        "max_speed_deg_s": 20.5, "diagnosis_code": "M75.0", "verification": "provisional", "updated_at": episode["updated_at"],
    }  # fmt: skip
    changed = client.patch(url, json=given)
    assert changed.status_code == 200, changed.text
    answer = changed.json()
    assert answer["updated_at"] > given.pop("updated_at")
    assert {name: answer[name] for name in given} == given
    problem(
        client.patch(url, json={"diagnosis": "Other", "updated_at": episode["updated_at"]}), 409, "edited_meanwhile"
    )

    closed = client.post(f"{url}/close", json={"closing_note": "Full range."}).json()
    assert closed["closed_at"] and closed["closing_note"] == "Full range."
    problem(client.post(f"{url}/close", json={}), 409, "episode_closed")
    problem(client.patch(url, json={"diagnosis": "Other"}), 409, "episode_closed")
    stage = {"stage": "frozen", "since": "2026-06-01"}
    problem(client.post(f"{url}/stages", json=stage), 409, "episode_closed")
    assert client.post(f"{url}/reopen").json()["closed_at"] is None
    assert client.get(url).json()["diagnosis"] == "Adhesive capsulitis"


def test_certainty_needs_a_diagnosis_and_the_code_a_known_one(client: TestClient, episode: dict[str, Any]) -> None:
    url = f"/api/episodes/{episode['id']}"
    assert (episode["diagnosis_code"], episode["verification"]) == ("", "")
    problem(client.patch(url, json={"verification": "confirmed"}), 422, "no_diagnosis")
    problem(client.patch(url, json={"diagnosis_code": "M99.9"}), 422, "invalid")
    assert client.patch(url, json={"diagnosis_code": "M75.1", "verification": "confirmed"}).status_code == 200
    cleared = client.patch(url, json={"diagnosis_code": "", "verification": ""}).json()
    assert (cleared["diagnosis_code"], cleared["verification"]) == ("", "")


def test_each_shoulder_has_one_open_episode(
    client: TestClient, patient: dict[str, Any], episode: dict[str, Any]
) -> None:
    url = f"/api/patients/{patient['id']}/episodes"
    problem(client.post(url, json={"side": "right"}), 409, "episode_open")
    left = client.post(url, json={"side": "left", "diagnosis": "Fracture"})
    assert left.status_code == 201
    assert client.get(f"/api/patients/{patient['id']}").json()["affected_side"] == "left"

    client.post(f"/api/episodes/{episode['id']}/close", json={})
    again = client.post(url, json={"side": "right"})
    assert again.status_code == 201
    problem(client.post(f"/api/episodes/{episode['id']}/reopen"), 409, "episode_open")
    listed = client.get(url).json()["items"]
    assert [row["id"] for row in listed] == [again.json()["id"], left.json()["id"], episode["id"]]


def test_nothing_is_opened_for_an_archived_patient(
    client: TestClient, patient: dict[str, Any], episode: dict[str, Any]
) -> None:
    client.post(f"/api/episodes/{episode['id']}/close", json={})
    client.patch(f"/api/patients/{patient['id']}", json={"archived": True})
    problem(client.post(f"/api/patients/{patient['id']}/episodes", json={"side": "left"}), 409, "archived")
    problem(client.post(f"/api/episodes/{episode['id']}/reopen"), 409, "archived")


def test_episode_with_an_open_session_cannot_be_closed(
    client: TestClient, patient: dict[str, Any], episode: dict[str, Any]
) -> None:
    visit = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    problem(client.post(f"/api/episodes/{episode['id']}/close", json={}), 409, "session_open")
    client.post(f"/api/sessions/{visit['id']}/end")
    assert client.post(f"/api/episodes/{episode['id']}/close", json={}).status_code == 200


def test_stages_are_recorded_by_day_and_can_be_removed(
    client: TestClient, patient: dict[str, Any], episode: dict[str, Any]
) -> None:
    url = f"/api/episodes/{episode['id']}/stages"
    client.patch(f"/api/patients/{patient['id']}", json={"birth_date": "1968-04-12"})
    for stage, since in (("frozen", "2026-08-01"), ("freezing", "2026-05-01"), ("thawing", "2026-10-01")):
        answer = client.post(url, json={"stage": stage, "since": since})
        assert answer.status_code == 201
    assert [stage["stage"] for stage in answer.json()["stages"]] == ["freezing", "frozen", "thawing"]
    assert answer.json()["stage"]["stage"] == "thawing"

    problem(client.post(url, json={"stage": "frozen", "since": "2026-10-01"}), 409, "stage_noted")
    problem(client.post(url, json={"stage": "frozen", "since": "1960-01-01"}), 422, "before_birth")
    future = str((utc_now() + timedelta(days=2)).date())
    assert problem(client.post(url, json={"stage": "frozen", "since": future}), 422, "invalid")["errors"][0][
        "pointer"
    ] == ("#/since")
    wrong = answer.json()["stage"]["id"]
    assert client.delete(f"{url}/{wrong}").json()["stage"]["stage"] == "frozen"
    problem(client.delete(f"{url}/{wrong}"), 404, "not_found")


def test_the_onset_is_not_before_birth(client: TestClient, patient: dict[str, Any], episode: dict[str, Any]) -> None:
    client.patch(f"/api/patients/{patient['id']}", json={"birth_date": "1968-04-12"})
    url = f"/api/episodes/{episode['id']}"
    problem(client.patch(url, json={"onset_on": "1968-04-11"}), 422, "before_birth")
    assert client.patch(url, json={"onset_on": "1968-04-12"}).json()["onset_on"] == "1968-04-12"
    assert client.patch(url, json={"onset_on": None}).json()["onset_on"] is None


@pytest.mark.parametrize(
    ("limits", "pointer"),
    [
        ([{"motion": 4}], "#/limits/0"),
        ([{"motion": 4, "lowest_deg": 90, "highest_deg": 90}], "#/limits/0"),
        ([{"motion": 7, "highest_deg": 90}], "#/limits/0/motion"),
        ([{"motion": 4, "highest_deg": 400}], "#/limits/0/highest_deg"),
    ],
)
def test_a_limit_that_limits_nothing_is_refused(
    client: TestClient, episode: dict[str, Any], limits: list[dict[str, Any]], pointer: str
) -> None:
    url = f"/api/episodes/{episode['id']}"
    refusal = problem(client.patch(url, json={"limits": limits, "limits_by": "Dr. Mori"}), 422, "invalid")
    assert [error["pointer"] for error in refusal["errors"]] == [pointer]


def test_limits_name_their_doctor_and_each_motion_once(client: TestClient, episode: dict[str, Any]) -> None:
    url = f"/api/episodes/{episode['id']}"
    limit = {"motion": 5, "highest_deg": 120.0}
    problem(client.patch(url, json={"limits": [limit]}), 422, "limits_by_nobody")
    problem(client.patch(url, json={"max_resistance_level": 5}), 422, "limits_by_nobody")
    problem(client.patch(url, json={"max_speed_deg_s": 20.0}), 422, "limits_by_nobody")
    problem(client.patch(url, json={"limits": [limit, limit], "limits_by": "Dr. Mori"}), 422, "invalid")
    assert client.get(url).json()["limits"] == []


@pytest.mark.parametrize("given", [0.0, 0.9, 150.1, -20.0, "fast"])
def test_a_speed_limit_out_of_range_is_refused(client: TestClient, episode: dict[str, Any], given: object) -> None:
    url = f"/api/episodes/{episode['id']}"
    refusal = problem(client.patch(url, json={"max_speed_deg_s": given, "limits_by": "Dr. Mori"}), 422, "invalid")
    assert [error["pointer"] for error in refusal["errors"]] == ["#/max_speed_deg_s"]


def test_speed_limit_can_be_removed(client: TestClient, episode: dict[str, Any]) -> None:
    url = f"/api/episodes/{episode['id']}"
    assert client.patch(url, json={"max_speed_deg_s": 20.0, "limits_by": "Dr. Mori"}).json()["max_speed_deg_s"] == 20.0
    assert client.patch(url, json={"diagnosis": "Other"}).json()["max_speed_deg_s"] == 20.0
    assert client.patch(url, json={"max_speed_deg_s": None}).json()["max_speed_deg_s"] is None


def test_missing_record_is_not_found(client: TestClient, episode: dict[str, Any]) -> None:
    problem(client.get(f"/api/episodes/{uuid4()}"), 404, "not_found")
    problem(client.get(f"/api/patients/{uuid4()}/episodes"), 404, "not_found")
    problem(client.post(f"/api/patients/{uuid4()}/episodes", json={"side": "right"}), 404, "not_found")
    problem(client.patch(f"/api/episodes/{uuid4()}", json={}), 404, "not_found")


# -- limits at loading ----------------------------------------------------------------------------------------------


def test_a_recording_beyond_the_doctors_limit_is_not_loaded(
    client: TestClient, patient: dict[str, Any], episode: dict[str, Any]
) -> None:
    recording = taught(client, patient, lifted(90.0))
    visit = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    limits = [{"motion": 4, "lowest_deg": 0.0, "highest_deg": 60.0}]
    given = {"limits": limits, "max_resistance_level": 12, "limits_by": "Dr. Mori"}
    assert client.patch(f"/api/episodes/{episode['id']}", json=given).status_code == 200
    until_mode(client, "idle")
    wanted = {"session_id": visit["id"], "recording_id": recording["id"], "resistance_level": 12}

    refusal = problem(client.post("/api/station/load", json=wanted), 422, "beyond_doctors_limit")
    assert "Dr. Mori allows no more than 60°" in refusal["detail"]
    problem(client.post("/api/station/load", json=wanted | {"resistance_level": 13}), 422, "level_not_allowed")
    assert client.get(f"/api/sessions/{visit['id']}").json()["runs"] == []

    go_through_checklist(client, visit["id"], recording["id"])
    loaded = client.post("/api/station/load", json=wanted | {"range_percent": 20})
    assert loaded.status_code == 200, loaded.text
    accepted(client, "unload")
    until_mode(client, "idle")


def test_the_device_is_given_the_doctors_speed_limit(
    client: TestClient, patient: dict[str, Any], episode: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = taught(client, patient, lifted())
    visit = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    given = {"max_speed_deg_s": 1.0, "limits_by": "Dr. Mori"}
    assert client.patch(f"/api/episodes/{episode['id']}", json=given).status_code == 200
    until_mode(client, "idle")
    wanted = {"session_id": visit["id"], "recording_id": recording["id"], "resistance_level": 12}
    refusal = problem(client.post("/api/station/load", json=wanted), 422, "too_fast_for_doctor")
    assert "Dr. Mori allows no more than 1°/s" in refusal["detail"]

    assert client.patch(f"/api/episodes/{episode['id']}", json={"max_speed_deg_s": 140.0}).status_code == 200
    go_through_checklist(client, visit["id"], recording["id"])
    sent: list[object] = []
    real = Station.command

    async def command(station: Station, wanted: Any, *given: Any, **named: Any) -> Any:
        sent.append(wanted)
        return await real(station, wanted, *given, **named)

    monkeypatch.setattr(Station, "command", command)
    loaded = client.post("/api/station/load", json=wanted)
    assert loaded.status_code == 200, loaded.text
    assert [command.max_speed_deg_s for command in sent if isinstance(command, Load)] == [140.0]
    accepted(client, "unload")
    until_mode(client, "idle")


def test_nothing_is_loaded_for_a_shoulder_that_is_not_treated(client: TestClient, patient: dict[str, Any]) -> None:
    recording = taught(client, patient, lifted(), side="left")
    visit = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    wanted = {"session_id": visit["id"], "resistance_level": 25, "recording_id": recording["id"]}
    problem(client.post("/api/station/load", json=wanted), 409, "no_open_episode")
