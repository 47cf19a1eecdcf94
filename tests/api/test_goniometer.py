"""Goniometer readings of a session, and the patient's angles that follow from them, over HTTP."""

from typing import Any

import pytest
from fastapi.testclient import TestClient

from kata.clinic.sessions.tables import SessionRow
from tests.support.audit_rows import audit_log
from tests.support.responses import problem
from tests.support.treatment import treat


@pytest.fixture
def visit(client: TestClient) -> str:
    """Return the address of a session with two readings of abduction and a playback, not signed."""
    app: Any = client.app
    with app.state.services.database.write() as session:
        made = treat(session, runs=1, signed=False)
    return f"/api/sessions/{made.session_ids[0]}"


def abduction(session: dict[str, Any]) -> dict[str, Any]:
    motions: list[dict[str, Any]] = session["runs"][0]["comparison"]["motions"]
    return next(motion for motion in motions if motion["motion"] == 4)


def add(client: TestClient, url: str, **body: Any) -> dict[str, Any]:
    answer = client.post(f"{url}/goniometer-readings", json={"motion": 4, "patient_deg": 50.0} | body)
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def test_readings_at_two_poses_give_the_patients_angle_with_uncertainty(client: TestClient, visit: str) -> None:
    session = client.get(visit).json()
    found = abduction(session)
    # The goniometer showed 6 deg more at 20 deg and 2 deg less at 80 deg; the apparatus went from 5 to 84.9 deg.
    assert 5.0 < found["patient_min_deg"] < 14.0
    assert 74.0 < found["patient_max_deg"] < 84.9
    assert 6.0 < found["patient_max_uncertainty_deg"] < 20.0
    other = next(motion for motion in session["runs"][0]["comparison"]["motions"] if motion["motion"] == 5)
    assert other["patient_min_deg"] is None and other["patient_max_uncertainty_deg"] is None
    assert client.get(f"/api/runs/{session['runs'][0]['id']}").json() == session["runs"][0]


def test_one_reading_leaves_the_apparatus_angle_only(client: TestClient, visit: str) -> None:
    first = client.get(visit).json()["goniometer_readings"][0]
    removed = client.delete(f"{visit}/goniometer-readings/{first['id']}")
    assert removed.status_code == 200, removed.text
    assert len(removed.json()["goniometer_readings"]) == 1
    assert abduction(removed.json())["patient_max_deg"] is None
    assert audit_log(client, action="remove_goniometer_reading")
    problem(client.delete(f"{visit}/goniometer-readings/{first['id']}"), 404, "not_found")
    assert abduction(add(client, visit, apparatus_deg=21.0))["patient_max_deg"] is not None
    assert audit_log(client, action="add_goniometer_reading")


def test_a_third_reading_makes_the_estimate_more_certain(client: TestClient, visit: str) -> None:
    before = abduction(client.get(visit).json())["patient_max_uncertainty_deg"]
    assert abduction(add(client, visit, apparatus_deg=84.9, patient_deg=80.0))["patient_max_uncertainty_deg"] < before


def test_a_signed_session_keeps_its_readings(client: TestClient, visit: str) -> None:
    seen = client.get(visit).json()
    assert client.post(f"{visit}/sign", json={"note": "Done.", "updated_at": seen["updated_at"]}).status_code == 200
    body = {"motion": 4, "patient_deg": 50.0, "apparatus_deg": 50.0}
    problem(client.post(f"{visit}/goniometer-readings", json=body), 409, "signed")
    reading = seen["goniometer_readings"][0]["id"]
    problem(client.delete(f"{visit}/goniometer-readings/{reading}"), 409, "signed")


def test_a_reading_changes_the_version_that_is_signed(client: TestClient, visit: str) -> None:
    seen = client.get(visit).json()
    add(client, visit, apparatus_deg=60.0)
    problem(
        client.post(f"{visit}/sign", json={"note": "Done.", "updated_at": seen["updated_at"]}), 409, "edited_meanwhile"
    )


@pytest.mark.parametrize("body", [{"motion": 1}, {"motion": 7}, {"patient_deg": 300.0}, {"apparatus_deg": -200.0}])
def test_readings_outside_a_shoulder_are_refused(client: TestClient, visit: str, body: dict[str, Any]) -> None:
    given = {"motion": 4, "patient_deg": 50.0, "apparatus_deg": 50.0} | body
    assert client.post(f"{visit}/goniometer-readings", json=given).status_code == 422


def test_an_open_session_takes_the_angle_that_the_apparatus_measures(
    client: TestClient, patient: dict[str, Any]
) -> None:
    made = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    url = f"/api/sessions/{made['id']}"
    live = client.get("/api/station").json()["live"]
    measured = next(axis["measured_deg"] for axis in live["axes"] if axis["motor"] == 4)
    (reading,) = add(client, url, motion=5)["goniometer_readings"]
    assert reading["apparatus_deg"] == pytest.approx(measured, abs=0.5)
    assert reading["read_by"]
    assert client.post(f"{url}/end", json={"reason": "other"}).status_code == 200
    problem(
        client.post(f"{url}/goniometer-readings", json={"motion": 5, "patient_deg": 9.0}), 409, "no_apparatus_angle"
    )
    ended = add(client, url, motion=5, apparatus_deg=30.0)
    assert ended["goniometer_readings"][-1]["read_at"] == ended["ended_at"]


def test_a_session_at_another_station_needs_the_apparatus_angle(client: TestClient, visit: str) -> None:
    app: Any = client.app
    with app.state.services.database.write() as session:
        for row in session.query(SessionRow).filter_by(station="Kata 1"):
            row.ended_at = None
    problem(
        client.post(f"{visit}/goniometer-readings", json={"motion": 4, "patient_deg": 9.0}), 409, "no_apparatus_angle"
    )
