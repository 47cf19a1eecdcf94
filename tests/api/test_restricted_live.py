"""While a restricted patient's motion plays, a user without access sees the apparatus's state and no patient data."""

import json
from typing import Any, Final
from uuid import UUID

import pytest
from fastapi.testclient import TestClient

from kata.actor import Role
from kata.auth.login_session import COOKIE
from kata.clinic.patients.tables import PatientRow
from tests.support.login import signed_in
from tests.support.recordings import lifted, taught
from tests.support.station_api import accepted, load, until, until_mode

_ROLES: Final[tuple[Role, ...]] = ("viewer", "technician", "therapist", "administrator")
_PATHS: Final = (
    "/api/station",
    "/api/stations",
    "/api/events",
    "/metrics",
    "/health/ready",
    "/api/station/ready-patients",
)


@pytest.fixture(scope="module")
def playing(client: TestClient) -> dict[str, Any]:
    """Return what identifies the patient and the run, while the run plays and the record has become restricted."""
    app: Any = client.app
    until_mode(client, "idle")
    body = {"clinic_number": "CANARY-NUMBER", "name": "Canary Name", "affected_side": "right"}
    patient = client.post("/api/patients", json=body).json()
    recording = taught(client, patient, lifted(), name="Canary lift")
    run = load(client, patient, recording)
    until_mode(client, "ready")
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until(client, lambda live: live["mode"] == "playing" and live["run"]["patient"]["name"] == "Canary Name")
    with app.state.services.database.write() as session:
        session.get_one(PatientRow, UUID(patient["id"])).restricted = True
    return {
        "name": "Canary Name",
        "number": "CANARY-NUMBER",
        "recording": recording["name"],
        "patient_id": patient["id"],
        "session_id": run["session_id"],
        "run_id": run["id"],
    }


@pytest.mark.parametrize(
    "role", [*(pytest.param(role, marks=pytest.mark.campaign) for role in _ROLES[:2]), *_ROLES[2:]]
)
def test_other_users_see_the_state_and_no_patient(client: TestClient, playing: dict[str, Any], role: Role) -> None:
    app: Any = client.app
    other = TestClient(app, cookies={COOKIE: signed_in(app.state.services.database, role)})
    answers = {path: other.get(path).text for path in _PATHS}
    run = json.loads(answers["/api/station"])["live"]["run"]
    assert (run["run_id"], run["patient"]) == (playing["run_id"], None)
    with other.websocket_connect("/api/live") as socket:
        answers["/api/live"] = "".join(socket.receive_text() for _ in range(10))
    with other.websocket_connect("/api/stations/live") as socket:
        answers["/api/stations/live"] = "".join(socket.receive_text() for _ in range(2))
    found = {
        (path, what)
        for path, text in answers.items()
        for what, value in playing.items()
        if what != "run_id" and value in text
    }
    assert found == set()
