"""REST for assessments."""

from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient

from tests.support.assessments import FLEXION, found
from tests.support.responses import problem

pytestmark = pytest.mark.no_apparatus

NOW = datetime.now(UTC)
ROTATION = FLEXION | {"motion": "external_rotation", "position": "at_side", "angle_deg": 20}


@pytest.fixture
def url(patient: dict[str, Any]) -> str:
    return f"/api/episodes/{patient['episode_id']}/assessments"


def test_an_assessment_is_entered_changed_and_withdrawn(client: TestClient, patient: dict[str, Any], url: str) -> None:
    made = client.post(url, json=found(rom=[FLEXION, ROTATION], pain_rest=2, spadi=[5] * 12 + [None]))
    assert made.status_code == 201
    assessment = made.json()
    assert assessment["spadi_score"] == {"pain": 50, "disability": 50, "total": 50}
    assert assessment["rom"][1] == ROTATION
    assert client.get(f"/api/assessments/{assessment['id']}").json() == assessment

    change = {"updated_at": assessment["updated_at"], "pain_rest": 1, "spadi": None}
    changed = client.patch(f"/api/assessments/{assessment['id']}", json=change).json()
    assert (changed["pain_rest"], changed["spadi"], changed["spadi_score"]) == (1, None, None)
    assert changed["rom"] == assessment["rom"]
    problem(client.patch(f"/api/assessments/{assessment['id']}", json=change), 409, "edited_meanwhile")

    later = client.post(url, json=found(assessed_at="2026-03-09T18:30:00+09:00")).json()
    assert later["assessed_at"] == "2026-03-09T09:30:00Z"
    listed = client.get(url).json()
    assert [item["id"] for item in listed["items"]] == [later["id"], assessment["id"]]
    assert (listed["next"], listed["baseline"]["id"]) == (None, assessment["id"])
    assert client.get(f"/api/patients/{patient['id']}/assessments").json()["items"] == listed["items"]

    seen = {"updated_at": changed["updated_at"]}
    assert client.post(f"/api/assessments/{assessment['id']}/withdraw", json=seen).json()["withdrawn_at"]
    listed = client.get(url).json()
    assert (len(listed["items"]), listed["baseline"]["id"]) == (2, later["id"])


@pytest.mark.parametrize("whose", ["episode", "patient"])
def test_assessments_are_paged_newest_first_even_at_equal_times(
    client: TestClient, patient: dict[str, Any], url: str, whose: str
) -> None:
    days = ("02", "03", "03", "03", "04")
    made = [client.post(url, json=found(assessed_at=f"2026-03-{day}T09:30:00Z")).json()["id"] for day in days]
    url = url if whose == "episode" else f"/api/patients/{patient['id']}/assessments"
    leafed: list[str] = []
    after: dict[str, Any] = {}
    while True:
        page = client.get(url, params={"limit": 2} | after).json()
        leafed += [item["id"] for item in page["items"]]
        assert len(page["items"]) <= 2
        if page["next"] is None:
            break
        after = {"after": page["next"]}
    assert (leafed[0], set(leafed[1:4]), leafed[4]) == (made[4], set(made[1:4]), made[0])
    problem(client.get(url, params={"after": "damaged"}), 422, "damaged_cursor")


@pytest.mark.parametrize(
    ("wrong", "pointer"),
    [
        ({"rom": []}, "#"),
        ({"rom": [], "spadi": [None] * 13}, "#"),
        ({"rom": [FLEXION, FLEXION | {"angle_deg": 96}]}, "#/rom"),
        ({"rom": [FLEXION, ROTATION | {"position": ""}]}, "#/rom/1/position"),
        ({"rom": [FLEXION | {"motion": "internal_rotation"}]}, "#/rom/0/position"),
        ({"rom": [FLEXION | {"position": "at_side"}]}, "#/rom/0/position"),
        ({"rom": [FLEXION | {"angle_deg": 201}]}, "#/rom/0/angle_deg"),
        ({"rom": [FLEXION | {"motion": "extension", "angle_deg": 150}]}, "#/rom/0/angle_deg"),
        ({"rom": [FLEXION | {"angle_deg": "NaN"}]}, "#/rom/0/angle_deg"),
        ({"rom": [FLEXION | {"motion": "circumduction"}]}, "#/rom/0/motion"),
        ({"rom": [FLEXION | {"angle_rad": 1}]}, "#/rom/0/angle_rad"),
        ({"pain_rest": 11}, "#/pain_rest"),
        ({"pain_average": -1}, "#/pain_average"),
        ({"spadi": [5] * 12}, "#/spadi"),
        ({"spadi": [5] * 12 + [11]}, "#/spadi/12"),
        ({"assessed_by": "x" * 101}, "#/assessed_by"),
        ({"assessed_at": "2026-03-02T09:30:00"}, "#/assessed_at"),
        ({"assessed_at": (NOW + timedelta(days=1)).isoformat()}, "#/assessed_at"),
        ({"assessed_at": "1890-03-02T09:30:00Z"}, "#/assessed_at"),
    ],
)
def test_invalid_assessment_is_reported_at_its_field(
    client: TestClient, url: str, wrong: dict[str, Any], pointer: str
) -> None:
    refusal = problem(client.post(url, json=found(**wrong)), 422, "invalid")
    assert pointer in {error["pointer"].removesuffix("/") for error in refusal["errors"]}


def test_form_limits_match_what_the_service_accepts(client: TestClient, url: str) -> None:
    form = client.get("/api/assessments/form").json()
    assert len(form["spadi"]) == 13
    for end in ("lowest_deg", "highest_deg", "reference_deg"):
        entries = [
            {"side": "right", "kind": "passive", "motion": measure["motion"], "position": measure["position"]}
            | {"angle_deg": measure[end]}
            for measure in form["rom"]
        ]
        assert client.post(url, json=found(rom=entries)).json()["rom"] == entries


@pytest.mark.parametrize("path", ["episodes/{}/assessments", "assessments/{}", "patients/{}/assessments"])
def test_missing_record_is_not_found(client: TestClient, path: str) -> None:
    problem(client.get(f"/api/{path.format(uuid4())}"), 404, "not_found")


def test_nothing_is_entered_for_an_archived_patient(client: TestClient, patient: dict[str, Any], url: str) -> None:
    client.patch(f"/api/patients/{patient['id']}", json={"archived": True})
    problem(client.post(url, json=found()), 409, "archived")


def test_no_assessment_is_before_birth(client: TestClient, patient: dict[str, Any], url: str) -> None:
    born = {"birth_date": "2010-11-29"}
    assert client.patch(f"/api/patients/{patient['id']}", json=born).status_code == 200
    before = found(assessed_at="2005-01-01T00:00:00Z")
    problem(client.post(url, json=before), 422, "before_birth")
    made = client.post(url, json=found()).json()
    change = {"updated_at": made["updated_at"], "assessed_at": before["assessed_at"]}
    problem(client.patch(f"/api/assessments/{made['id']}", json=change), 422, "before_birth")
    assert client.get(f"/api/assessments/{made['id']}").json()["assessed_at"] == made["assessed_at"]
