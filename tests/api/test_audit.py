"""The audit trail of the real service: changes, views, refusals and commands with their users, and the search."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from kata.audit import deduplication
from kata.audit.entries import entry
from kata.audit.verify import verify
from kata.auth.login_session import COOKIE
from kata.settings import Settings
from tests.support.audit_rows import audit_log
from tests.support.login import signed_in
from tests.support.other_disk import other_disk
from tests.support.service import running
from tests.support.station_api import until_mode
from tests.support.station_commands import operate

_BY_PROGRAM: Final = {
    "service_started",
    "service_ended",
    "import_journal",
    "prepare_demonstration",
    "register_station",
    "unnamed",
}
"""The last one is for rows that tests write without the service."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("audited")


@pytest.fixture(scope="module")
def client(folder: Path) -> Iterator[TestClient]:
    """Return a service on a folder that the tests know."""
    with running(folder) as made:
        yield made


@contextmanager
def acting_as(client: TestClient, role: Any) -> Iterator[None]:
    """Sign another user in at this browser; None: no user."""
    before = client.cookies[COOKIE]
    client.cookies.delete(COOKIE)
    if role:
        client.cookies.set(COOKIE, signed_in(client.app.state.services.database, role))  # type: ignore[attr-defined]
    try:
        yield
    finally:
        client.cookies.clear()
        client.cookies.set(COOKIE, before)


def of_patient(client: TestClient, patient: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a patient's entries, without those of reading the trail."""
    return [row for row in audit_log(client, patient_id=patient["id"]) if row["action"] != "list_audit"]


def acts(client: TestClient, **wanted: Any) -> list[tuple[str, str, str]]:
    """Return user, action and outcome of each entry, oldest first."""
    return [(row["role"], row["action"], row["outcome"]) for row in reversed(audit_log(client, **wanted))]


def is_whole(folder: Path, client: TestClient) -> bool:
    database = client.app.state.services.database  # type: ignore[attr-defined]
    with database.read() as session:
        return verify(session, [Settings(data=folder).effective_audit_anchor]).intact


def test_audit_trail_records_who_did_what_with_a_record(
    client: TestClient, patient: dict[str, Any], folder: Path
) -> None:
    path = f"/api/patients/{patient['id']}"
    client.get(path)
    client.get(path)
    client.patch(path, json={"notes": "Plays the violin."})
    with acting_as(client, "viewer"):
        client.get(path)
        client.patch(path, json={"notes": "Mine."})
    with acting_as(client, "technician"):
        client.get(path)
    with acting_as(client, None):
        client.get(path)
        client.delete(path)
    assert acts(client, patient_id=patient["id"]) == [
        ("administrator", "create_patient", "done"),
        ("administrator", "get_patient", "done"),
        ("administrator", "update_patient", "done"),
        ("viewer", "get_patient", "done"),
    ]
    refused = [
        (row["role"], row["action"], row["detail"]["why"]) for row in reversed(audit_log(client, outcome="refused"))
    ]
    assert [row for row in refused if row[1] in ("get_patient", "update_patient")] == [
        ("viewer", "update_patient", "not_allowed"),
        ("technician", "get_patient", "not_allowed"),
        ("", "get_patient", "not_signed_in"),
    ]
    changed = next(row for row in audit_log(client, action="update_patient") if row["outcome"] == "done")
    assert changed["detail"] == {"changed": {"patients": {patient["id"]: ["notes", "updated_at"]}}}
    assert changed["who"] == "Test administrator"
    assert is_whole(folder, client)


REFRESH: Final = {"x-kata-refresh": "1"}


@pytest.fixture
def every_view(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    """Record a view that repeats another one within a minute, too."""
    monkeypatch.setattr(deduplication, "WINDOW_S", 0.0)
    audit_log = client.app.state.services.audit_log  # type: ignore[attr-defined]
    monkeypatch.setattr(audit_log, "_deduplicator", deduplication.Deduplicator())


def views(client: TestClient, patient: dict[str, Any]) -> list[str]:
    assert client.app.state.services.audit_log.until_written()  # type: ignore[attr-defined]
    return [row["action"] for row in of_patient(client, patient) if row["action"].startswith("get_")]


def test_refresh_of_a_recorded_view_is_not_recorded(
    client: TestClient, patient: dict[str, Any], every_view: None
) -> None:
    path = f"/api/patients/{patient['id']}"
    for headers in ({}, REFRESH, REFRESH):
        assert client.get(path, headers=headers).status_code == 200
    assert views(client, patient) == ["get_patient"]
    client.get(path)
    assert views(client, patient) == ["get_patient"] * 2, "the user opened it again"


def test_refresh_without_a_recorded_view_is_recorded(
    client: TestClient, patient: dict[str, Any], every_view: None
) -> None:
    path = f"/api/patients/{patient['id']}"
    client.get(f"{path}/banner", headers=REFRESH)
    client.get(path, headers=REFRESH)
    client.get(f"{path}?any=1", headers=REFRESH)
    with acting_as(client, "viewer"):
        client.get(path, headers=REFRESH)
    with acting_as(client, "technician"):
        client.get(path, headers=REFRESH)
    found = views(client, patient)
    assert (found.count("get_patient_banner"), found.count("get_patient")) == (1, 3)
    refused = audit_log(client, action="get_patient", outcome="refused")
    assert refused[0]["role"] == "technician"


def test_notifications_are_no_view(client: TestClient, every_view: None) -> None:
    for role in ("administrator", "technician"):
        with acting_as(client, role):
            assert client.get("/api/notifications").status_code == 200
    assert audit_log(client, action="list_notifications") == []


def test_moving_and_stopping_the_apparatus_is_recorded(client: TestClient) -> None:
    until_mode(client, "idle")
    operate(client, "play")
    with acting_as(client, "technician"):
        client.post("/api/station/stop")
    answer = acts(client, station=client.get("/api/station").json()["station"]["name"])
    assert ("administrator", "play", "refused") in answer
    assert ("technician", "stop", "done") in answer
    operate(client, "acknowledge")


def test_live_viewers_are_recorded(client: TestClient) -> None:
    before = len(audit_log(client, action="live"))
    with acting_as(client, "viewer"), client.websocket_connect("/api/live") as socket:
        socket.receive_json()
    watched = audit_log(client, action="live")
    assert len(watched) == before + 1
    assert (watched[0]["role"], watched[0]["outcome"]) == ("viewer", "done")


def test_refused_live_viewers_are_recorded_as_well(client: TestClient) -> None:
    with acting_as(client, None), pytest.raises(WebSocketDisconnect), client.websocket_connect("/api/live"):
        pass
    assert (audit_log(client, action="live")[0]["who"], audit_log(client, action="live")[0]["outcome"]) == (
        "",
        "refused",
    )


def test_refused_requests_are_recorded(client: TestClient) -> None:
    client.post("/api/patients", json={}, headers={"origin": "https://evil.example"})
    row = audit_log(client, action="at_the_door")[0]
    assert (row["outcome"], row["subject"], row["who"]) == ("refused", "POST /api/patients", "")


def test_a_form_that_is_filled_in_wrongly_is_no_refusal(client: TestClient) -> None:
    before = len(audit_log(client, action="create_patient"))
    assert client.post("/api/patients", json={"name": ""}).status_code == 422
    assert len(audit_log(client, action="create_patient")) == before


def test_audit_search_applies_every_filter_and_pages_through_results(
    client: TestClient, patient: dict[str, Any]
) -> None:
    for n in range(5):
        client.patch(f"/api/patients/{patient['id']}", json={"notes": f"{n}"})
    # Searching the trail adds rows to it, so the search uses one action.
    wanted = {"patient_id": patient["id"], "action": "update_patient"}
    found = audit_log(client, **wanted)
    assert [row["outcome"] for row in found] == ["done"] * 5
    first = client.get("/api/audit", params=wanted | {"limit": 3}).json()
    second = client.get("/api/audit", params=wanted | {"limit": 3, "after": first["next"]}).json()
    assert first["items"] + second["items"] == found
    assert second["next"] is None
    at = found[2]["at"]
    assert audit_log(client, **wanted, since=at) == found[:3]
    assert audit_log(client, **wanted, until=at) == found[3:]
    account = found[0]["account_id"]
    assert {row["account_id"] for row in audit_log(client, account_id=account)} == {account}
    assert audit_log(client, account_id=str(uuid4())) == []
    assert client.get("/api/audit", params={"outcome": "anything"}).status_code == 422
    assert client.get("/api/audit", params={"after": "there"}).status_code == 422


def test_events_delayed_by_an_outage_are_ordered_by_their_time(client: TestClient) -> None:
    begun = replace(entry("unnamed", "done"), station="Drill")
    for minutes in (0, -30, 30, -60):
        one = replace(begun, at=begun.at + timedelta(minutes=minutes), subject=str(minutes))
        client.app.state.services.audit_log.record_at_once(one)  # type: ignore[attr-defined]
    found = audit_log(client, station="Drill")
    assert [row["subject"] for row in found] == ["30", "0", "-30", "-60"]
    numbers = [row["number"] for row in found]
    assert numbers != sorted(numbers, reverse=True)
    since, until = found[2]["at"], found[0]["at"]
    assert audit_log(client, station="Drill", since=since, until=until) == found[1:3]
    first = client.get("/api/audit", params={"station": "Drill", "limit": 3}).json()
    rest = client.get("/api/audit", params={"station": "Drill", "after": first["next"]}).json()
    assert first["items"] + rest["items"] == found


@pytest.mark.parametrize("role", ["viewer", "therapist", "technician"])
def test_only_administrators_read_the_trail_and_reading_is_recorded(client: TestClient, role: str) -> None:
    with acting_as(client, role):
        assert client.get("/api/audit").status_code == 403
    assert (role, "list_audit", "refused") in acts(client, action="list_audit")
    assert ("administrator", "list_audit", "done") in acts(client, action="list_audit")


def test_erasing_a_patient_leaves_the_trail_which_has_no_names(
    client: TestClient, patient: dict[str, Any], folder: Path
) -> None:
    path = f"/api/patients/{patient['id']}"
    asked = client.post(f"{path}/erasures", json={"reason": "Moves away.", "noted_by": "Sato"})
    assert asked.status_code == 201, asked.text
    before = of_patient(client, patient)
    done = client.post(
        f"/api/erasures/{asked.json()['id']}/approve",
        json={"clinic_number": patient["clinic_number"], "decided_by": "Sato", "explanation": ""},
    )
    assert done.status_code == 200, done.text
    after = of_patient(client, patient)
    assert after[1:] == before
    assert after[0]["action"] == "erase_patient"
    answer = repr(audit_log(client))
    assert "Yamada" not in answer
    assert patient["clinic_number"] not in answer
    assert is_whole(folder, client)


def test_program_actions_are_recorded_as_the_programs(client: TestClient) -> None:
    by_nobody = {
        (row["who"], row["action"]) for row in audit_log(client) if row["account_id"] is None and not row["address"]
    }
    assert {who for who, _ in by_nobody} == {"Kata"}
    assert {action for _, action in by_nobody} <= _BY_PROGRAM


def test_audit_page_says_where_the_heads_are_stored(client: TestClient, tmp_path: Path) -> None:
    heads = client.get("/api/audit").json()["heads"]
    assert heads == {"elsewhere": [], "copy_file": None, "failing_since": None, "log": False, "other_stations": False}
    missing = tmp_path / "share" / "copy.anchor"
    with running(tmp_path / "data", simulate=False, audit_anchor_copy=missing) as other:
        heads = other.get("/api/audit").json()["heads"]
        assert (heads["copy_file"], heads["elsewhere"]) == (str(missing), [])
        assert heads["failing_since"] is not None
    with other_disk(tmp_path) as disk:
        copy = disk / "copy.anchor"
        with running(tmp_path / "data", simulate=False, audit_anchor_copy=copy, log_format="json") as other:
            trail = other.app.state.services.audit_log  # type: ignore[attr-defined]
            assert trail.until_written() and trail.copy.until_written(10.0)
            heads = other.get("/api/audit").json()["heads"]
        assert (heads["elsewhere"], heads["failing_since"], heads["log"]) == ([str(copy)], None, True)
        assert copy.read_bytes() == (tmp_path / "data" / "audit.anchor").read_bytes()
