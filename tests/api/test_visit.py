"""A visit from its checklist to its addendum, over HTTP, with a simulated apparatus."""

from collections.abc import Callable
from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient

from tests.support.audit_rows import audit_log
from tests.support.preflight import BY_HAND, WHO, confirmation, go_through_checklist, still_open, teaching
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.station_api import accepted, teach, until, until_mode
from tests.support.visits import eventually, programme


@pytest.fixture(scope="module")
def patient(client: TestClient) -> dict[str, Any]:
    body = {"clinic_number": "V-1", "name": "Yamada Hanako", "affected_side": "right"}
    made: dict[str, Any] = client.post("/api/patients", json=body).json()
    return made


@pytest.fixture(scope="module")
def shrug(client: TestClient, patient: dict[str, Any]) -> dict[str, Any]:
    return teach(client, patient)


@pytest.fixture(scope="module")
def rotation(client: TestClient, patient: dict[str, Any]) -> dict[str, Any]:
    return taught(client, patient, lifted(), fixtures=["arm_fixer_2", "elbow_fixer_1"])


def play(client: TestClient, body: dict[str, Any], meanwhile: Callable[[], None] = lambda: None) -> dict[str, Any]:
    run = accepted(client, "load", body)
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    meanwhile()
    until_mode(client, "idle", within_s=60)
    eventually(lambda: one_ended(client, run["id"]))
    ended: dict[str, Any] = client.get(f"/api/runs/{run['id']}").json()
    return ended


def one_ended(client: TestClient, run_id: str) -> bool:
    return client.get(f"/api/runs/{run_id}").json()["ended_at"] is not None


@pytest.mark.campaign
def test_visit_goes_from_its_programme_to_its_addendum(
    client: TestClient, patient: dict[str, Any], shrug: dict[str, Any], rotation: dict[str, Any]
) -> None:
    version_id = programme(client, patient, shrug["id"], shrug["id"])
    wanted = {"patient_id": patient["id"], "therapist": WHO, "programme_version_id": version_id}
    session = client.post("/api/sessions", json=wanted).json()
    url = f"/api/sessions/{session['id']}"
    assert (session["side"], session["therapist"], session["station"]) == ("right", WHO, "Station 1")
    assert [item["position"] for item in session["programme"]["items"]] == [1, 2]
    assert session["programme"]["items"][0]["repetitions"] == 2

    # Nothing is played before the checklist is complete. Users cannot tick checks that the apparatus detects.
    item = {
        "session_id": session["id"], "resistance_level": 25, "recording_id": shrug["id"], "programme_position": 1, "speed_percent": 150,
        "repetitions": 2, "pause_s": 0.5,
    }  # fmt: skip
    assert still_open(client, session["id"], shrug["id"]) == BY_HAND
    problem(client.post("/api/station/load", json=item), 409, "identity_not_confirmed")
    identified = client.put(f"{url}/checklist/identity", json=confirmation("identity", shrug["id"]))
    assert identified.status_code == 200, identified.text
    (noted,) = (row for row in audit_log(client, action="tick_check") if "identity" in row["detail"])
    assert (noted["detail"]["identity"], noted["patient_id"]) == ("clinic_number+name", patient["id"])
    assert noted["who"] == "Test administrator"
    refusal = problem(client.post("/api/station/load", json=item), 409, "checklist_open")
    assert "The arm lies in arm fixer 1, and all fixtures are closed" in refusal["detail"]
    # The emergency stop was tested before teaching.
    assert "emergency stop" not in refusal["detail"]
    assert client.get(url).json()["runs"] == []
    tick = {"checked_by": WHO, "recording_id": shrug["id"]}
    problem(client.put(f"{url}/checklist/estop", json=tick), 409, "detected")
    problem(client.put(f"{url}/checklist/fixtures", json={"checked_by": WHO}), 409, "no_recording")
    for check in ("side", "fixtures", "belt"):
        assert client.put(f"{url}/checklist/{check}", json=tick).status_code == 200
    checklist = client.get(f"{url}/checklist", params={"recording_id": shrug["id"]}).json()
    assert checklist["complete"] is True
    assert {check["check"]: check["checked_by"] for check in checklist["checks"]} == {
        "identity": WHO, "side": WHO, "fixtures": WHO, "belt": WHO, "pedal": None, "estop": None,
    }  # fmt: skip
    # Another motion needs other fixtures, so only the fixtures are asked for.
    assert still_open(client, session["id"], rotation["id"]) == ["fixtures"]

    assert client.patch(url, json={"pain_before": 4}).json()["pain_before"] == 4
    problem(client.post("/api/station/load", json=item | {"programme_position": 3}), 409, "not_planned")

    def less() -> None:
        until(client, lambda live: live["run"] and live["run"]["position_s"] > 0.5)
        accepted(client, "reduce-range")

    first = play(client, item, less)
    assert (first["outcome"], first["programme_position"], first["repetitions_done"]) == ("completed", 1, 2)
    assert first["reversals"] == 0
    assert 80 <= first["least_range_percent"] < 100

    stopped = accepted(client, "load", item | {"programme_position": 2})
    problem(client.post(f"{url}/end"), 409, "run_not_ended")
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until(client, lambda live: live["run"] and live["run"]["position_s"] > 0.5)
    accepted(client, "stop")
    until(client, lambda live: live["mode"] == "stopped" and "acknowledge" not in live["refusals"])
    accepted(client, "acknowledge")
    until_mode(client, "idle")
    eventually(lambda: one_ended(client, stopped["id"]))

    # The cause of the stop is an alarm of this run, and has ended.
    alarm = eventually(
        lambda: [
            item
            for item in client.get("/api/events", params={"session_id": session["id"], "kind": "alarm"}).json()["items"]
            if item["ended_at"]
        ]
    )[0]
    assert (alarm["code"], alarm["run_id"], alarm["patient_id"]) == ("operator_stop", stopped["id"], patient["id"])
    page = client.get("/api/events", params={"session_id": session["id"], "limit": 1}).json()
    following = client.get("/api/events", params={"session_id": session["id"], "after": page["next"]}).json()
    assert following["items"][0]["at"] <= page["items"][0]["at"]
    problem(client.get("/api/events", params={"after": "nowhere"}), 422, "damaged_cursor")

    # Record the pain afterwards, end the session, write the note.
    problem(client.post(f"{url}/sign", json={"signed_by": WHO, "note": "Done."}), 409, "session_open")
    assert client.patch(url, json={"pain_during": 5, "pain_after": 3}).status_code == 200
    draft = client.get(f"{url}/draft").json()
    assert draft["end_reason"] == "stopped"
    for part in (
        "Right shoulder, programme Weeks 3 to 6 (version 1).",
        "(150 % speed, pause 0.5 s): 2 of 2 repetitions.",
        "(150 % speed, pause 0.5 s): 0 of 2 repetitions.",
        "Apparatus angle reached (not the patient's angle: the arm can slip in its cuff): abduction / adduction of the scapula ",
        "The range was reduced in Shrug",
        "Shrug was stopped: Stopped by the operator.",
        "Pain (0 to 10): 4 before, 5 during, 3 after.",
    ):
        assert part in draft["text"]
    ended = client.post(f"{url}/end", json={"reason": "patient_request"}).json()
    assert (ended["end_reason"], bool(ended["ended_at"])) == ("patient_request", True)
    problem(client.put(f"{url}/checklist/belt", json=tick), 409, "session_ended")

    # Another user has changed the note, so signing the former version is refused.
    seen = ended["updated_at"]
    note = client.patch(url, json={"note": draft["text"], "updated_at": seen}).json()
    problem(client.patch(url, json={"note": "Other.", "updated_at": seen}), 409, "edited_meanwhile")
    signing = {"signed_by": WHO, "note": f"{draft['text']} Did well."}
    problem(client.post(f"{url}/sign", json=signing | {"updated_at": seen}), 409, "edited_meanwhile")
    problem(client.post(f"{url}/addenda", json={"written_by": WHO, "text": "Too early."}), 409, "not_signed")
    signed = client.post(f"{url}/sign", json=signing | {"updated_at": note["updated_at"]}).json()
    assert (signed["signed_by"], signed["note"]) == (WHO, signing["note"])

    # A signed note cannot be changed.
    for answer in (
        client.patch(url, json={"note": "Changed."}),
        client.patch(url, json={"pain_after": 0}),
        client.post(f"{url}/end"),
        client.post(f"{url}/sign", json=signing),
        client.put(f"{url}/checklist/belt", json=tick),
    ):
        problem(answer, 409, "signed")
    added = client.post(f"{url}/addenda", json={"written_by": WHO, "text": "Slept well."}).json()
    assert [(addendum["written_by"], addendum["text"]) for addendum in added["addenda"]] == [(WHO, "Slept well.")]
    assert client.get(url).json() == added
    assert added["note"] == signing["note"]
    assert [check["check"] for check in added["checks"]] == [*BY_HAND, "pedal", "estop"]


def test_programme_of_another_patient_is_refused(client: TestClient, patient: dict[str, Any]) -> None:
    body = {"clinic_number": "V-2", "name": "Suzuki Aoi", "affected_side": "left"}
    other = client.post("/api/patients", json=body).json()
    version_id = programme(client, patient)
    wanted = {"patient_id": other["id"], "programme_version_id": version_id}
    problem(client.post("/api/sessions", json=wanted), 409, "other_episode")
    problem(client.post("/api/sessions", json=wanted | {"programme_version_id": str(uuid4())}), 404, "not_found")
    session = client.post("/api/sessions", json={"patient_id": other["id"]}).json()
    # Without a name, the requesting user is the examiner.
    assert (session["programme"], session["therapist"]) == (None, "Test administrator")
    url = f"/api/sessions/{session['id']}"
    problem(client.patch(url, json={"programme_version_id": version_id}), 409, "other_episode")


def test_a_programme_can_be_chosen_later_and_given_up_again(client: TestClient, patient: dict[str, Any]) -> None:
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    url = f"/api/sessions/{session['id']}"
    version_id = programme(client, patient)
    assert client.patch(url, json={"programme_version_id": version_id}).json()["programme"]["number"] == 1
    assert client.patch(url, json={"programme_version_id": None}).json()["programme"] is None
    again = client.post("/api/sessions", json={"patient_id": patient["id"], "therapist": "Sato Jun"}).json()
    assert (again["id"], again["therapist"]) == (session["id"], session["therapist"])


@pytest.mark.parametrize("field", ["pain_before", "pain_during", "pain_after"])
@pytest.mark.parametrize("value", [-1, 11, 2.5, "bad"])
def test_pain_ranges_from_0_to_10(client: TestClient, patient: dict[str, Any], field: str, value: object) -> None:
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    refusal = problem(client.patch(f"/api/sessions/{session['id']}", json={field: value}), 422, "invalid")
    assert [error["pointer"] for error in refusal["errors"]] == [f"#/{field}"]
    assert client.patch(f"/api/sessions/{session['id']}", json={field: None}).json()[field] is None


def test_teaching_checks_stay_with_the_recording(client: TestClient, patient: dict[str, Any]) -> None:
    wanted = teaching(client, patient["id"], side="right", taught_by=WHO, fixtures=["arm_fixer_2", "elbow_fixer_1"])
    until_mode(client, "idle")
    accepted(client, "teach", wanted)
    accepted(client, "finish-teaching")
    until_mode(client, "idle")
    problem(client.post("/api/station/teach", json=wanted | {"fixtures": ["tape"]}), 422, "invalid")


def test_estop_test_counts_for_the_next_session_that_day(
    client: TestClient, patient: dict[str, Any], shrug: dict[str, Any]
) -> None:
    first = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    go_through_checklist(client, first["id"], shrug["id"])
    assert client.post(f"/api/sessions/{first['id']}/end").status_code == 200
    second = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    assert still_open(client, second["id"], shrug["id"]) == BY_HAND
