"""The fleet: two services on one PostgreSQL database, and the redaction of other stations' patients."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final
from uuid import UUID, uuid4

import psycopg
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import text, update

from kata.actor import Role
from kata.api.fleet import Fleet
from kata.auth.login_session import COOKIE
from kata.clinic.patients.tables import PatientRow
from kata.database.engine import Database
from kata.device.config import StationConfig
from kata.station.device_process import DeviceLaunch
from kata.station.fleet import StationStatus, state_of
from kata.station.schemas import Live, PatientRef
from kata.station.station import Station
from tests.support.login import signed_in
from tests.support.service import running

_LIMIT_S: Final = 60.0


class Acted(Station):
    """A station without an apparatus, controlled by the test."""

    def __init__(self, name: str) -> None:
        launch = DeviceLaunch(Path("/nowhere"), Path("/nowhere"), real_time=False)
        super().__init__(StationConfig(name=name), launch, simulated=True, on_journal=lambda path: None)
        self._acted = super().live().model_copy(update={"device": "running", "mode": "idle", "estop": "closed"})

    def live(self) -> Live:
        return self._acted

    def act(self, **changes: Any) -> None:
        self._acted = self._acted.model_copy(update=changes)
        self._subscriptions.note_change()


def overview_of(name: str, database: Database) -> tuple[Acted, Fleet]:
    station = Acted(name)
    return station, Fleet(station, database, list)


async def until(fleet: Fleet, wanted: Callable[[dict[str, StationStatus]], object]) -> dict[str, StationStatus]:
    """Wait until the condition holds, and return the stations by name."""
    async with asyncio.timeout(_LIMIT_S):
        while True:
            shown = {status.name: status for status in fleet.statuses()}
            if wanted(shown):
                return shown
            await fleet.wait_for_change(0.1)


def known(shown: dict[str, StationStatus], *names: str) -> bool:
    return all(name in shown and shown[name].state for name in names)


@asynccontextmanager
async def two(url: str) -> AsyncIterator[tuple[Fleet, Acted, Fleet]]:
    """Run two services on one database that receive each other's state. Return the first's fleet, and the second's apparatus and fleet."""
    databases = Database(url), Database(url)
    _, first = overview_of("Station 1", databases[0])
    station, second = overview_of("Station 2", databases[1])
    try:
        async with first.exchange_states(), second.exchange_states():
            for fleet in (first, second):
                await until(fleet, lambda shown: known(shown, "Station 1", "Station 2"))
            yield first, station, second
    finally:
        for database in databases:
            database.close()


def test_each_service_lists_both_stations_and_itself_first(postgresql_url: str) -> None:
    async def look() -> None:
        async with two(postgresql_url) as (first, _, second):
            assert [(status.name, status.here) for status in first.statuses()] == [
                ("Station 1", True),
                ("Station 2", False),
            ]
            assert [(status.name, status.here) for status in second.statuses()] == [
                ("Station 2", True),
                ("Station 1", False),
            ]

    asyncio.run(look())


def test_event_at_one_station_appears_at_the_other(postgresql_url: str) -> None:
    async def look() -> None:
        async with two(postgresql_url) as (first, station, _):
            station.act(estop="pressed", mode="stopped")

            def pressed(shown: dict[str, StationStatus]) -> object:
                state = shown["Station 2"].state
                return state and (state.estop, state.mode) == ("pressed", "stopped")

            shown = await until(first, pressed)
            assert shown["Station 1"].state
            assert shown["Station 1"].state.estop == "closed"

    asyncio.run(look())


def test_lost_listener_reconnects_and_own_station_stays_known(postgresql_url: str) -> None:
    ended = "SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE application_name = 'kata fleet'"

    async def look() -> None:
        async with two(postgresql_url) as (first, station, _):
            with first.database.read() as session:
                assert session.execute(text(ended)).scalar_one() == 4, (
                    "each service has one connection to send and one to listen"
                )
            station.act(estop="pressed")
            assert known({status.name: status for status in first.statuses()}, "Station 1")
            await until(
                first,
                lambda shown: known(shown, "Station 2") and shown["Station 2"].state.estop == "pressed",  # type: ignore[union-attr]
            )

    asyncio.run(look())


def test_station_of_an_ended_service_becomes_silent(postgresql_url: str) -> None:
    async def look() -> None:
        databases = Database(postgresql_url), Database(postgresql_url)
        _, first = overview_of("Station 1", databases[0])
        _, second = overview_of("Station 2", databases[1])
        async with first.exchange_states():
            async with second.exchange_states():
                await until(first, lambda shown: known(shown, "Station 2"))
            shown = await until(first, lambda shown: shown["Station 2"].silent)
            assert (shown["Station 2"].state, shown["Station 2"].heard_at is None) == (None, False)
            assert shown["Station 1"].silent is False
        for database in databases:
            database.close()

    asyncio.run(look())


@pytest.mark.parametrize("turns", range(6))
def test_listener_can_be_cancelled_while_a_message_arrives(turns: int, tmp_path: Path) -> None:
    """Cancellation works at every turn of the event loop. Otherwise a listener would outlive its login session."""

    async def listen(fleet: Fleet) -> None:
        while True:
            await fleet.wait_for_change(_LIMIT_S)

    async def look() -> None:
        station, fleet = overview_of("Station 1", Database(f"sqlite:///{tmp_path / 'kata.db'}"))
        listening = asyncio.create_task(listen(fleet))
        await asyncio.sleep(0.01)
        fleet.take(state_of(station.info, station.live(), fleet.service))
        for _ in range(turns):
            await asyncio.sleep(0)
        listening.cancel()
        done, _ = await asyncio.wait({listening}, timeout=5.0)
        fleet.database.close()
        assert done
        assert listening.cancelled()

    asyncio.run(look())


@pytest.mark.parametrize("turns", range(6))
def test_service_ends_while_its_connection_is_being_made(
    turns: int, postgresql_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The end works at every turn of the event loop. Otherwise the service would never end."""

    async def look() -> None:
        database = Database(postgresql_url)
        made = asyncio.Event()
        connect = psycopg.AsyncConnection.connect

        async def connect_then(*given: Any, **named: Any) -> Any:
            connection = await connect(*given, **named)
            try:
                await made.wait()
            except asyncio.CancelledError:
                # Like the library's own connection: no other task has a reference to it.
                await connection.close()
                raise
            return connection

        monkeypatch.setattr(psycopg.AsyncConnection, "connect", connect_then)
        _, fleet = overview_of("Station 1", database)
        async with asyncio.timeout(_LIMIT_S):
            async with fleet.exchange_states():
                await until(fleet, lambda shown: known(shown, "Station 1"))
                await connected(database, 2)
                made.set()
                for _ in range(turns):
                    await asyncio.sleep(0)
            await connected(database, 0)
        database.close()

    asyncio.run(look())


async def connected(database: Database, wanted: int) -> None:
    """Wait until the server counts this many connections of fleets."""
    count = "SELECT count(*) FROM pg_stat_activity WHERE application_name = 'kata fleet' AND state IS NOT NULL"
    while True:
        with database.read() as session:
            if session.execute(text(count)).scalar_one() == wanted:
                return
        await asyncio.sleep(0.01)


# -- states that a browser receives ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Return a service on SQLite without an apparatus."""
    with running(tmp_path_factory.mktemp("stations"), simulate=False) as client:
        yield client


def seen_by(service: TestClient, role: Role) -> dict[str, Any]:
    """Return the stations that this role receives by WebSocket, and check that the list is the same."""
    app: Any = service.app
    browser = TestClient(service.app)
    browser.cookies.set(COOKIE, signed_in(app.state.services.database, role))
    listed = {item["shown"]["name"]: item["shown"] for item in browser.get("/api/stations").json()["items"]}
    with browser.websocket_connect("/api/stations/live") as socket:
        answer = {station["name"]: station for station in socket.receive_json()["stations"]}
    assert answer.keys() == listed.keys()
    for name, status in answer.items():
        assert (status["state"] or {}).get("patient") == (listed[name]["state"] or {}).get("patient")
    return answer


def test_sqlite_has_one_station_with_its_configuration(service: TestClient) -> None:
    (item,) = service.get("/api/stations").json()["items"]
    assert (item["shown"]["name"], item["shown"]["here"], item["version"]) == ("Station 1", True, 1)
    (version,) = service.get("/api/station-versions", params={"station": "Station 1"}).json()["items"]
    assert 'name = "Station 1"' in version["config"]
    assert service.get("/api/station-versions", params={"station": "Station 9"}).status_code == 404


def test_patient_at_another_station_is_named_only_to_permitted_users(service: TestClient) -> None:
    app: Any = service.app
    body = {"clinic_number": f"K-{uuid4().hex[:8]}", "name": "Yamada Hanako", "affected_side": "right"}
    patient_id = UUID(service.post("/api/patients", json=body).json()["id"])
    elsewhere = Acted("Station 2")
    answer = state_of(elsewhere.info, elsewhere.live(), uuid4())
    answer = answer.model_copy(
        update={"patient": PatientRef(id=patient_id, name="Yamada Hanako"), "recording_name": "Hers", "mode": "ready"}
    )

    def named(role: Role) -> Any:
        assert service.portal
        service.portal.call(app.state.services.fleet.take, answer)
        seen = seen_by(service, role)["Station 2"]
        state = seen["state"]
        assert state["mode"] == "ready"
        return (state["patient"] and state["patient"]["name"]), state["recording_name"], seen["patient_hidden"]

    hers = ("Yamada Hanako", "Hers", False)
    assert {role: named(role) for role in ("viewer", "therapist", "technician")} == {
        "viewer": hers,
        "therapist": hers,
        "technician": (None, None, True),
    }
    with app.state.services.database.write() as session:
        session.execute(update(PatientRow).values(restricted=True))
    assert named("therapist") == (None, None, True)
    answer = answer.model_copy(update={"patient": None, "recording_name": None})
    assert named("technician") == (None, None, False), "a free apparatus"
