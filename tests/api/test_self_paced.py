"""A self-paced run needs the doctor's permission in the episode, and a station whose load is identified."""

from typing import Any

from fastapi.testclient import TestClient

from kata.device.ipc_messages import Load
from kata.station.station import Station
from tests.support.audit_rows import audit_log
from tests.support.preflight import go_through_checklist
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.station_api import accepted, until_mode
from tests.support.station_commands import operate


def test_self_paced_run_needs_the_doctors_permission(
    client: TestClient, patient: dict[str, Any], monkeypatch: Any
) -> None:
    sent: list[Load] = []
    send = Station.command

    async def note(station: Station, command: Any, *given: Any, **named: Any) -> Any:
        if isinstance(command, Load):
            sent.append(command)
        return await send(station, command, *given, **named)

    monkeypatch.setattr(Station, "command", note)
    recording = taught(client, patient, lifted(40.0))
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    go_through_checklist(client, session["id"], recording["id"])
    until_mode(client, "idle")
    load = {"session_id": session["id"], "recording_id": recording["id"], "resistance_level": 25, "self_paced": True}
    refusal = problem(operate(client, "load", load), 422, "self_pace_not_permitted")
    assert refusal["detail"] == "The doctor has not permitted that the patient sets the pace for this shoulder."
    assert sent == []

    url = f"/api/episodes/{session['episode_id']}"
    assert client.get(url).json()["self_paced_permitted"] is False
    problem(client.patch(url, json={"self_paced_permitted": True}), 422, "limits_by_nobody")
    permitted = client.patch(url, json={"self_paced_permitted": True, "limits_by": "Dr. Mori"}).json()
    assert permitted["self_paced_permitted"] is True
    [entry, *_] = audit_log(client, action="update_episode")
    assert "self_paced_permitted" in str(entry)

    # The load of the simulated station is not identified.
    problem(operate(client, "load", load), 409, "not_self_paced")
    assert [command.self_paced for command in sent] == [True]
    assert client.get(f"/api/sessions/{session['id']}").json()["runs"] == []

    run = accepted(client, "load", load | {"self_paced": False})
    assert (run["self_paced"], run["work_j"], run["mean_effort_nm"]) == (False, None, None)
    assert [command.self_paced for command in sent] == [True, False]
    accepted(client, "unload")

    client.patch(url, json={"self_paced_permitted": False})
    problem(operate(client, "load", load), 422, "self_pace_not_permitted")
