"""Contraindications over HTTP: the effect of each on teaching and playback, and the banner."""

import time
from datetime import date
from typing import Any
from uuid import UUID

import pytest
from fastapi.testclient import TestClient

from kata.clinic.banner import age_years
from kata.clinic.contraindications.kinds import KINDS, kind_of
from kata.clinic.episodes import stages
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.motion.edit import PlaybackSettings
from tests.support.audit_rows import audit_log
from tests.support.open_page import shown_message
from tests.support.preflight import go_through_checklist, teaching
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.station_api import accepted, until_mode
from tests.support.station_commands import operate


def recorded(client: TestClient, patient: dict[str, Any], code: str, **more: Any) -> dict[str, Any]:
    answer = client.post(f"/api/patients/{patient['id']}/contraindications", json={"code": code} | more)
    assert answer.status_code == 201, answer.text
    made: dict[str, Any] = answer.json()
    return made


def resolved(client: TestClient, found: dict[str, Any]) -> None:
    url = f"/api/contraindications/{found['id']}/resolve"
    assert client.post(url, json={"reason": "United on the X-ray."}).status_code == 200
    problem(client.post(url, json={"reason": "Again."}), 409, "resolved")


@pytest.fixture
def wanted(client: TestClient, patient: dict[str, Any]) -> dict[str, Any]:
    """A load for which every check is answered."""
    until_mode(client, "idle")
    recording = taught(client, patient, lifted())
    visit = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    go_through_checklist(client, visit["id"], recording["id"])
    return {"session_id": visit["id"], "recording_id": recording["id"], "resistance_level": 12}


def test_a_fracture_blocks_teaching_and_playback_until_resolved(
    client: TestClient, patient: dict[str, Any], wanted: dict[str, Any]
) -> None:
    teach = teaching(client, patient["id"])
    fracture = recorded(client, patient, "fracture", note="Humeral neck.")
    assert (fracture["effect"], fracture["stops_motion"]) == ("block", True)
    problem(
        client.post(f"/api/patients/{patient['id']}/contraindications", json={"code": "fracture"}),
        409,
        "already_recorded",
    )
    refused = problem(client.post("/api/station/load", json=wanted), 409, "contraindicated")
    assert "Fracture that has not united" in refused["detail"]
    problem(client.post("/api/station/teach", json=teach), 409, "contraindicated")
    problem(
        client.post(f"/api/contraindications/{fracture['id']}/sign-off", json={"doctor": "Dr. Mori"}),
        409,
        "no_sign_off",
    )
    assert client.get(f"/api/sessions/{wanted['session_id']}").json()["runs"] == []

    resolved(client, fracture)
    accepted(client, "load", wanted)
    accepted(client, "unload")
    actions = [row["action"] for row in audit_log(client, patient_id=patient["id"])]
    assert {"add_contraindication", "resolve_contraindication"} <= set(actions)
    refusals = [row["detail"].get("why") for row in audit_log(client, action="load")]
    assert "contraindicated" in refusals


def test_a_recent_repair_waits_for_a_doctors_permission(
    client: TestClient, patient: dict[str, Any], wanted: dict[str, Any]
) -> None:
    repair = recorded(client, patient, "recent_repair")
    refused = problem(client.post("/api/station/load", json=wanted), 409, "sign_off_needed")
    assert "Recent repair" in refused["detail"]
    url = f"/api/contraindications/{repair['id']}/sign-off"
    problem(client.post(url, json={"doctor": " "}), 422, "invalid")
    signed = client.post(url, json={"doctor": "Dr. Mori"}).json()
    assert (signed["signed_off_by"], signed["stops_motion"]) == ("Dr. Mori", False)
    # The first doctor's permission is never replaced.
    refused = problem(client.post(url, json={"doctor": "Dr. Abe"}), 409, "signed_off")
    assert "Dr. Mori" in refused["detail"]
    listed = client.get(f"/api/patients/{patient['id']}/contraindications").json()["items"]
    assert [(one["signed_off_by"], one["signed_off_at"]) for one in listed] == [("Dr. Mori", signed["signed_off_at"])]
    accepted(client, "load", wanted)
    accepted(client, "unload")
    # It is still shown.
    banner = client.get(f"/api/patients/{patient['id']}/banner").json()
    assert [contraindication["code"] for contraindication in banner["contraindications"]] == ["recent_repair"]


def test_osteoporosis_warns_only_and_concerns_both_shoulders(
    client: TestClient, patient: dict[str, Any], wanted: dict[str, Any]
) -> None:
    found = recorded(client, patient, "osteoporosis")
    assert (found["episode_id"], found["stops_motion"]) == (None, False)
    accepted(client, "load", wanted)
    accepted(client, "unload")


def test_the_other_shoulders_condition_does_not_stop_this_one(
    client: TestClient, patient: dict[str, Any], wanted: dict[str, Any]
) -> None:
    left = client.post(f"/api/patients/{patient['id']}/episodes", json={"side": "left"}).json()
    recorded(client, patient, "fracture", episode_id=left["id"])
    accepted(client, "load", wanted)
    accepted(client, "unload")
    # The pacemaker is the patient's: it stops either shoulder.
    recorded(client, patient, "pacemaker")
    problem(client.post("/api/station/load", json=wanted), 409, "sign_off_needed")


def test_the_banner_says_who_it_is_and_its_limits(client: TestClient, patient: dict[str, Any]) -> None:
    given = {"kana": "ヤマダ ハナコ", "birth_date": "1968-04-12"}
    assert client.patch(f"/api/patients/{patient['id']}", json=given).status_code == 200
    (episode,) = client.get(f"/api/patients/{patient['id']}/episodes").json()["items"]
    url = f"/api/episodes/{episode['id']}"
    assert client.patch(url, json={"contraindications": "No traction."}).status_code == 200
    assert client.post(f"{url}/stages", json={"stage": "freezing", "since": "2026-08-01"}).status_code == 201
    recorded(client, patient, "osteoporosis")
    recorded(client, patient, "infection")

    banner = client.get(f"/api/patients/{patient['id']}/banner").json()
    assert (banner["kana"], banner["birth_date"], banner["clinic_number"]) == (
        "ヤマダ ハナコ",
        "1968-04-12",
        patient["clinic_number"],
    )
    assert banner["age_years"] >= 58
    (shoulder,) = banner["shoulders"]
    assert (shoulder["side"], shoulder["stage"], shoulder["contraindications"]) == ("right", "freezing", "No traction.")
    assert shoulder["proposal"]["resistance_level"] == stages.PROPOSALS["freezing"].resistance_level
    # What stops motion comes first.
    assert [contraindication["code"] for contraindication in banner["contraindications"]] == [
        "infection",
        "osteoporosis",
    ]


def test_a_load_beyond_the_stages_proposal_is_audited(
    client: TestClient, patient: dict[str, Any], wanted: dict[str, Any]
) -> None:
    (episode,) = client.get(f"/api/patients/{patient['id']}/episodes").json()["items"]
    given = {"stage": "freezing", "since": "2026-08-01"}
    assert client.post(f"/api/episodes/{episode['id']}/stages", json=given).status_code == 201
    run = accepted(client, "load", wanted | {"speed_percent": 50, "range_percent": 80})
    assert run["resistance_level"] == 12
    accepted(client, "unload")
    details = [row["detail"] for row in audit_log(client, action="load", patient_id=patient["id"])]
    assert [detail["beyond_stage"] for detail in details if "beyond_stage" in detail] == ["load_level"]


@pytest.mark.parametrize(
    ("today", "age"),
    [(date(2026, 4, 11), 57), (date(2026, 4, 12), 58), (date(2026, 12, 31), 58), (date(1968, 4, 1), 0)],
)
def test_age_is_in_completed_years(today: date, age: int) -> None:
    assert age_years(date(1968, 4, 12), today) == age


def test_proposals_grow_and_are_exceeded_only_above() -> None:
    gentle, middle, strong = (stages.PROPOSALS[stage] for stage in ("freezing", "frozen", "thawing"))
    for name in ("resistance_level", "speed_percent", "range_percent", "repetitions"):
        assert getattr(gentle, name) <= getattr(middle, name) <= getattr(strong, name)
    settings = PlaybackSettings(gentle.speed_percent, gentle.repetitions, 0.0, gentle.range_percent)
    assert stages.exceeded("freezing", gentle.resistance_level, settings) == []
    faster = PlaybackSettings(gentle.speed_percent + 1, gentle.repetitions + 1, 0.0, gentle.range_percent)
    assert stages.exceeded("freezing", gentle.resistance_level + 1, faster) == [
        "resistance_level",
        "speed_percent",
        "repetitions",
    ]
    assert stages.exceeded(None, 25, faster) == []


def test_every_kind_says_what_it_does_and_why(client: TestClient) -> None:
    listed = client.get("/api/contraindication-kinds").json()["items"]
    assert [kind["code"] for kind in listed] == list(KINDS)
    assert all(kind["source"] for kind in listed)
    # A code of another version is never harmless.
    assert kind_of("from_the_future").effect == "sign_off"


def test_a_condition_of_an_earlier_episode_still_concerns_its_shoulder(
    client: TestClient, patient: dict[str, Any]
) -> None:
    until_mode(client, "idle")
    url = f"/api/patients/{patient['id']}/episodes"
    (first,) = client.get(url).json()["items"]
    tumour = recorded(client, patient, "tumour")
    assert tumour["side"] == "right"
    assert client.post(f"/api/episodes/{first['id']}/close", json={}).status_code == 200
    banner = client.get(f"/api/patients/{patient['id']}/banner").json()
    assert [found["code"] for found in banner["contraindications"]] == ["tumour"], "without an open episode"

    assert client.post(url, json={"side": "right"}).status_code == 201
    banner = client.get(f"/api/patients/{patient['id']}/banner").json()
    assert [(found["code"], found["side"]) for found in banner["contraindications"]] == [("tumour", "right")]
    teach = teaching(client, patient["id"])
    problem(client.post("/api/station/teach", json=teach), 409, "contraindicated")
    again = client.post(f"/api/patients/{patient['id']}/contraindications", json={"code": "tumour"})
    problem(again, 409, "already_recorded")
    # The other shoulder may have one of its own.
    left = client.post(url, json={"side": "left"}).json()
    recorded(client, patient, "tumour", episode_id=left["id"])


@pytest.mark.parametrize("cached", [pytest.param(False, marks=pytest.mark.campaign), True])
def test_a_condition_recorded_after_loading_stops_the_next_motion(
    client: TestClient, patient: dict[str, Any], wanted: dict[str, Any], monkeypatch: pytest.MonkeyPatch, cached: bool
) -> None:
    if not cached:
        # The record of a restricted patient is never cached.
        monkeypatch.setattr(OfflineCache, "find_session", lambda *_: None)
    accepted(client, "load", wanted)
    fracture = recorded(client, patient, "fracture")
    refused = problem(operate(client, "approach"), 409, "contraindicated")
    assert "Fracture that has not united" in refused["detail"]
    resolved(client, fracture)
    accepted(client, "approach")
    until_mode(client, "paused")
    recorded(client, patient, "infection")
    problem(operate(client, "play"), 409, "contraindicated")
    # The way back stays open.
    accepted(client, "return")
    until_mode(client, "idle")


@pytest.mark.parametrize("cached", [False, True])
def test_a_condition_recorded_during_a_playback_pauses_it(
    client: TestClient, patient: dict[str, Any], wanted: dict[str, Any], monkeypatch: pytest.MonkeyPatch, cached: bool
) -> None:
    if not cached:
        # The record of a restricted patient is never cached.
        monkeypatch.setattr(OfflineCache, "find_session", lambda *_: None)
    accepted(client, "load", wanted | {"speed_percent": 10})
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until_mode(client, "playing")
    with client.websocket_connect("/api/live") as socket:
        # A warning changes nothing.
        recorded(client, patient, "osteoporosis")
        fracture = recorded(client, patient, "fracture")
        limit = time.monotonic() + 10.0
        while (message := shown_message(socket))["kind"] != "event" or message["event"]["code"] == "mode":
            assert time.monotonic() < limit
    assert message["event"]["code"] == "contraindication_pause"
    assert "Fracture that has not united" in message["event"]["message"]
    live = until_mode(client, "paused")
    assert live["torque"] == "on", "the arm is held"
    problem(operate(client, "play"), 409, "contraindicated")
    assert next(row["detail"] for row in audit_log(client, action="pause_contraindicated")) == {
        "why": "contraindicated"
    }
    # The therapist decides how to go on.
    resolved(client, fracture)
    accepted(client, "play")
    until_mode(client, "playing")
    accepted(client, "pause")
    until_mode(client, "paused")
    accepted(client, "return")
    until_mode(client, "idle")


def changed_in(cache: OfflineCache, wanted: dict[str, Any]) -> bool:
    entry = cache.find_session(UUID(wanted["session_id"]))
    recording = entry.recordings.get(UUID(wanted["recording_id"])) if entry else None
    return recording is not None and bool(recording.allowed.motions)


@pytest.mark.parametrize("cached", [pytest.param(False, marks=pytest.mark.campaign), True])
def test_limits_changed_after_loading_stop_the_next_motion(
    client: TestClient, patient: dict[str, Any], wanted: dict[str, Any], monkeypatch: pytest.MonkeyPatch, cached: bool
) -> None:
    if not cached:
        # The record of a restricted patient is never cached.
        monkeypatch.setattr(OfflineCache, "find_session", lambda *_: None)
    accepted(client, "load", wanted)
    (episode,) = client.get(f"/api/patients/{patient['id']}/episodes").json()["items"]
    limits = {"limits": [{"motion": 4, "lowest_deg": 0.0, "highest_deg": 10.0}], "limits_by": "Dr. Mori"}
    assert client.patch(f"/api/episodes/{episode['id']}", json=limits).status_code == 200
    cache: OfflineCache = client.app.state.services.offline_cache  # type: ignore[attr-defined]
    limit = time.monotonic() + 30.0
    while cached and not changed_in(cache, wanted):
        assert time.monotonic() < limit
        time.sleep(0.05)
    # A busy computer delays the command.
    while (answer := operate(client, "approach")).json()["code"] == "expired":
        assert time.monotonic() < limit
    problem(answer, 409, "limits_changed")
    accepted(client, "unload")
