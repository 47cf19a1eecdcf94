"""REST for patients and sessions, and what every error looks like."""

from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient

from kata.clinic.patients import service
from tests.support.responses import problem


def test_a_patient_is_signed_up_looked_up_and_changed(client: TestClient) -> None:
    body = {
        "clinic_number": " A-17 ", "name": "Satō Ken", "kana": "サトウ ケン", "birth_date": "1970-02-28",
        "sex": "male", "affected_side": "right", "notes": "Plays the violin.",
    }  # fmt: skip
    made = client.post("/api/patients", json=body)
    assert made.status_code == 201
    key = made.json()["id"]
    assert made.json()["clinic_number"] == "A-17"
    assert made.json()["created_at"].endswith("Z")

    changed = client.patch(f"/api/patients/{key}", json={"notes": "", "birth_date": None}).json()
    assert (changed["notes"], changed["birth_date"], changed["name"]) == ("", None, "Satō Ken")
    assert client.get(f"/api/patients/{key}").json() == changed


@pytest.mark.parametrize("search", ["satō k", "A-1", "サトウ", "ken SAT"])
def test_patients_are_found_by_words_of_name_kana_or_number(client: TestClient, search: str) -> None:
    if not client.get("/api/patients", params={"search": "Ito"}).json()["items"]:
        for number, name, kana in (("A-1", "Satō Ken", "サトウ ケン"), ("B-2", "Ito Mai", "イトウ マイ")):
            body = {"clinic_number": f"find-{number}", "name": name, "kana": kana, "affected_side": "left"}
            client.post("/api/patients", json=body)
    names = {item["name"] for item in client.get("/api/patients", params={"search": search}).json()["items"]}
    assert names == {"Satō Ken"}


def test_a_wildcard_in_a_search_is_only_a_character(client: TestClient, patient: dict[str, Any]) -> None:
    assert client.get("/api/patients", params={"search": "%"}).json()["items"] == []


def test_archived_patients_are_listed_apart_and_come_back(client: TestClient, patient: dict[str, Any]) -> None:
    url = f"/api/patients/{patient['id']}"
    assert client.patch(url, json={"archived": True}).json()["archived_at"]
    assert patient["id"] not in {item["id"] for item in client.get("/api/patients").json()["items"]}
    archived = client.get("/api/patients", params={"archived": True}).json()["items"]
    assert patient["id"] in {row["id"] for row in archived}
    problem(client.post("/api/sessions", json={"patient_id": patient["id"]}), 409, "archived")
    problem(
        client.post("/api/station/teach", json={"patient_id": patient["id"], "fixtures": ["arm_fixer_1"]}),
        409,
        "archived",
    )
    assert client.patch(url, json={"archived": False}).json()["archived_at"] is None


def test_two_editors_do_not_overwrite_each_other(client: TestClient, patient: dict[str, Any]) -> None:
    url = f"/api/patients/{patient['id']}"
    first = {"notes": "first", "updated_at": patient["updated_at"]}
    second = {"notes": "second", "updated_at": patient["updated_at"]}
    assert client.patch(url, json=first).status_code == 200
    problem(client.patch(url, json=second), 409, "edited_meanwhile")
    assert client.get(url).json()["notes"] == "first"


def test_clinic_number_belongs_to_one_patient(client: TestClient, patient: dict[str, Any]) -> None:
    body = {"clinic_number": patient["clinic_number"], "name": "Other", "affected_side": "left"}
    problem(client.post("/api/patients", json=body), 409, "number_taken")


@pytest.mark.parametrize(
    ("body", "pointers"),
    [
        ({}, {"#/clinic_number", "#/name", "#/affected_side"}),
        ({"clinic_number": "x", "name": "  ", "affected_side": "left"}, {"#/name"}),
        ({"clinic_number": "x", "name": "N", "affected_side": "middle"}, {"#/affected_side"}),
        ({"clinic_number": "x", "name": "N", "affected_side": "left", "birth_date": "2999-01-01"}, {"#/birth_date"}),
        ({"clinic_number": "x", "name": "N", "affected_side": "left", "birth_date": 0}, {"#/birth_date"}),
        ({"clinic_number": "x", "name": "N", "affected_side": "left", "nane": "N"}, {"#/nane"}),
        ({"clinic_number": "x" * 33, "name": "N", "affected_side": "left"}, {"#/clinic_number"}),
        ({"clinic_number": "x", "name": "N\0", "kana": "\0", "affected_side": "left"}, {"#/name", "#/kana"}),
    ],
)
def test_invalid_record_is_reported_field_by_field(
    client: TestClient, body: dict[str, Any], pointers: set[str]
) -> None:
    refusal = problem(client.post("/api/patients", json=body), 422, "invalid")
    assert {error["pointer"] for error in refusal["errors"]} == pointers
    assert all(error["detail"] for error in refusal["errors"])


def test_nonsense_is_a_problem_too(client: TestClient) -> None:
    headers = {"content-type": "application/json"}
    problem(client.post("/api/patients", content=b"{", headers=headers), 422, "invalid")
    problem(client.post("/api/patients", content=b"\xff\xfe", headers=headers), 422, "invalid")
    problem(client.get("/api/patients/not-an-id"), 422, "invalid")
    problem(client.get("/api/patients", params={"limit": 0}), 422, "invalid")
    problem(client.get("/api/nothing"), 404, "not_found")
    problem(client.delete("/api/patients"), 405, "method_not_allowed")


@pytest.mark.parametrize(
    "path",
    ["patients/{}", "patients/{}/recordings", "patients/{}/sessions", "recordings/{}", "recordings/{}/figure",
     "recordings/{}/rhythm", "recordings/{}/samples.csv", "sessions/{}", "runs/{}", "runs/{}/figures",
     "runs/{}/played", "runs/{}/rhythm"],
)  # fmt: skip
def test_missing_record_is_not_found(client: TestClient, path: str) -> None:
    problem(client.get(f"/api/{path.format(uuid4())}"), 404, "not_found")


def test_patient_has_one_open_session_that_ends_once(client: TestClient, patient: dict[str, Any]) -> None:
    first = client.post("/api/sessions", json={"patient_id": patient["id"]})
    assert first.status_code == 201
    again = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    assert again["id"] == first.json()["id"]

    url = f"/api/sessions/{again['id']}"
    assert client.patch(url, json={"note": "Went well."}).json()["note"] == "Went well."
    ended = client.post(f"{url}/end").json()["ended_at"]
    assert ended
    assert client.post(f"{url}/end").json()["ended_at"] == ended
    assert client.post("/api/sessions", json={"patient_id": patient["id"]}).json()["id"] != again["id"]
    listed = client.get(f"/api/patients/{patient['id']}/sessions").json()
    assert len(listed["items"]) == 2
    assert listed["items"][0]["started_at"] > listed["items"][1]["started_at"]


@pytest.mark.parametrize("method", ["post", "patch"])
def test_other_sites_page_cannot_change_anything(client: TestClient, method: str) -> None:
    headers = {"origin": "https://elsewhere.example"}
    answer = client.request(method, "/api/station/stop", headers=headers)
    problem(answer, 403, "foreign_origin")


def test_an_unexpected_error_is_a_sentence_for_the_user(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("secret detail")

    monkeypatch.setattr(service, "find", broken)
    lenient = TestClient(client.app, raise_server_exceptions=False, cookies=client.cookies)
    refusal = problem(lenient.get("/api/patients"), 500, "unexpected")
    assert "secret" not in refusal["detail"]


def test_page_is_served_for_screens_and_for_nothing_else(client: TestClient) -> None:
    for path in ("/", "/patients", f"/sessions/{uuid4()}"):
        answer = client.get(path)
        assert answer.status_code == 200
        assert '<div id="root">' in answer.text
        # The page contains a nonce that is valid once.
        assert answer.headers["cache-control"] == "no-store"
    problem(client.get("/missing.js"), 404, "not_found")
    problem(client.get("/..%2f..%2fpyproject.toml"), 404, "not_found")
    problem(client.get("/api"), 404, "not_found")


def test_lists_go_on_where_the_page_before_ended(client: TestClient, patient: dict[str, Any]) -> None:
    keys = []
    for _ in range(3):
        keys.append(client.post("/api/sessions", json={"patient_id": patient["id"]}).json()["id"])
        client.post(f"/api/sessions/{keys[-1]}/end")
    for url in ("/api/sessions", f"/api/patients/{patient['id']}/sessions"):
        first = client.get(url, params={"limit": 2}).json()
        second = client.get(url, params={"limit": 2, "after": first["next"]}).json()
        assert [row["id"] for row in first["items"] + second["items"]][:3] == keys[::-1]
        problem(client.get(url, params={"after": "damaged"}), 422, "damaged_cursor")
    for url in (
        "/api/patients",
        "/api/backups",
        "/api/break-glass-accesses",
        f"/api/patients/{patient['id']}/recordings",
    ):
        problem(client.get(url, params={"after": "damaged"}), 422, "damaged_cursor")


def test_sessions_are_filtered_by_the_offered_options(client: TestClient, patient: dict[str, Any]) -> None:
    visit = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    began = visit["started_at"]
    assert visit["id"] in {item["id"] for item in client.get("/api/sessions", params={"since": began}).json()["items"]}
    assert visit["id"] not in {
        item["id"] for item in client.get("/api/sessions", params={"until": began}).json()["items"]
    }
    for name in ("therapist", "station", "stop"):
        assert client.get("/api/sessions", params={name: "nobody's"}).json() == {"items": [], "next": None}
    problem(client.get("/api/sessions", params={"since": "2026-11-21T09:30:00"}), 422, "invalid")
    assert client.get("/api/sessions", params={"since": "0001-01-01T00:00:00+14:00"}).status_code == 200
    assert set(client.get("/api/sessions/filter-options").json()) == {"therapists", "stations", "stops"}
