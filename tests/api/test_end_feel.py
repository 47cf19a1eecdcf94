"""An end-feel test over HTTP, with the simulated apparatus. Its simulated patient stays in it during the baseline."""

from typing import Any

import pytest
from fastapi.testclient import TestClient

from tests.support.audit_rows import audit_log
from tests.support.preflight import go_through_checklist
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.station_api import accepted, until_mode
from tests.support.station_commands import operate
from tests.support.visits import eventually

# At 20 Hz too few angles are measured on the way.
pytestmark = pytest.mark.full_rate


def asked(session_id: str, recording_id: str, kind: str, **more: Any) -> dict[str, Any]:
    given = {
        "session_id": session_id,
        "recording_id": recording_id,
        "kind": kind,
        "torque_nm": 1.5,
        "resistance_level": 25,
    }
    return given | {"speed_deg_s": 10.0} | more


def measured(client: TestClient, body: dict[str, Any]) -> dict[str, Any]:
    run = accepted(client, "load-end-feel", body)
    accepted(client, "approach")
    until_mode(client, "paused")
    assert client.get("/api/station").json()["live"]["run"]["left_s"] is None
    accepted(client, "play")
    until_mode(client, "idle", within_s=120)
    eventually(lambda: client.get(f"/api/runs/{run['id']}").json()["ended_at"])
    found: dict[str, Any] = client.get(f"/api/runs/{run['id']}/end-feel").json()
    return found


def test_baseline_and_test_give_a_curve(client: TestClient, patient: dict[str, Any]) -> None:
    # Hardly farther than the shortest motion that is accepted: the way out and back is passed eight times.
    recording = taught(client, patient, lifted(31.0))
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    problem(
        operate(client, "load-end-feel", asked(session["id"], recording["id"], "baseline")),
        409,
        "identity_not_confirmed",
    )
    go_through_checklist(client, session["id"], recording["id"])
    until_mode(client, "idle")
    problem(operate(client, "load-end-feel", asked(session["id"], recording["id"], "test")), 409, "no_baseline_today")

    baseline = measured(client, asked(session["id"], recording["id"], "baseline"))["result"]
    assert (baseline["kind"], baseline["unmeasured"], baseline["outcome"]) == ("baseline", None, "completed")

    over = asked(session["id"], recording["id"], "test", resistance_level=8)
    assert "level allows" in problem(operate(client, "load-end-feel", over), 409, "unplayable")["detail"]

    found = measured(client, asked(session["id"], recording["id"], "test"))
    result = found["result"]
    # The simulated arm is free up to the end of the way.
    assert (result["unmeasured"], result["motion"], result["side"]) == ("torque_not_reached", 4, "right")
    assert result["baseline_run_id"] == baseline["run_id"]
    assert result["simulated"] is True
    assert len(found["figure"]["data"]) == 3
    guide = client.get(f"/api/sessions/{session['id']}/end-feel").json()
    assert [motion["recording_id"] for motion in guide["motions"]] == [recording["id"]]
    lines = client.get(f"/api/runs/{result['run_id']}/end-feel.csv").text.splitlines()
    assert lines[0] == "angle_deg,torque_out_nm,torque_back_nm,torque_mean_nm,simulated"
    assert client.get(f"/api/runs/{result['run_id']}").json()["end_feel"] == "test"
    problem(client.get(f"/api/runs/{result['run_id']}/figures"), 409, "nothing_played")
    stretch = asked(session["id"], recording["id"], "stretch", hold_s=1.0, repetitions=1, largest_deg=35.0)
    held = measured(client, stretch)["result"]
    # The free arm is held at the largest angle.
    assert (held["kind"], held["outcome"], held["figures"]) == ("stretch", "completed", None)
    assert (held["stretch"]["held_s"], held["stretch"]["target_nm"]) == (0.0, 1.5)
    assert held["stretch"]["largest_deg"] <= 35.0
    assert audit_log(client, action="load_end_feel")
    assert audit_log(client, action="get_end_feel")


def test_other_side_and_short_motion_are_refused(client: TestClient, patient: dict[str, Any]) -> None:
    short, wide = taught(client, patient, lifted(20.0)), taught(client, patient, lifted(), side="left")
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    until_mode(client, "idle")
    problem(
        operate(client, "load-end-feel", asked(session["id"], short["id"], "baseline")), 409, "too_short_for_end_feel"
    )
    problem(operate(client, "load-end-feel", asked(session["id"], wide["id"], "baseline")), 409, "no_open_episode")


def test_playback_has_no_end_feel(client: TestClient) -> None:
    problem(client.get("/api/runs/00000000-0000-4000-8000-000000000000/end-feel"), 404, "not_found")
