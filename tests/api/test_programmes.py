"""Programmes over REST: checks as at loading, versions, and completed items."""

from typing import Any
from uuid import UUID, uuid4

import pytest
from fastapi.testclient import TestClient

from kata.clinic.recordings.tables import RecordingSamplesRow
from tests.support.recordings import LASTS_S, lifted, taught
from tests.support.responses import problem

pytestmark = pytest.mark.no_apparatus

ITEM = {"repetitions": 3, "pause_s": 2.0, "resistance_level": 8}


@pytest.fixture
def lift(client: TestClient) -> dict[str, Any]:
    body = {"clinic_number": f"P-{uuid4().hex[:8]}", "name": "Mori Sakura", "affected_side": "right"}
    return taught(client, client.post("/api/patients", json=body).json(), lifted())


def post(client: TestClient, lift: dict[str, Any], *items: dict[str, Any], **given: Any) -> Any:
    body = {
        "name": "Morning",
        "made_by": "Aoki Rin",
        "items": [{"resistance_level": 25, "recording_id": lift["id"]} | item for item in items],
    }
    return client.post(f"/api/patients/{lift['patient_id']}/programmes", json=body | given)


def test_programme_is_created_listed_changed_and_archived(client: TestClient, lift: dict[str, Any]) -> None:
    answer = post(client, lift, ITEM, {"speed_percent": 50.0}, timer_minutes=20)
    assert answer.status_code == 201, answer.text
    made = answer.json()
    first, second = made["current"]["items"]
    assert (first["position"], first["recording_name"], first["repetitions"]) == (1, "Lift", 3)
    # Three repetitions with two pauses, then one at half speed.
    assert first["duration_s"] == pytest.approx(3 * LASTS_S + 2 * 2.0, abs=1e-3)
    assert second["duration_s"] == pytest.approx(2 * LASTS_S, abs=1e-3)
    assert made["current"]["duration_s"] == pytest.approx(first["duration_s"] + second["duration_s"])
    assert made["patient"]["name"] == "Mori Sakura"

    url = f"/api/programmes/{made['id']}"
    change = {
        "based_on": 1,
        "made_by": "Baba Ken",
        "note": "Less.",
        "items": [{"resistance_level": 25, "recording_id": lift["id"]}],
    }
    changed = client.post(f"{url}/versions", json=change).json()
    assert [version["number"] for version in changed["versions"]] == [2, 1]
    problem(client.post(f"{url}/versions", json=change), 409, "edited_meanwhile")

    renamed = client.patch(url, json={"name": "Evening", "updated_at": changed["updated_at"]}).json()
    problem(client.patch(url, json={"name": "Noon", "updated_at": changed["updated_at"]}), 409, "edited_meanwhile")
    assert client.get(url).json() == renamed
    archived = client.patch(url, json={"archived": True}).json()
    listed = client.get(f"/api/patients/{lift['patient_id']}/programmes").json()["items"]
    assert [(programme["name"], programme["archived_at"], programme["current"]["number"]) for programme in listed] == [
        ("Evening", archived["archived_at"], 2)
    ]


def test_unplayable_programme_is_refused_with_item_motor_and_time(client: TestClient, lift: dict[str, Any]) -> None:
    fast = taught(client, {"id": lift["patient_id"]}, lambda times_s: lifted()(4 * times_s % LASTS_S))
    refusal = problem(
        post(
            client,
            lift,
            ITEM,
            {"resistance_level": 25, "recording_id": fast["id"], "speed_percent": 150.0, "repetitions": 2},
        ),
        422,
        "unplayable",
    )
    assert refusal["detail"].startswith("Item 2 cannot be played with these settings: motor ")
    refusal = problem(post(client, lift, {"repetitions": 200, "speed_percent": 10.0}), 422, "unplayable")
    assert "would last 267 minutes; the maximum is one hour" in refusal["detail"]
    assert client.get(f"/api/patients/{lift['patient_id']}/programmes").json() == {"items": [], "next": None}


def test_preview_gives_each_items_duration_or_reason_for_refusal(client: TestClient, lift: dict[str, Any]) -> None:
    damaged = taught(client, {"id": lift["patient_id"]}, lifted())
    app: Any = client.app
    with app.state.services.database.write() as session:
        session.get_one(RecordingSamplesRow, UUID(damaged["id"])).data = b"damaged"
    left = taught(client, {"id": lift["patient_id"]}, lifted(), side="left")
    items = [{"resistance_level": 25, "recording_id": recording["id"]} for recording in (lift, damaged, left)]
    url = f"/api/patients/{lift['patient_id']}/programmes/preview"
    answer = client.post(url, json={"items": items}).json()
    assert [item["duration_s"] for item in answer["items"]] == [pytest.approx(LASTS_S), None, None]
    assert answer["duration_s"] == pytest.approx(LASTS_S)
    assert answer["items"][1]["problem"] == "Item 2 cannot be played with these settings: its samples are damaged."
    assert "for the left shoulder" in answer["items"][2]["problem"]


def test_end_range_time_is_prescribed_where_it_can_be_counted(client: TestClient, lift: dict[str, Any]) -> None:
    abduction = {"motion": 4, "minutes": 5.0, "band_deg": 8.0, "torque_nm": 1.0}
    made = post(client, lift, ITEM | {"end_range": abduction}).json()
    assert made["current"]["items"][0]["end_range"] == abduction
    assert client.get(f"/api/programmes/{made['id']}").json()["current"]["items"][0]["end_range"] == abduction

    problem(post(client, lift, ITEM | {"end_range": abduction | {"motion": 5}}), 422, "unplayable")
    # 80 % of the range ends 16 deg before the end.
    reduced = ITEM | {"range_percent": 80.0}
    problem(post(client, lift, reduced | {"end_range": abduction}), 422, "unplayable")
    wide = abduction | {"band_deg": 17.0}
    assert post(client, lift, reduced | {"end_range": wide}).status_code == 201
    for name, value in (("motion", 2), ("minutes", 0.1), ("minutes", 61), ("band_deg", 21), ("torque_nm", 0.4)):
        refused = post(client, lift, ITEM | {"end_range": abduction | {name: value}})
        assert refused.status_code == 422, name


def test_end_range_torque_above_resistance_level_is_refused(client: TestClient, lift: dict[str, Any]) -> None:
    item = ITEM | {"end_range": {"motion": 4, "minutes": 5.0, "torque_nm": 3.8}}
    refusal = problem(post(client, lift, item | {"resistance_level": 20}), 422, "unplayable")
    assert "resistance level 20 moves the arm back before" in refusal["detail"]
    assert "level 25 or higher is needed" in refusal["detail"]
    assert refusal["next_step"] == "Choose a higher resistance level, or prescribe less torque."
    assert post(client, lift, item | {"resistance_level": 25}).status_code == 201


def test_self_pace_needs_permission_and_the_smooth_method(client: TestClient, lift: dict[str, Any]) -> None:
    item = ITEM | {"self_paced": True}
    refusal = problem(post(client, lift, ITEM, item), 409, "self_pace_not_permitted")
    assert refusal["detail"] == "Item 2, Lift: the doctor has not permitted that the patient sets the pace."
    url = f"/api/patients/{lift['patient_id']}/programmes/preview"
    preview = client.post(url, json={"items": [item | {"recording_id": lift["id"]}]}).json()["items"]
    assert "has not permitted" in preview[0]["problem"]

    episode = client.get(f"/api/patients/{lift['patient_id']}/episodes").json()["items"][0]
    permission = {"self_paced_permitted": True, "limits_by": "Dr. Mori", "updated_at": episode["updated_at"]}
    assert client.patch(f"/api/episodes/{episode['id']}", json=permission).status_code == 200
    for method in ("paper", "learned"):
        problem(post(client, lift, item | {"method": method}), 422, "not_self_paced")
    made = post(client, lift, item, ITEM).json()
    assert [kept["self_paced"] for kept in made["current"]["items"]] == [True, False]

    session = client.post(
        "/api/sessions", json={"patient_id": lift["patient_id"], "programme_version_id": made["current"]["id"]}
    ).json()
    assert [planned["self_paced"] for planned in session["programme"]["items"]] == [True, False]


def test_programme_beyond_a_doctors_limits_is_reported_and_not_saved(client: TestClient, lift: dict[str, Any]) -> None:
    episode = client.get(f"/api/patients/{lift['patient_id']}/episodes").json()["items"][0]
    forbidding = {
        "limits": [{"motion": 4, "lowest_deg": None, "highest_deg": 70.0}], "max_resistance_level": 12, "limits_by": "Dr. Mori",
        "updated_at": episode["updated_at"],
    }  # fmt: skip
    assert client.patch(f"/api/episodes/{episode['id']}", json=forbidding).status_code == 200
    less, whole = {"range_percent": 40.0, "resistance_level": 12}, {"repetitions": 3, "resistance_level": 12}
    items = [{"recording_id": lift["id"]} | settings for settings in (less, whole, less | {"resistance_level": 13})]
    url = f"/api/patients/{lift['patient_id']}/programmes/preview"
    within, beyond, stronger = client.post(url, json={"items": items}).json()["items"]
    assert (within["problem"], beyond["duration_s"], stronger["duration_s"]) == (None, None, None)
    assert beyond["problem"].startswith("Item 2 cannot be played with these settings: Motion 4 (abduction")
    assert "Dr. Mori allows no more than 70°." in beyond["problem"]
    assert "has resistance level 13; Dr. Mori allows at most 12." in stronger["problem"]

    refusal = problem(post(client, lift, less, whole), 422, "beyond_doctors_limit")
    assert refusal["detail"] == beyond["problem"]
    assert client.get(f"/api/patients/{lift['patient_id']}/programmes").json() == {"items": [], "next": None}
    assert post(client, lift, less).status_code == 201


@pytest.mark.parametrize(
    ("given", "pointer"),
    [
        ({"items": []}, "#/items"),
        ({"items": [{"resistance_level": 25, "recording_id": str(uuid4())}] * 51}, "#/items"),
        (
            {"items": [{"resistance_level": 25, "recording_id": str(uuid4()), "speed_percent": 151}]},
            "#/items/0/speed_percent",
        ),
        ({"items": [{"recording_id": str(uuid4()), "resistance_level": 26}]}, "#/items/0/resistance_level"),
        ({"items": [{"resistance_level": 25, "recording_id": str(uuid4()), "position": 1}]}, "#/items/0/position"),
        ({"timer_minutes": 0.5}, "#/timer_minutes"),
        ({"sessions_per_week": 22}, "#/sessions_per_week"),
        ({"made_by": "x" * 101}, "#/made_by"),
    ],
)
def test_out_of_range_value_is_reported_by_field(
    client: TestClient, lift: dict[str, Any], given: dict[str, Any], pointer: str
) -> None:
    refusal = problem(post(client, lift, ITEM, **given), 422, "invalid")
    assert [error["pointer"] for error in refusal["errors"]] == [pointer]


@pytest.mark.parametrize(
    "path", ["patients/{}/programmes", "programmes/{}", "sessions/{}/plan", "episodes/{}/adherence"]
)
def test_missing_record_is_not_found(client: TestClient, path: str) -> None:
    problem(client.get(f"/api/{path.format(uuid4())}"), 404, "not_found")


def test_a_session_and_an_episode_without_anything_have_empty_plans(client: TestClient, lift: dict[str, Any]) -> None:
    visit = client.post("/api/sessions", json={"patient_id": lift["patient_id"]}).json()
    plan = client.get(f"/api/sessions/{visit['id']}/plan").json()
    assert (plan["programme"], plan["items"], plan["besides"], plan["ended"]) == (None, [], [], False)
    episode_id = post(client, lift, ITEM, sessions_per_week=3).json()["episode_id"]
    [week] = client.get(f"/api/episodes/{episode_id}/adherence").json()["weeks"]
    assert (week["sessions"], week["sessions_prescribed"]) == (0, 3)
