"""A session of a patient of this day begins during a database outage, and is stored once, completely and in order afterwards."""

import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import UUID, uuid4

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from benchmarks import postgresql
from kata.audit.tables import AuditRow
from kata.clinic.events.observer import ESTOP_TESTED, NewDeviceEvent
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.patients.tables import PatientRow
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.sessions import checks, runs, service
from kata.clinic.sessions import offline_cache as offline_cache_module
from kata.clinic.sessions.offline_cache import OfflineCache
from kata.clinic.sessions.replay import (
    CHANGED,
    CHANGED_MEANWHILE,
    PAIN_DIFFERS,
    Change,
    OfflineEvent,
    PainRecorded,
    SessionClosed,
    SessionOpened,
)
from kata.clinic.sessions.tables import SessionRow
from kata.database.base import utc_now
from kata.device import journal
from tests.support.login import signed_in
from tests.support.open_page import open_page
from tests.support.preflight import BY_HAND, WHO, confirmation, still_open, try_estop
from tests.support.recordings import lifted, taught
from tests.support.responses import problem
from tests.support.service import running
from tests.support.station_api import accepted, until, until_mode
from tests.support.visits import eventually

LIMIT_S = 60.0
THERE = checks.ApparatusState(
    "Station 1", pedal_answers=True, verified_since=datetime(2020, 1, 1, tzinfo=UTC), tested_since_verified=True
)


@pytest.fixture(scope="module")
def client(server: postgresql.Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    folder = tmp_path_factory.mktemp("kata")
    with running(folder, database_url=server.url) as made:
        made.app.state.folder = folder  # type: ignore[attr-defined]
        until_mode(made, "idle")
        try_estop(made)
        yield made


@pytest.fixture
def offline_cache(client: TestClient) -> OfflineCache:
    app: Any = client.app
    answer: OfflineCache = app.state.services.offline_cache
    return answer


def of_today(client: TestClient, name: str) -> dict[str, Any]:
    """Return a patient with a programme of two recordings and no session, whose record was just opened at this station."""
    body = {"clinic_number": uuid4().hex, "name": name, "affected_side": "right"}
    patient: dict[str, Any] = client.post("/api/patients", json=body).json()
    first = taught(client, patient, lifted(), fixtures=["arm_fixer_1"])
    second = taught(client, patient, lifted(60.0), fixtures=["arm_fixer_1"])
    items = [
        {"resistance_level": 25, "recording_id": recording["id"], "speed_percent": 150.0}
        for recording in (first, second)
    ]
    made = client.post(f"/api/patients/{patient['id']}/programmes", json={"name": "Morning", "items": items})
    assert made.status_code == 201, made.text
    return patient | {"first": first, "second": second, "programme": made.json()}


def version_of(patient: dict[str, Any]) -> str:
    version_id: str = patient["programme"]["current"]["id"]
    return version_id


def wanted(patient: dict[str, Any]) -> dict[str, Any]:
    return {"patient_id": patient["id"], "therapist": WHO, "programme_version_id": version_of(patient)}


def ready(client: TestClient) -> list[str]:
    return [item["patient"]["id"] for item in client.get("/api/station/ready-patients").json()["items"]]


def all_arrived(client: TestClient) -> None:
    until(
        client,
        lambda live: live["database"] == {"unavailable_since": None, "waiting": 0, "spool_full_since": None},
        LIMIT_S,
    )
    app: Any = client.app
    assert app.state.services.event_spool.until_taken(LIMIT_S)


def alarms(client: TestClient, session_id: str) -> list[str]:
    items = client.get("/api/events", params={"session_id": session_id, "kind": "alarm"}).json()["items"]
    return [item["message"] for item in items if item["code"] == CHANGED_MEANWHILE]


def play(client: TestClient, session_id: str, recording_id: str, position: int) -> dict[str, Any]:
    what = {
        "session_id": session_id,
        "resistance_level": 25,
        "recording_id": recording_id,
        "programme_position": position,
    }
    run = accepted(client, "load", what | {"speed_percent": 150.0})
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    until_mode(client, "idle", within_s=60.0)
    return run


def test_session_runs_during_an_outage_and_is_stored_once(
    client: TestClient,
    server: postgresql.Server,
    offline_cache: OfflineCache,
) -> None:
    patient = of_today(client, "Kondo Emi")
    eventually(lambda: offline_cache.holds(UUID(patient["id"])))
    # While the database answers, the list of ready patients is empty.
    assert ready(client) == []

    with open_page(client), server.killed():
        live = until(client, lambda live: live["database"]["unavailable_since"])
        assert live["refusals"]["load"]["code"] == "database_away"
        (answer,) = [
            item
            for item in client.get("/api/station/ready-patients").json()["items"]
            if item["patient"]["id"] == patient["id"]
        ]
        assert (answer["patient"]["name"], answer["side"], answer["session"]) == ("Kondo Emi", "right", None)
        assert answer["programme"]["version_id"] == version_of(patient)

        # No session begins with another programme or none, or for an unknown patient.
        for other in ({"programme_version_id": str(uuid4())}, {"programme_version_id": None}):
            problem(client.post("/api/sessions", json=wanted(patient) | other), 503, "database_away")
        problem(client.post("/api/sessions", json=wanted(patient) | {"patient_id": str(uuid4())}), 503, "database_away")

        begun = client.post("/api/sessions", json=wanted(patient))
        assert begun.status_code == 201, begun.text
        visit = begun.json()
        assert (visit["therapist"], visit["station"], visit["runs"]) == (WHO, "Station 1", [])
        # A repeated request continues the same session.
        assert client.post("/api/sessions", json=wanted(patient)).json()["id"] == visit["id"]
        until(client, lambda live: "load" not in live["refusals"])
        url, first = f"/api/sessions/{visit['id']}", patient["first"]["id"]

        # The same checks apply as with the database.
        load = {
            "session_id": visit["id"],
            "resistance_level": 25,
            "recording_id": first,
            "programme_position": 1,
            "speed_percent": 150.0,
        }
        assert still_open(client, visit["id"], first) == BY_HAND
        problem(client.post("/api/station/load", json=load), 409, "identity_not_confirmed")
        one_only = confirmation("identity", first) | {"identifiers": ["name"]}
        problem(client.put(f"{url}/checklist/identity", json=one_only), 422, "two_identifiers_needed")
        for check in BY_HAND:
            ticked = client.put(f"{url}/checklist/{check}", json=confirmation(check, first))
            assert ticked.status_code == 200, ticked.text
        problem(client.post("/api/station/load", json=load | {"programme_position": 2}), 409, "not_planned")

        said = client.patch(url, json={"pain_before": 4, "updated_at": visit["updated_at"]})
        assert (said.status_code, said.json()["pain_before"]) == (200, 4)
        problem(client.patch(url, json={"pain_before": 5, "updated_at": visit["updated_at"]}), 409, "edited_meanwhile")
        problem(client.patch(url, json={"note": "Well."}), 503, "database_away")

        run = play(client, visit["id"], first, 1)
        eventually(lambda: client.get(url).json()["runs"][0]["outcome"] == "completed")
        second = play(client, visit["id"], patient["second"]["id"], 2)
        eventually(lambda: client.get(url).json()["runs"][1]["outcome"] == "completed")

        assert client.patch(url, json={"pain_during": 5, "pain_after": 3}).status_code == 200
        ended = client.post(f"{url}/end", json={"reason": "completed"}).json()
        assert ended["ended_at"] and ended["end_reason"] == "completed"
        # The first end of a session stays.
        assert client.post(f"{url}/end", json={"reason": "other"}).json()["ended_at"] == ended["ended_at"]
        problem(client.post("/api/station/load", json=load), 409, "session_ended")
        problem(client.post(f"{url}/sign", json={"note": "Well."}), 503, "database_away")

    # A request right after the outage waits until all records of the session have arrived.
    until(client, lambda live: live["database"]["unavailable_since"] is None)
    assert client.get(url).json()["pain_after"] == 3
    all_arrived(client)
    found = client.get(f"/api/patients/{patient['id']}/sessions").json()["items"]
    assert [session["id"] for session in found] == [visit["id"]]
    eventually(lambda: all(run["comparison"] for run in client.get(url).json()["runs"]))
    there = client.get(url).json()
    assert [stored["id"] for stored in there["runs"]] == [run["id"], second["id"]]
    kept = ("pain_before", "pain_during", "pain_after", "end_reason", "therapist", "station", "started_at", "ended_at")
    assert {name: there[name] for name in kept} == {name: ended[name] for name in kept}
    assert [check["check"] for check in there["checks"]] == [*BY_HAND, "pedal", "estop"]
    assert there["programme"]["version_id"] == version_of(patient)
    assert alarms(client, visit["id"]) == []
    app: Any = client.app
    with app.state.services.database.read() as session:
        for played in (run, second):
            (file,) = (app.state.folder / "journal").glob(f"imported/*{played['id']}*")
            assert len(runs.samples(session, UUID(played["id"]))["time_s"]) == len(journal.read(file).t_ns) > 50
        count = select(AuditRow.action, func.count()).where(AuditRow.subject.endswith(visit["id"])).group_by("action")
        noted = dict(session.execute(count).all())
        assert noted["opened_without_database"] == noted["ended_without_database"] == 1
        assert noted["ticked_without_database"] == 6
        identified = select(AuditRow.detail).where(AuditRow.subject == f"session {visit['id']}")
        assert any("clinic_number+name" in detail for detail in session.scalars(identified))
        assert noted["pain_without_database"] == 3
        row = session.get_one(SessionRow, UUID(visit["id"]))
        assert row.run_count == 2


def test_outage_session_is_refused_beyond_cached_patients_or_limits(
    client: TestClient,
    server: postgresql.Server,
    offline_cache: OfflineCache,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app: Any = client.app
    one = of_today(client, "Abe Jun")
    hidden = of_today(client, "Baba Ryo")
    closed = of_today(client, "Chiba Sho")
    viewer = signed_in(app.state.services.database, "viewer")
    with app.state.services.database.write() as session:
        session.get_one(PatientRow, UUID(hidden["id"])).restricted = True
        session.get_one(PatientRow, UUID(closed["id"])).episodes[0].closed_at = utc_now()
        session.get_one(PatientRow, UUID(one["id"])).episodes[0].max_resistance_level = 10
    offline_cache.refresh_soon()
    eventually(lambda: offline_cache.holds(UUID(one["id"])) and not offline_cache.holds(UUID(hidden["id"])))
    eventually(lambda: not offline_cache.holds(UUID(closed["id"])))
    cookies = dict(client.cookies)
    client.cookies.set(next(iter(cookies)), viewer)
    assert client.get("/api/station").status_code == 200
    client.cookies.set(*next(iter(cookies.items())))

    with open_page(client), server.killed():
        until(client, lambda live: live["database"]["unavailable_since"])
        assert one["id"] in ready(client)
        assert not {hidden["id"], closed["id"]} & set(ready(client))
        for other in (hidden, closed):
            problem(client.post("/api/sessions", json=wanted(other)), 503, "database_away")

        # A user who may only read cannot begin a session.
        client.cookies.set(next(iter(cookies)), viewer)
        problem(client.post("/api/sessions", json=wanted(one)), 403, "not_allowed")
        client.cookies.set(*next(iter(cookies.items())))

        # On the next day the cache has no patients of this day.
        today = checks.today(UTC)
        with monkeypatch.context() as tomorrow:
            tomorrow.setattr(checks, "today", lambda _: today + timedelta(days=1))
            assert ready(client) == []
            problem(client.post("/api/sessions", json=wanted(one)), 503, "database_away")
        # Data that was fetched long before the outage is not used.
        with monkeypatch.context() as strict:
            strict.setattr(offline_cache_module, "_MAX_AGE", timedelta(0))
            assert ready(client) == []

        visit = client.post("/api/sessions", json=wanted(one)).json()
        first = one["first"]["id"]
        for check in BY_HAND:
            client.put(f"/api/sessions/{visit['id']}/checklist/{check}", json=confirmation(check, first))
        load = {"session_id": visit["id"], "resistance_level": 25, "recording_id": first, "programme_position": 1}
        problem(client.post("/api/station/load", json=load | {"resistance_level": 25}), 422, "level_not_allowed")
        # Records of another patient are refused.
        problem(client.post("/api/station/load", json=load | {"recording_id": str(uuid4())}), 503, "database_away")
        # On the next day identity and emergency stop are checked again.
        with monkeypatch.context() as tomorrow:
            tomorrow.setattr(checks, "today", lambda _: today + timedelta(days=1))
            tomorrow.setattr(offline_cache, "may_begin", lambda known: True)
            problem(
                client.post("/api/station/load", json=load | {"resistance_level": 10}), 409, "identity_not_confirmed"
            )
            assert still_open(client, visit["id"], first) == ["identity", "estop"]
            # A test of the emergency stop during the outage counts, too.
            tomorrow_at = today + timedelta(days=1)
            tomorrow.setattr(checks, "utc_now", lambda: tomorrow_at)
            # At the end of this block, today's test is the newest again.
            tomorrow.setattr(offline_cache, "estop_tested_at", offline_cache.estop_tested_at)
            tried = NewDeviceEvent(station="Station 1", at=tomorrow_at, kind="event", code=ESTOP_TESTED, message="")
            offline_cache.on_event(tried)
            assert "estop" not in still_open(client, visit["id"], first)
        assert accepted(client, "load", load | {"resistance_level": 10})["resistance_level"] == 10
        # The session can end after the loaded run has ended.
        problem(client.post(f"/api/sessions/{visit['id']}/end"), 409, "run_not_ended")
        accepted(client, "unload")
        until_mode(client, "idle")
    all_arrived(client)
    assert client.get(f"/api/sessions/{visit['id']}").json()["ended_at"] is None


def _another(session: Session, patient: dict[str, Any]) -> None:
    session.add(service.new(uuid4(), UUID(patient["id"]), None, "Station 2", utc_now()))


def _programme(session: Session, patient: dict[str, Any]) -> None:
    session.get_one(ProgrammeRow, UUID(patient["programme"]["id"])).archived_at = utc_now()


def _care_closed(session: Session, patient: dict[str, Any]) -> None:
    session.get_one(PatientRow, UUID(patient["id"])).episodes[0].closed_at = utc_now()


def _patient_archived(session: Session, patient: dict[str, Any]) -> None:
    session.get_one(PatientRow, UUID(patient["id"])).archived_at = utc_now()


def _restricted(session: Session, patient: dict[str, Any]) -> None:
    session.get_one(PatientRow, UUID(patient["id"])).restricted = True


def _nothing(session: Session, patient: dict[str, Any]) -> None:
    """Change nothing."""


def put(client: TestClient, *done: OfflineEvent) -> None:
    """Deliver a record to the database."""
    app: Any = client.app
    for record in done:
        assert app.state.services.event_spool.put_offline_event(record, LIMIT_S)
    assert app.state.services.event_spool.until_taken(LIMIT_S)


def begun_away(client: TestClient, patient: dict[str, Any]) -> SessionOpened:
    episode = client.get(f"/api/patients/{patient['id']}/episodes").json()["items"][0]
    of = (UUID(patient["id"]), UUID(episode["id"]), UUID(version_of(patient)))
    return SessionOpened(uuid4(), *of, WHO, "Station 1", utc_now())


@pytest.mark.parametrize(
    ("change", "conflicts"),
    [
        (_another, ["another"]),
        (_restricted, ["restricted"]),
        *(
            pytest.param(change, conflicts, marks=pytest.mark.campaign)
            for change, conflicts in (
                (_programme, ["programme"]),
                (_care_closed, ["care_closed"]),
                (_patient_archived, ["patient_archived"]),
                (_nothing, []),
            )
        ),
    ],
)
def test_conflicting_change_elsewhere_becomes_an_alarm_of_the_session(
    client: TestClient, change: Callable[[Session, dict[str, Any]], None], conflicts: list[Change]
) -> None:
    app: Any = client.app
    patient = of_today(client, "Doi Kana")
    opened = begun_away(client, patient)
    with app.state.services.database.write() as session:
        change(session, patient)
    put(client, opened)
    with app.state.services.database.read() as session:
        row = session.get_one(SessionRow, opened.id)
        assert (row.therapist, row.station, row.started_at) == (WHO, "Station 1", opened.started_at)
        rows = select(DeviceEventRow.message).where(DeviceEventRow.session_id == opened.id)
        assert list(session.scalars(rows)) == [CHANGED[conflict] for conflict in conflicts]
    # The record is delivered twice, as after a restored folder or a lost answer to a commit.
    put(client, opened)
    with app.state.services.database.read() as session:
        assert len(list(session.scalars(rows))) == len(conflicts)


def test_pain_and_end_recorded_elsewhere_stay_and_conflicts_are_reported(client: TestClient) -> None:
    patient = of_today(client, "Endo Yui")
    opened = begun_away(client, patient)
    put(client, opened)
    url = f"/api/sessions/{opened.id}"
    put(client, PainRecorded(opened.id, "pain_before", 4, None, utc_now(), "Station 1"))
    assert client.get(url).json()["pain_before"] == 4
    client.patch(url, json={"pain_before": 7, "pain_after": 2})
    put(
        client,
        PainRecorded(opened.id, "pain_before", 3, 4, utc_now(), "Station 1"),
        # The same change twice is no conflict.
        PainRecorded(opened.id, "pain_after", 2, None, utc_now(), "Station 1"),
    )
    there = client.get(url).json()
    assert (there["pain_before"], there["pain_after"]) == (7, 2)
    assert alarms(client, str(opened.id)) == [PAIN_DIFFERS["pain_before"](pain=3)]
    client.post(f"{url}/end", json={"reason": "shortened"})
    put(client, SessionClosed(opened.id, "completed", utc_now(), "Station 1"))
    assert client.get(url).json()["end_reason"] == "shortened"
    assert CHANGED["ended_already"] in alarms(client, str(opened.id))


def test_session_that_cannot_be_saved_to_disk_does_not_begin(
    client: TestClient,
    offline_cache: OfflineCache,
    server: postgresql.Server,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app: Any = client.app
    patient = of_today(client, "Fujita Go")
    eventually(lambda: offline_cache.holds(UUID(patient["id"])))
    with open_page(client), server.killed():
        until(client, lambda live: live["database"]["unavailable_since"])
        with monkeypatch.context() as full:
            full.setattr(app.state.services.event_spool.spool, "until_written", lambda limit_s: False)
            problem(client.post("/api/sessions", json=wanted(patient)), 503, "database_away")
        (answer,) = [
            item
            for item in client.get("/api/station/ready-patients").json()["items"]
            if item["patient"]["id"] == patient["id"]
        ]
        assert answer["session"] is None
    all_arrived(client)
    assert client.get(f"/api/patients/{patient['id']}/sessions").json()["items"] == []


def test_only_twenty_patients_are_cached_including_the_one_being_treated(client: TestClient) -> None:
    app: Any = client.app
    patient = of_today(client, "Goto Mao")
    held = OfflineCache(app.state.services.database, "Station 1")
    held.attend(UUID(patient["id"]), None)
    began = time.monotonic()
    for _ in range(30):
        held.note_opened(uuid4())
    assert len(held._opened) == 20
    assert time.monotonic() - began < 1.0
    held.refresh()
    assert held.holds(UUID(patient["id"]))
