"""The database hangs, fails and returns during a treatment: the session continues, and nothing is lost or stored twice."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any
from uuid import UUID, uuid4

import msgspec
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select
from sqlalchemy.orm import Session

from benchmarks import postgresql
from kata.audit.tables import AuditRow
from kata.clinic.contraindications import service as contraindications
from kata.clinic.contraindications.schemas import ContraindicationCreate
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.events.observer import NewDeviceEvent
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.sessions import checks, runs
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.offline_sessions import CheckedRun, OfflineSessions
from kata.clinic.sessions.replay import CHANGED, CHANGED_MEANWHILE
from kata.clinic.sessions.runs import RunRequest
from kata.clinic.sessions.tables import SessionRow
from kata.database.availability import DatabaseUnavailableError
from kata.database.base import utc_now
from kata.device import journal
from kata.errors import ProblemError
from tests.support.open_page import open_page
from tests.support.preflight import WHO, go_through_checklist, still_open
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.service import running
from tests.support.station_api import accepted, load, until, until_mode
from tests.support.visits import eventually, programme

LIMIT_S = 60.0
FEW_S = 8.0
"""Longest wait of the first requests in an outage. Later requests are refused at once."""


@pytest.fixture(scope="module")
def client(server: postgresql.Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    folder = tmp_path_factory.mktemp("kata")
    with running(folder, database_url=server.url) as made:
        made.app.state.folder = folder  # type: ignore[attr-defined]
        yield made


@pytest.fixture(scope="module")
def recorded(client: TestClient) -> list[NewDeviceEvent]:
    """Return a list that collects the device's events as they are stored."""
    app: Any = client.app
    heard: list[NewDeviceEvent] = []
    put = app.state.services.event_spool.spool.put

    def listening(payload: bytes) -> None:
        payload_fields = msgspec.json.decode(payload)
        if payload_fields["type"] == "happened":
            heard.append(msgspec.convert(payload_fields["happening"], NewDeviceEvent))
        put(payload)

    app.state.services.event_spool.spool.put = listening
    return heard


def all_is_there(client: TestClient, recorded: list[NewDeviceEvent], run_id: str) -> dict[str, Any]:
    """Check that every event and sample is stored once and in order, and return the run."""
    app: Any = client.app
    assert app.state.services.event_spool.until_taken(LIMIT_S)
    limit = time.monotonic() + LIMIT_S
    while client.get(f"/api/runs/{run_id}").json()["outcome"] == "loaded":
        assert time.monotonic() < limit
    ids = [event.id for event in recorded]
    assert len(set(ids)) == len(ids) > 3
    with app.state.services.database.read() as session:
        rows = session.scalars(select(DeviceEventRow).where(DeviceEventRow.id.in_(ids))).all()
        assert sorted((row.at, row.code) for row in rows) == sorted((event.at, event.code) for event in recorded)
        (file,) = (app.state.folder / "journal").glob(f"imported/*{run_id}*")
        measured = journal.read(file)
        assert len(runs.samples(session, UUID(run_id))["time_s"]) == len(measured.t_ns) > 50
    run: dict[str, Any] = client.get(f"/api/runs/{run_id}").json()
    return run


def noted(client: TestClient) -> list[str]:
    """Return the commands and outages in the audit trail."""
    app: Any = client.app
    assert app.state.services.audit_log.until_written()
    of = ("approach", "play", "pause", "stop", "database_away")
    with app.state.services.database.read() as session:
        query = select(AuditRow.action).where(AuditRow.action.in_(of), AuditRow.outcome == "done")
        return list(session.scalars(query.order_by(AuditRow.number)))


def test_session_continues_while_the_database_hangs_and_page_shows_it(
    client: TestClient, server: postgresql.Server, recorded: list[NewDeviceEvent]
) -> None:
    until_mode(client, "idle")
    patient = client.post(
        "/api/patients", json={"clinic_number": "O-1", "name": "Mori Ken", "affected_side": "right"}
    ).json()
    run = load(client, patient, taught(client, patient, lifted()), speed_percent=50.0)
    assert client.get("/api/me").status_code == 200
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    # A page stays connected; without one the apparatus would pause.
    with open_page(client), server.hanging():
        began = time.monotonic()
        accepted(client, "pause")
        assert time.monotonic() - began < 3.0
        until_mode(client, "paused")
        accepted(client, "play")

        refused = client.get("/api/patients")
        assert (refused.status_code, refused.json()["code"]) == (503, "database_away")
        assert refused.headers["retry-after"]
        assert time.monotonic() - began < 2 * FEW_S

        began = time.monotonic()
        for path in ("patients", "sessions", f"runs/{run['id']}"):
            away = problem(client.get(f"/api/{path}"), 503, "database_away")
            assert "No data is lost" in away["detail"]
        problem(client.post("/api/sign-in", json={"username": "a", "password": "b"}), 503, "database_away")
        assert time.monotonic() - began < 3.0

        # A reloaded page shows the user, the apparatus and the start of the outage.
        assert client.get("/api/me").json()["name"] == "Test administrator"
        live = until(client, lambda live: live["database"]["unavailable_since"])
        assert live["run"]["run_id"] == run["id"]
        accepted(client, "stop")
        stopped = until(client, lambda live: live["mode"] == "stopped" and live["torque"] == "off")
        assert stopped["database"]["waiting"] > 0
    until(client, lambda live: live["database"] == {"unavailable_since": None, "waiting": 0, "spool_full_since": None})
    assert all_is_there(client, recorded, run["id"])["outcome"] == "stopped"
    # The trail contains the commands during the outage in their order.
    assert noted(client)[-4:] == ["pause", "play", "stop", "database_away"]
    until(client, lambda live: "acknowledge" not in live["refusals"])
    accepted(client, "acknowledge")


def test_run_ended_during_an_outage_exists_after_a_restart(
    client: TestClient, server: postgresql.Server, recorded: list[NewDeviceEvent]
) -> None:
    until_mode(client, "idle")
    patient = client.post(
        "/api/patients", json={"clinic_number": "O-2", "name": "Ota Rin", "affected_side": "right"}
    ).json()
    run = load(client, patient, taught(client, patient, lifted()))
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    with open_page(client), server.killed():
        until(client, lambda live: live["database"]["unavailable_since"])
        accepted(client, "stop")
        until(client, lambda live: live["mode"] == "stopped" and live["torque"] == "off")
        problem(client.post("/api/sessions", json={"patient_id": str(uuid4())}), 503, "database_away")
    until(client, lambda live: live["database"] == {"unavailable_since": None, "waiting": 0, "spool_full_since": None})
    assert all_is_there(client, recorded, run["id"])["outcome"] == "stopped"
    until(client, lambda live: "acknowledge" not in live["refusals"])
    accepted(client, "acknowledge")


THERE = checks.ApparatusState(
    "Station 1", pedal_answers=True, verified_since=datetime(2020, 1, 1, tzinfo=UTC), tested_since_verified=True
)


def open_checks(offline_sessions: OfflineSessions, session_id: str, recording_id: str) -> list[str] | None:
    """Return the unanswered checks like :func:`still_open`, from the offline cache; None while it has none."""
    found = offline_sessions.checklist(UUID(session_id), UUID(recording_id), THERE)
    return None if found is None else [check.need.check for check in found[0] if check.answer is None]


@pytest.fixture
def visit(client: TestClient) -> dict[str, Any]:
    """Return a session with a programme of two recordings with different arm fixers. The first one's checklist is complete."""
    until_mode(client, "idle")
    app: Any = client.app
    body = {"clinic_number": uuid4().hex, "name": "Ueda Kei", "affected_side": "right"}
    patient = client.post("/api/patients", json=body).json()
    first = taught(client, patient, lifted(), fixtures=["arm_fixer_1"])
    second = taught(client, patient, lifted(60.0), fixtures=["arm_fixer_2"])
    version_id = programme(client, patient, first["id"], second["id"])
    planned = {"patient_id": patient["id"], "programme_version_id": version_id}
    session: dict[str, Any] = client.post("/api/sessions", json=planned).json()
    go_through_checklist(client, session["id"], first["id"])
    offline_sessions: OfflineSessions = app.state.services.offline_sessions
    eventually(lambda: open_checks(offline_sessions, session["id"], second["id"]) == ["fixtures"])
    return session | {"first": first, "second": second}


def test_reconnecting_invalidates_the_estop_test_without_the_database_too(
    client: TestClient, visit: dict[str, Any]
) -> None:
    app: Any = client.app
    reconnected = replace(THERE, verified_since=utc_now())

    found = app.state.services.offline_sessions.checklist(UUID(visit["id"]), UUID(visit["first"]["id"]), reconnected)

    assert [check.need.check for check in found[0] if check.answer is None] == ["estop"]


def test_session_continues_its_programme_during_an_outage(
    client: TestClient, server: postgresql.Server, recorded: list[NewDeviceEvent], visit: dict[str, Any]
) -> None:
    second = {
        "session_id": visit["id"],
        "resistance_level": 25,
        "recording_id": visit["second"]["id"],
        "programme_position": 2,
    }
    url = f"/api/sessions/{visit['id']}/checklist/fixtures"
    ticked = {"checked_by": WHO, "recording_id": visit["second"]["id"]}
    with open_page(client), server.killed():
        live = until(client, lambda live: live["database"]["unavailable_since"])
        assert "load" not in live["refusals"]
        assert live["refusals"]["teach"]["code"] == "database_away"

        # The same checks apply as with the database: the other recording needs another arm fixer and has another position.
        assert still_open(client, visit["id"], visit["second"]["id"]) == ["fixtures"]
        problem(client.post("/api/station/load", json=second), 409, "checklist_open")
        problem(client.put(f"{url.removesuffix('fixtures')}pedal", json=ticked), 409, "detected")
        assert client.put(url, json=ticked).status_code == 200
        problem(client.post("/api/station/load", json=second | {"programme_position": 1}), 409, "not_planned")
        problem(
            client.post("/api/station/load", json=second | {"range_percent": 100.0, "speed_percent": 1.0}),
            422,
            "invalid",
        )

        # Records that were not fetched are unknown: they are neither played nor returned.
        unknown = {"session_id": str(uuid4())}, {"recording_id": str(uuid4())}
        for other in unknown:
            problem(client.post("/api/station/load", json=second | other), 503, "database_away")
        elsewhere = f"/api/sessions/{uuid4()}/checklist"
        problem(client.get(elsewhere, params={"recording_id": visit["second"]["id"]}), 503, "database_away")

        run = accepted(client, "load", second)
        assert (run["recording_name"], run["programme_position"], run["outcome"]) == ("Lift", 2, "loaded")
        # A run that the device refuses is not stored in the session.
        assert client.post("/api/station/load", json=second).status_code == 409
        until(
            client, lambda live: live["run"] and live["run"]["patient"] and live["run"]["patient"]["name"] == "Ueda Kei"
        )
        accepted(client, "approach")
        until_mode(client, "paused")
        accepted(client, "play")
        until_mode(client, "idle", within_s=60.0)
    until(client, lambda live: live["database"] == {"unavailable_since": None, "waiting": 0, "spool_full_since": None})
    assert all_is_there(client, recorded, run["id"])["outcome"] == "completed"
    session = client.get(f"/api/sessions/{visit['id']}").json()
    assert [stored["id"] for stored in session["runs"]] == [run["id"]]
    assert still_open(client, visit["id"], visit["second"]["id"]) == []
    events = client.get("/api/events", params={"session_id": visit["id"], "kind": "alarm"}).json()["items"]
    assert CHANGED_MEANWHILE not in [event["code"] for event in events]
    app: Any = client.app
    with app.state.services.database.read() as database:
        noted = database.scalars(select(AuditRow.action).where(AuditRow.subject.endswith(run["id"]))).all()
        assert "begun_without_database" in noted


def test_changes_made_elsewhere_during_an_outage_are_reported(client: TestClient, visit: dict[str, Any]) -> None:
    app: Any = client.app
    offline_sessions: OfflineSessions = app.state.services.offline_sessions
    found = offline_sessions.start_run(
        RunRequest(UUID(visit["id"]), UUID(visit["first"]["id"]), programme_position=1), THERE
    )
    assert found
    with app.state.services.database.write() as database:
        database.get_one(EpisodeRow, UUID(visit["episode_id"])).max_resistance_level = 10
        contraindications.add(database, UUID(visit["patient"]["id"]), ContraindicationCreate(code="fracture"))
    assert app.state.services.event_spool.put_offline_event(found.started, LIMIT_S)
    assert app.state.services.event_spool.until_taken(LIMIT_S)
    run = client.get(f"/api/runs/{found.started.id}").json()
    assert (run["resistance_level"], run["outcome"]) == (25, "loaded")
    events = client.get("/api/events", params={"session_id": visit["id"], "kind": "alarm"}).json()["items"]
    messages = {event["message"] for event in events if event["code"] == CHANGED_MEANWHILE}
    assert messages == {CHANGED["limits"], CHANGED["contraindicated"]}
    app.state.services.event_spool.put_not_begun("run", found.started.id)
    assert app.state.services.event_spool.until_taken(LIMIT_S)
    assert client.get(f"/api/runs/{found.started.id}").status_code == 404


def test_a_contraindication_forbids_a_run_without_the_database_too(client: TestClient, visit: dict[str, Any]) -> None:
    app: Any = client.app
    patient_id = UUID(visit["patient"]["id"])
    request = RunRequest(UUID(visit["id"]), UUID(visit["first"]["id"]), programme_position=1)
    with app.state.services.database.write() as database:
        contraindications.add(database, patient_id, ContraindicationCreate(code="pacemaker"))
    offline_cache = OfflineCache(app.state.services.database, "Station 1")
    offline_cache.attend(patient_id, UUID(visit["id"]))
    offline_cache.refresh()
    known = offline_cache.find_patient(patient_id)
    assert known
    assert [contraindication.code for contraindication in known.banner.contraindications] == ["pacemaker"]
    with pytest.raises(ProblemError) as refused:
        OfflineSessions(offline_cache, "Station 1").start_run(request, THERE)
    assert refused.value.code == "sign_off_needed"


def test_nothing_of_a_restricted_patient_is_fetched_ahead(client: TestClient, visit: dict[str, Any]) -> None:
    app: Any = client.app
    with app.state.services.database.write() as database:
        database.get_one(SessionRow, UUID(visit["id"])).patient.restricted = True
    offline_cache = OfflineCache(app.state.services.database, "Station 1")
    offline_cache.attend(UUID(visit["patient"]["id"]), UUID(visit["id"]))
    offline_cache.refresh()
    assert OfflineSessions(offline_cache, "Station 1").session(UUID(visit["id"])) is None
    assert not offline_cache.holds(UUID(visit["patient"]["id"]))


def test_programme_time_continues_during_an_outage(
    client: TestClient, visit: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    app: Any = client.app
    with app.state.services.database.write() as database:
        database.get_one(SessionRow, UUID(visit["id"])).programme_version.timer_minutes = 2.0
    offline_cache = OfflineCache(app.state.services.database, "Station 1")
    offline_cache.attend(UUID(visit["patient"]["id"]), UUID(visit["id"]))
    offline_cache.refresh()
    offline_sessions = OfflineSessions(offline_cache, "Station 1")

    def begin(position: int | None) -> CheckedRun | None:
        request = RunRequest(UUID(visit["id"]), UUID(visit["first"]["id"]), programme_position=position)
        return offline_sessions.start_run(request, THERE)

    assert begin(1)
    now_s = time.monotonic()
    # Only the clock of this module: the service of the other tests is running in this process.
    monkeypatch.setattr("kata.clinic.sessions.offline_sessions.time", SimpleNamespace(monotonic=lambda: now_s + 121.0))
    with pytest.raises(ProblemError) as caught:
        begin(1)
    assert caught.value.code == "timer_over"
    # The recording may be played outside the programme, as with the database.
    assert begin(None)


def test_recorded_run_loads_although_the_database_is_lost_afterwards(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise the run would never end, and the session could not be ended."""
    until_mode(client, "idle")
    patient = client.post(
        "/api/patients", json={"clinic_number": "O-3", "name": "Abe Nao", "affected_side": "right"}
    ).json()
    recording = taught(client, patient, lifted())
    began: list[object] = []
    begin, read = runs.begin, client.app.state.services.database.read  # type: ignore[attr-defined]

    def beginning(*args: Any, **given: Any) -> Any:
        began.append(None)
        return begin(*args, **given)

    @contextmanager
    def reading() -> Iterator[Session]:
        if began:
            raise DatabaseUnavailableError(utc_now())
        with read() as session:
            yield session

    with monkeypatch.context() as lost:
        lost.setattr(runs, "begin", beginning)
        lost.setattr(client.app.state.services.database, "read", reading)  # type: ignore[attr-defined]
        run = load(client, patient, recording)
    live = until_mode(client, "ready")
    assert live["run"]["run_id"] == run["id"]
    accepted(client, "unload")
