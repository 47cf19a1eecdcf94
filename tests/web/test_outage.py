"""The database hangs, dies and comes back while somebody is treated: the session goes on, and nothing is lost or doubled."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from uuid import UUID

import msgspec
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select
from sqlalchemy.orm import Session

from kata.access.tables import AuditRow
from kata.bench import postgresql
from kata.clinic.events.observer import Happening
from kata.clinic.events.tables import DeviceEventRow
from kata.clinic.sessions import runs
from kata.database.away import DatabaseAwayError
from kata.database.base import utc_now
from kata.device import journal
from tests.web.conftest import running
from tests.web.test_derived import lifted, taught
from tests.web.test_records import problem
from tests.web.test_station import accepted, load, until, until_mode

LIMIT_S = 60.0
FEW_S = 8.0
"""So long the first who ask may wait until they are told; everybody after them is told at once."""


@pytest.fixture(scope="module")
def server() -> Iterator[postgresql.Server]:
    try:
        with postgresql.serving() as url:
            yield postgresql.Server(url)
    except postgresql.MissingError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def client(server: postgresql.Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    folder = tmp_path_factory.mktemp("kata")
    with running(folder, database_url=server.url) as made:
        made.app.state.folder = folder  # type: ignore[attr-defined]
        yield made


@pytest.fixture(scope="module")
def told(client: TestClient) -> list[Happening]:
    """What the device tells from now on, as it is put down."""
    app: Any = client.app
    heard: list[Happening] = []
    put = app.state.kept.spool.put

    def listening(payload: bytes) -> None:
        kept = msgspec.json.decode(payload)
        if kept["type"] == "happened":
            heard.append(msgspec.convert(kept["happening"], Happening))
        put(payload)

    app.state.kept.spool.put = listening
    return heard


def all_is_there(client: TestClient, told: list[Happening], run_id: str) -> dict[str, Any]:
    """Every event once and in order, every sample of the run once; the run itself."""
    app: Any = client.app
    assert app.state.kept.until_taken(LIMIT_S)
    limit = time.monotonic() + LIMIT_S
    while client.get(f"/api/runs/{run_id}").json()["outcome"] == "loaded":
        assert time.monotonic() < limit
    ids = [one.id for one in told]
    assert len(set(ids)) == len(ids) > 3
    with app.state.database.read() as session:
        rows = session.scalars(select(DeviceEventRow).where(DeviceEventRow.id.in_(ids))).all()
        assert sorted((row.at, row.code) for row in rows) == sorted((one.at, one.code) for one in told)
        (file,) = (app.state.folder / "journal").glob(f"imported/*{run_id}*")
        measured = journal.read(file)
        assert len(runs.samples(session, UUID(run_id))["time_s"]) == len(measured.t_ns) > 50
    run: dict[str, Any] = client.get(f"/api/runs/{run_id}").json()
    return run


def noted(client: TestClient) -> list[str]:
    """What was pressed and what became of the database, as the audit trail has it."""
    app: Any = client.app
    assert app.state.trail.until_written()
    of = ("approach", "play", "pause", "stop", "database_away")
    with app.state.database.read() as session:
        query = select(AuditRow.action).where(AuditRow.action.in_(of), AuditRow.outcome == "done")
        return list(session.scalars(query.order_by(AuditRow.number)))


def test_a_session_goes_on_while_the_database_hangs_and_the_page_says_so(
    client: TestClient, server: postgresql.Server, told: list[Happening]
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
    # A page is there all the time, or the apparatus would be paused for want of one.
    with client.websocket_connect("/api/live"), server.hanging():
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
            assert "nothing of it is lost" in away["detail"]
        problem(client.post("/api/sign-in", json={"username": "a", "password": "b"}), 503, "database_away")
        assert time.monotonic() - began < 3.0

        # A page that is loaded anew shows who one is, the apparatus and since when.
        assert client.get("/api/me").json()["name"] == "Test administrator"
        live = until(client, lambda live: live["kept"]["away_since"])
        assert live["run"]["run_id"] == run["id"]
        accepted(client, "stop")
        stopped = until(client, lambda live: live["mode"] == "stopped" and not live["torque_on"])
        assert stopped["kept"]["waiting"] > 0
    until(client, lambda live: live["kept"] == {"away_since": None, "waiting": 0, "not_kept_since": None})
    assert all_is_there(client, told, run["id"])["outcome"] == "stopped"
    # Who pressed what meanwhile is in the trail, in the order in which it was pressed.
    assert noted(client)[-4:] == ["pause", "play", "stop", "database_away"]
    until(client, lambda live: "acknowledge" not in live["refusals"])
    accepted(client, "acknowledge")


def test_a_run_that_ends_while_the_database_is_dead_is_there_when_it_has_been_started_again(
    client: TestClient, server: postgresql.Server, told: list[Happening]
) -> None:
    until_mode(client, "idle")
    patient = client.post(
        "/api/patients", json={"clinic_number": "O-2", "name": "Ota Rin", "affected_side": "right"}
    ).json()
    run = load(client, patient, taught(client, patient, lifted()))
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    with client.websocket_connect("/api/live"), server.killed():
        until(client, lambda live: live["kept"]["away_since"])
        accepted(client, "stop")
        until(client, lambda live: live["mode"] == "stopped" and not live["torque_on"])
        problem(client.post("/api/sessions", json={"patient_id": patient["id"]}), 503, "database_away")
    until(client, lambda live: live["kept"] == {"away_since": None, "waiting": 0, "not_kept_since": None})
    assert all_is_there(client, told, run["id"])["outcome"] == "stopped"


def test_a_run_that_was_written_down_is_loaded_although_the_database_is_lost_right_after(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else it would stand in the session for ever, and the session could not be ended."""
    until_mode(client, "idle")
    patient = client.post(
        "/api/patients", json={"clinic_number": "O-3", "name": "Abe Nao", "affected_side": "right"}
    ).json()
    recording = taught(client, patient, lifted())
    began: list[object] = []
    begin, read = runs.begin, client.app.state.database.read  # type: ignore[attr-defined]

    def beginning(*args: Any, **given: Any) -> Any:
        began.append(None)
        return begin(*args, **given)

    @contextmanager
    def reading() -> Iterator[Session]:
        if began:
            raise DatabaseAwayError(utc_now())
        with read() as session:
            yield session

    with monkeypatch.context() as lost:
        lost.setattr(runs, "begin", beginning)
        lost.setattr(client.app.state.database, "read", reading)  # type: ignore[attr-defined]
        run = load(client, patient, recording)
    live = until_mode(client, "ready")
    assert live["run"]["run_id"] == run["id"]
    accepted(client, "unload")
