"""Teaching and playback over REST and WebSocket, with a simulated apparatus."""

import os
import signal
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from kata.motion.scapula_fit import coefficients
from kata.motion.taught import Taught
from kata.simulator.parameters import REST_DEG
from kata.station import device_process
from tests.support.preflight import go_through_checklist, still_open, teaching
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.service import running
from tests.support.station_api import accepted, load, teach, until, until_mode
from tests.support.station_commands import operate
from tests.support.visits import eventually


@pytest.fixture(scope="module")
def recording(client: TestClient, taught_patient: dict[str, Any]) -> dict[str, Any]:
    return teach(client, taught_patient)


@pytest.fixture(scope="module")
def taught_patient(client: TestClient) -> dict[str, Any]:
    body = {"clinic_number": "S-1", "name": "Suzuki Aoi", "affected_side": "right"}
    made: dict[str, Any] = client.post("/api/patients", json=body).json()
    return made


def test_first_message_is_a_snapshot_and_all_have_the_estop(client: TestClient) -> None:
    until_mode(client, "idle")
    with client.websocket_connect("/api/live") as socket:
        messages = [socket.receive_json() for _ in range(30)]

    assert messages[0]["kind"] == "snapshot"
    assert messages[0]["station"]["simulated"] is True
    assert len(messages[0]["live"]["axes"]) == 5
    assert [message["sequence"] for message in messages] == list(range(1, 31))
    assert {message["estop"] for message in messages} == {"closed"}
    assert {message["mode"] for message in messages} == {"idle"}
    changes = messages[1:]
    assert {message["kind"] for message in changes} == {"change"}
    # A message contains only changes. The arm is at rest, so it never contains all fields.
    assert all(set(message["live"]) < set(messages[0]["live"]) for message in changes)


def test_other_sites_page_cannot_listen(client: TestClient) -> None:
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect("/api/live", headers={"origin": "https://elsewhere.example"}),
    ):
        pass


def test_a_taught_motion_is_a_recording_with_its_samples(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    assert recording["name"] == "Shrug"
    assert recording["side"] == "right"
    assert recording["taught_by"] == "Sato"
    assert recording["fixtures"] == ["arm_fixer_1"]
    assert recording["readable"] is True
    assert recording["ranges"][0]["max_deg"] - recording["ranges"][0]["min_deg"] > 30
    lines = client.get(f"/api/recordings/{recording['id']}/samples.csv").text.splitlines()
    assert lines[0] == "time_s,motor_1_deg,motor_2_deg,motor_3_deg,motor_4_deg,motor_5_deg,simulated"
    assert len(lines) == recording["samples"] + 1
    figure = client.get(f"/api/recordings/{recording['id']}/figure").json()
    assert len(figure["data"]) == 5
    motion = client.get(f"/api/recordings/{recording['id']}/motion").json()
    assert (motion["side"], motion["times_s"][0]) == ("right", 0)
    assert motion["times_s"][-1] == pytest.approx(recording["duration_s"], abs=0.01)
    for axis, reach in enumerate(recording["ranges"]):
        shown = [row[axis] for row in motion["angles_deg"]]
        assert (min(shown), max(shown)) == pytest.approx((reach["min_deg"], reach["max_deg"]), abs=0.5)
    listed = client.get(f"/api/patients/{taught_patient['id']}/recordings").json()["items"]
    assert recording["id"] in {row["id"] for row in listed}
    renamed = client.patch(f"/api/recordings/{recording['id']}", json={"name": "Raise", "note": "Slowly."}).json()
    assert (renamed["name"], renamed["note"]) == ("Raise", "Slowly.")


def test_turned_apparatus_teaches_the_other_shoulder_and_stays_turned(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    wanted = teaching(client, taught_patient["id"], name="Left", side="left")
    problem(client.post("/api/station/teach", json=wanted), 409, "other_side")
    run = load(client, taught_patient, recording)
    problem(client.post("/api/station/side", json={"side": "left"}), 409, "not_idle")
    accepted(client, "unload")
    until_mode(client, "idle")

    accepted(client, "side", {"side": "left"})
    live = until_mode(client, "idle")
    assert live["side"] == "left"
    # Another control program has connected: the emergency stop is tested again.
    assert still_open(client, run["session_id"], recording["id"]) == ["estop"]
    go_through_checklist(client, run["session_id"], recording["id"])
    body = {"session_id": run["session_id"], "resistance_level": 25, "recording_id": recording["id"]}
    problem(client.post("/api/station/load", json=body), 409, "other_side")
    assert client.post(f"/api/sessions/{run['session_id']}/end").status_code == 200
    left = teach(client, taught_patient, side="left")
    assert left["side"] == "left"
    # The same shrug of the other shoulder has the same angles of the body and the same ranges of the motors.
    reach = [[motor["max_deg"] - motor["min_deg"] for motor in row["ranges"]] for row in (recording, left)]
    assert reach[1][2:] == pytest.approx(reach[0][2:], abs=4.0)
    accepted(client, "side", {"side": "right"})
    assert until_mode(client, "idle")["side"] == "right"


def test_play_stop_by_switch_reset_and_play_again(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    first = load(client, taught_patient, recording)
    live = until_mode(client, "ready")
    assert live["run"]["patient"]["name"] == "Suzuki Aoi"
    assert live["refusals"]["play"]["code"] == "is_ready"
    problem(operate(client, "play"), 409, "is_ready")
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until(client, lambda live: live["run"] and live["run"]["position_s"] > 0.5)
    client.post("/api/simulator/estop", json={"pressed": True})
    live = until_mode(client, "stopped")
    assert live["estop"] == "pressed"
    assert live["stop"]["causes"][0]["code"] == "estop_pressed"
    refusal = problem(operate(client, "acknowledge"), 409, "estop_pressed")
    assert "Release the switch" in refusal["next_step"]

    client.post("/api/simulator/estop", json={"pressed": False})
    until(client, lambda live: live["estop"] == "released" and "acknowledge" not in live["refusals"])
    accepted(client, "acknowledge")
    until_mode(client, "idle")
    second = load(client, taught_patient, recording)
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until_mode(client, "returning")
    with client.websocket_connect("/api/live") as socket:
        while (message := socket.receive_json())["kind"] != "saved":
            pass
    assert (message["what"], message["id"]) == ("run", second["id"])

    runs = client.get(f"/api/sessions/{second['session_id']}").json()["runs"]
    assert [(run["id"], run["outcome"]) for run in runs] == [(first["id"], "stopped"), (second["id"], "completed")]
    assert runs[0]["stop"]["code"] == "estop_pressed"
    errors = runs[1]["comparison"]["motors"]
    assert [motor["motor"] for motor in errors] == [1, 2, 3, 4, 5]
    assert all(abs(motor["start_deg"]) <= 1.0 for motor in errors)
    assert all(abs(motor["peak_deg"]) <= 6.0 for motor in errors)
    figures = client.get(f"/api/runs/{second['id']}/figures").json()["motors"]
    assert [trace["name"] for trace in figures[0]["figure"]["data"]] == ["Requested", "Playback", "Error"]


def test_the_stop_button_stops(client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]) -> None:
    load(client, taught_patient, recording)
    accepted(client, "approach")
    until_mode(client, "paused")
    operator_under_torque = client.app.state.services.auth.revocations.operator_under_torque  # type: ignore[attr-defined]
    assert operator_under_torque() is not None
    accepted(client, "stop")
    live = until(client, lambda live: live["mode"] == "stopped" and live["torque"] == "off")
    assert operator_under_torque() is None
    assert live["stop"]["causes"][0]["code"] == "operator_stop"
    accepted(client, "acknowledge")
    until_mode(client, "idle")


def test_websocket_stop_is_answered_and_other_messages_are_ignored(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    load(client, taught_patient, recording)
    accepted(client, "approach")
    until(client, lambda live: live["torque"] == "on")
    with client.websocket_connect("/api/live") as socket:
        for nothing in ("", "stop", "[]", '{"kind": "play"}', '{"kind": "stop"}', '{"kind": "stop", "number": -1}'):
            socket.send_text(nothing)
        socket.send_bytes(b'{"kind": "stop", "number": 6}')
        socket.send_json({"kind": "stop", "number": 7})
        sequence = 0
        live: dict[str, Any] = {"mode": ""}
        answers: list[dict[str, Any]] = []
        while not answers or live["mode"] != "stopped":
            message = socket.receive_json()
            assert message["sequence"] == sequence + 1
            sequence, live = message["sequence"], live | message.get("live", {})
            answers += [message] if message["kind"] == "stop_answer" else []
    assert [(answer["number"], answer["refusal"]) for answer in answers] == [(7, None)]
    until(client, lambda live: live["stop"] and "acknowledge" not in live["refusals"])
    accepted(client, "acknowledge")
    until_mode(client, "idle")


def test_recording_of_another_patient_is_not_played(
    client: TestClient, patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    body = {"session_id": session["id"], "resistance_level": 25, "recording_id": recording["id"]}
    problem(client.post("/api/station/load", json=body), 409, "other_patient")
    assert client.get(f"/api/sessions/{session['id']}").json()["runs"] == []


def test_a_refused_load_leaves_no_run_behind(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    run = load(client, taught_patient, recording)
    body = {"session_id": run["session_id"], "resistance_level": 25, "recording_id": recording["id"]}
    before = len(client.get(f"/api/sessions/{run['session_id']}").json()["runs"])
    problem(client.post("/api/station/load", json=body), 409, "is_ready")
    assert len(client.get(f"/api/sessions/{run['session_id']}").json()["runs"]) == before
    problem(client.post(f"/api/sessions/{run['session_id']}/end"), 409, "run_not_ended")
    accepted(client, "unload")
    until_mode(client, "idle")


@pytest.mark.parametrize("level", [0, 26, 8.5, "high", None])
def test_invalid_resistance_level_is_reported_at_its_field(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any], level: object
) -> None:
    session = client.post("/api/sessions", json={"patient_id": taught_patient["id"]}).json()
    body = {"session_id": session["id"], "recording_id": recording["id"], "resistance_level": level}
    refusal = problem(client.post("/api/station/load", json=body), 422, "invalid")
    assert [error["pointer"] for error in refusal["errors"]] == ["#/resistance_level"]
    assert until_mode(client, "idle")["run"] is None


@pytest.mark.parametrize(("settings", "level"), [({"resistance_level": 7}, 7), ({}, 25)])
def test_resistance_level_reaches_the_device_and_is_stored_with_runs(
    client: TestClient,
    taught_patient: dict[str, Any],
    recording: dict[str, Any],
    settings: dict[str, int],
    level: int,
) -> None:
    run = load(client, taught_patient, recording, **settings)
    live = until_mode(client, "ready")
    assert live["run"]["resistance_level"] == level
    assert (live["run"]["reversals"], live["run"]["reversing"], live["run"]["resistance"]) == (0, False, None)
    accepted(client, "unload")
    until_mode(client, "idle")
    assert client.get(f"/api/runs/{run['id']}").json()["resistance_level"] == level


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("speed_percent", 9.9), ("speed_percent", 151), ("repetitions", 0), ("repetitions", 201), ("repetitions", 1.5),
        ("pause_s", -1), ("pause_s", 121), ("range_percent", 9), ("range_percent", 101), ("range_percent", None),
    ],
)  # fmt: skip
def test_invalid_playback_settings_are_reported_at_their_fields(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any], field: str, value: object
) -> None:
    session = client.post("/api/sessions", json={"patient_id": taught_patient["id"]}).json()
    body = {"session_id": session["id"], "resistance_level": 25, "recording_id": recording["id"], field: value}
    refusal = problem(client.post("/api/station/load", json=body), 422, "invalid")
    assert [error["pointer"] for error in refusal["errors"]] == [f"#/{field}"]
    assert until_mode(client, "idle")["run"] is None


def test_playback_longer_than_an_hour_is_refused_without_a_run(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    session = client.post("/api/sessions", json={"patient_id": taught_patient["id"]}).json()
    go_through_checklist(client, session["id"], recording["id"])
    before = len(client.get(f"/api/sessions/{session['id']}").json()["runs"])
    body = {
        "session_id": session["id"],
        "resistance_level": 25,
        "recording_id": recording["id"],
        "speed_percent": 10,
        "repetitions": 200,
    }
    refusal = problem(client.post("/api/station/load", json=body), 422, "unplayable")
    assert "200 repetitions" in refusal["detail"]
    assert len(client.get(f"/api/sessions/{session['id']}").json()["runs"]) == before


def test_run_is_played_with_its_settings_and_compared_with_them(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    settings = {"speed_percent": 150.0, "repetitions": 2, "pause_s": 0.5, "range_percent": 50.0}
    run = load(client, taught_patient, recording, **settings)
    live = until_mode(client, "ready")
    assert live["run"]["changes"] == [
        "50 % of the range",
        "at 150 % speed",
        "2 repetitions with a pause of 0.5 s at each end",
    ]
    once_s = recording["duration_s"] / 1.5
    assert live["run"]["duration_s"] == pytest.approx(2 * once_s + 1.0, abs=1.5)
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until_mode(client, "returning", within_s=2 * once_s + 30)
    with client.websocket_connect("/api/live") as socket:
        while socket.receive_json()["kind"] != "saved":
            pass

    played = client.get(f"/api/runs/{run['id']}").json()
    assert played["outcome"] == "completed"
    assert {name: played[name] for name in settings} == settings
    first = played["comparison"]["motors"][0]
    taught = recording["ranges"][0]
    half = (taught["max_deg"] - taught["min_deg"]) / 2
    assert first["taught_max_deg"] - first["taught_min_deg"] == pytest.approx(half, abs=0.01)
    assert first["played_max_deg"] - first["played_min_deg"] == pytest.approx(half, abs=4.0)
    # The run has half the range: a comparison with the recording itself would differ by a quarter of its range.
    assert abs(first["peak_deg"]) <= 6.0
    assert -50.0 <= first["lag_ms"] <= 200.0
    assert first["taught_smoothness"] < -1.4
    assert first["torque_peak_nm"] != 0.0
    # The scapula was shrugged: motion 1 of Table 2.
    assert [motion["motion"] for motion in played["comparison"]["motions"]] == [1]
    assert played["comparison"]["motions"][0]["apparatus_max_deg"] == 20.0


@pytest.mark.parametrize(
    ("settings", "method", "changes"),
    [
        ({}, "smooth", []),
        ({"method": "paper"}, "paper", ["as in the paper, at 10 Hz"]),
        ({"method": "learned"}, "learned", ["learned method, no earlier playbacks yet"]),
    ],
)
def test_the_method_reaches_the_device_and_stays_with_the_run(
    client: TestClient,
    taught_patient: dict[str, Any],
    recording: dict[str, Any],
    settings: dict[str, str],
    method: str,
    changes: list[str],
) -> None:
    run = load(client, taught_patient, recording, **settings)
    assert until_mode(client, "ready")["run"]["changes"] == changes
    accepted(client, "unload")
    until_mode(client, "idle")
    assert client.get(f"/api/runs/{run['id']}").json()["method"] == method


def test_learning_of_one_playback_applies_to_the_next(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    """The correction reaches the device, which refuses a correction of another length."""
    settings: dict[str, Any] = {"method": "learned", "speed_percent": 150.0}
    run = load(client, taught_patient, recording, **settings)
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until_mode(client, "returning")
    with client.websocket_connect("/api/live") as socket:
        while socket.receive_json()["kind"] != "saved":
            pass
    assert client.get(f"/api/runs/{run['id']}").json()["outcome"] == "completed"

    load(client, taught_patient, recording, **settings)
    assert until_mode(client, "ready")["run"]["changes"] == ["at 150 % speed", "learned from earlier playbacks"]
    accepted(client, "unload")
    until_mode(client, "idle")


def test_repeated_resistance_in_one_place_holds_the_arm_until_supported(
    client: TestClient, taught_patient: dict[str, Any]
) -> None:
    load(client, taught_patient, taught(client, taught_patient, lifted()), resistance_level=8)
    accepted(client, "approach")
    until_mode(client, "paused")
    with closing(client.app.state.services.simulation.process.client()) as jammed:  # type: ignore[attr-defined]
        jammed.fault("stuck", 3)
        accepted(client, "play")
        # A permanently jammed shaft could not return.
        until(client, lambda live: live["run"] and live["run"]["reversals"] == 1)
        jammed.clear_faults()
        live = until(client, lambda live: live["mode"] == "paused" and live["run"]["reversing"])
        assert live["run"]["reversals"] == 1
        assert "Motor 3 met resistance" in live["run"]["resistance"]
        assert live["stop"] is None

        jammed.fault("stuck", 3)
        accepted(client, "play")
        until(client, lambda live: live["run"] and live["run"]["reversals"] == 2)
        jammed.clear_faults()
        live = until(client, lambda live: live["mode"] == "stopped" and "acknowledge" not in live["refusals"])
        assert [(cause["code"], cause["category"]) for cause in live["stop"]["causes"]] == [("load_repeated", 2)]
        assert live["stop"]["arm_held"] is True
        assert live["torque"] == "on"
        jammed.clear_faults()
    accepted(client, "acknowledge")
    until(client, lambda live: live["mode"] == "idle" and live["torque"] == "off")


def test_arm_stops_when_service_and_device_disagree_about_the_run(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any]
) -> None:
    load(client, taught_patient, recording)
    accepted(client, "approach")
    until_mode(client, "paused")
    station = client.app.state.services.station  # type: ignore[attr-defined]
    station._tracker.occupation = replace(station.occupation, id="another")
    live = until(client, lambda live: live["mode"] == "stopped" and "acknowledge" not in live["refusals"])
    assert live["stop"]["causes"][0]["code"] == "other_run"
    assert live["stop"]["arm_held"] is False
    accepted(client, "acknowledge")
    until_mode(client, "idle")


def test_bad_motions_are_refused_with_line_and_column(client: TestClient, motion: Taught) -> None:
    def upload(text: str) -> Any:
        headers = {"content-type": "text/csv"}
        return client.post("/api/simulator/motions", params={"name": "mine"}, content=text, headers=headers)

    header = "time_s,scapula_abduction,scapula_upward_rotation,shoulder_abduction,shoulder_flexion,external_rotation\n"
    refusal = problem(upload(header + "0,0,0,0,0,0\n1,0,0,a lot,0,0\n"), 422, "not_a_motion")
    assert "line 3, column shoulder_abduction" in refusal["detail"]
    good = upload(header + "0,0,0,10,0,0\n1,0,0,20,0,0\n")
    assert good.status_code == 201
    listed = client.get("/api/simulator").json()["motions"]
    assert (good.json()["id"], "uploaded") in {(row["id"], row["source"]) for row in listed}
    problem(client.post("/api/simulator/guide", json={"motion_id": "none"}), 404, "not_found")


def test_missing_apparatus_is_reported_and_its_state_is_unknown(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    station.write_text(f'port = "{tmp_path}/no-such-adapter"\n')
    with running(tmp_path, simulate=False, station=station) as client:
        live = until(client, lambda live: live["device"] == "running")
        assert live["mode"] == "offline"
        assert live["estop"] == "unknown"
        assert "no-such-adapter" in live["refusals"]["teach"]["message"]
        assert client.get("/api/station").json()["station"]["simulated"] is False
        problem(client.post("/api/simulator/estop", json={"pressed": True}), 404, "not_simulating")


def test_dead_device_process_is_restarted_and_resumes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device_process, "_RESTART_S", (3.0,))
    # At 20 Hz the new process cannot yet have read the emergency stop when it finds the torque, which is another cause of the stop.
    with running(tmp_path, full_rate=True) as client:
        body = {"clinic_number": "1", "name": "N", "affected_side": "right"}
        who = client.post("/api/patients", json=body).json()
        until_mode(client, "idle")
        run = load(client, who, taught(client, who, lifted()))
        accepted(client, "approach")
        until_mode(client, "paused")
        accepted(client, "play")
        until(client, lambda live: live["run"] and live["run"]["position_s"] > 0.5)
        os.kill(client.app.state.services.station._process._child.pid, signal.SIGKILL)  # type: ignore[attr-defined]

        live = until(client, lambda live: live["device"] == "restarting")
        assert (live["mode"], live["estop"], live["torque"]) == ("offline", "unknown", "unknown")
        problem(operate(client, "play"), 503, "device_offline")
        # The drives' watchdogs have stopped the arm and hold it.
        live = until_mode(client, "stopped")
        assert {cause["code"] for cause in live["stop"]["causes"]} == {"torque_found"}
        assert (live["run"], live["torque"], live["stop"]["arm_held"]) == (None, "on", True)
        with closing(client.app.state.services.simulation.process.client()) as hand:  # type: ignore[attr-defined]
            assert all(axis.torque_on for axis in hand.state().axes)
            problem(operate(client, "acknowledge"), 409, "torque_found")
            accepted(client, "release-torque")
            until(client, lambda live: live["torque"] == "off" and "acknowledge" not in live["refusals"])
            assert not any(axis.torque_on for axis in hand.state().axes)
        accepted(client, "acknowledge")
        until_mode(client, "idle")
        stored = client.get(f"/api/runs/{run['id']}").json()
        assert stored["outcome"] == "interrupted"
        assert stored["comparison"]["samples"] > 20


def test_refused_load_keeps_showing_the_current_run(
    client: TestClient, taught_patient: dict[str, Any], recording: dict[str, Any], patient: dict[str, Any]
) -> None:
    load(client, taught_patient, recording)
    problem(client.post("/api/station/teach", json=teaching(client, patient["id"])), 409, "is_ready")
    live = until(client, lambda live: live["mode"] == "ready")
    assert live["run"]["patient"]["name"] == "Suzuki Aoi"
    accepted(client, "unload")
    until_mode(client, "idle")


def test_turned_apparatus_stays_turned_after_a_service_restart(tmp_path: Path) -> None:
    with running(tmp_path) as client:
        until_mode(client, "idle")
        accepted(client, "side", {"side": "left"})
        until_mode(client, "idle")
    with running(tmp_path) as client:
        live = until_mode(client, "idle")
        assert live["side"] == "left"
        # The arm rests slightly abducted. If only apparatus or drives were turned, the angle would have the other sign.
        assert live["axes"][2]["measured_deg"] == pytest.approx(REST_DEG[2], abs=3.0)
        assert REST_DEG[2] > 5.0


def test_live_rhythm_is_prepared_before_an_arm_moves(tmp_path: Path) -> None:
    """The first take once stopped the service's answers to the device for the time of a fit."""
    coefficients.cache_clear()
    with running(tmp_path) as client:
        until_mode(client, "idle")
        eventually(lambda: coefficients.cache_info().currsize)
