"""The overview of all stations: two services on one PostgreSQL, and the one on SQLite."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import text, update

from kata.access.actor import Role
from kata.access.sign_in import COOKIE
from kata.clinic.patients.tables import PatientRow
from kata.device import config
from tests.signed_in import signed_in
from tests.web.conftest import running
from tests.web.test_station import accepted, until, until_mode

_MESSAGES: Final = 300
"""A minute of them and more, at least one a second: whatever is waited for has come by then, or never does."""
Shown = dict[str, dict[str, Any]]


@contextmanager
def station(folder: Path, name: str, url: str) -> Iterator[TestClient]:
    """A service with a simulated apparatus of this name."""
    folder.mkdir()
    config.write(config.StationConfig(name=name), folder / "station.toml")
    with running(folder, station=folder / "station.toml", database_url=url) as client:
        yield client


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory, postgresql_url: str) -> Iterator[TestClient]:
    with station(tmp_path_factory.mktemp("stations") / "1", "Station 1", postgresql_url) as client:
        yield client
        app: Any = client.app
        database = app.state.database
    with database.writer.begin() as connection:
        connection.exec_driver_sql("DROP SCHEMA public CASCADE")
        connection.exec_driver_sql("CREATE SCHEMA public")
    database.close()


@pytest.fixture(scope="module")
def second(first: TestClient, tmp_path_factory: pytest.TempPathFactory, postgresql_url: str) -> Iterator[TestClient]:
    with station(tmp_path_factory.mktemp("stations") / "2", "Station 2", postgresql_url) as client:
        yield client


def at_rest(client: TestClient) -> None:
    """Idle; on a computer that is so busy that the control loop was kept from its work, somebody has to acknowledge that first."""

    def rests(live: dict[str, Any]) -> bool:
        return live["mode"] == "idle" or (live["mode"] == "stopped" and "acknowledge" not in live["refusals"])

    while until(client, rests)["mode"] != "idle":
        client.post("/api/station/acknowledge")


def seen_by(client: TestClient, role: Role) -> TestClient:
    app: Any = client.app
    browser = TestClient(client.app)
    browser.cookies.set(COOKIE, signed_in(app.state.database, role))
    return browser


def until_shown(browser: TestClient, wanted: Callable[[Shown], bool]) -> Shown:
    """The stations by name, as the page hears of them."""
    with browser.websocket_connect("/api/stations/live") as socket:
        for _ in range(_MESSAGES):
            stations = {one["name"]: one for one in socket.receive_json()["stations"]}
            if wanted(stations):
                return stations
    raise AssertionError(stations)


def state(shown: Shown, name: str) -> dict[str, Any]:
    return (shown.get(name) or {}).get("state") or {}


def test_on_sqlite_there_is_the_one_station(tmp_path: Path) -> None:
    with running(tmp_path) as client:
        until_mode(client, "idle")
        shown = until_shown(client, lambda shown: state(shown, "Station 1").get("mode") == "idle")
        assert list(shown) == ["Station 1"]
        assert (shown["Station 1"]["here"], shown["Station 1"]["silent"]) == (True, False)


def test_each_service_shows_both_stations_and_what_stops_one_of_them(first: TestClient, second: TestClient) -> None:
    at_rest(first)
    at_rest(second)
    for client, own in ((first, "Station 1"), (second, "Station 2")):
        shown = until_shown(client, lambda shown: len([one for one in shown.values() if one["state"]]) == 2)
        assert [name for name, one in shown.items() if one["here"]] == [own]
    second.post("/api/simulator/estop", json={"pressed": True})
    shown = until_shown(first, lambda shown: state(shown, "Station 2").get("estop") == "pressed")
    assert shown["Station 2"]["state"]["mode"] == "stopped"
    assert [cause["code"] for cause in shown["Station 2"]["state"]["causes"]] == ["estop_pressed"]
    assert state(shown, "Station 1")["estop"] == "closed"
    second.post("/api/simulator/estop", json={"pressed": False})
    until_shown(first, lambda shown: state(shown, "Station 2").get("estop") == "released")
    accepted(second, "acknowledge")
    until_shown(first, lambda shown: state(shown, "Station 2").get("mode") == "idle")


def test_the_list_tells_who_is_registered_and_with_which_configuration(first: TestClient, second: TestClient) -> None:
    items = {one["shown"]["name"]: one for one in first.get("/api/stations").json()["items"]}
    assert {name: one["version"] for name, one in items.items()} == {"Station 1": 1, "Station 2": 1}
    told = first.get("/api/station-versions", params={"station": "Station 2"}).json()["items"]
    assert 'name = "Station 2"' in told[0]["config"]
    assert first.get("/api/station-versions", params={"station": "Station 9"}).status_code == 404


def test_a_patient_at_another_station_is_named_to_whom_the_record_is_open(
    first: TestClient, second: TestClient
) -> None:
    body = {"clinic_number": f"K-{uuid4().hex[:8]}", "name": "Yamada Hanako", "affected_side": "right"}
    patient = second.post("/api/patients", json=body).json()
    at_rest(second)
    accepted(second, "teach", {"patient_id": patient["id"]})

    def teaching(shown: Shown) -> bool:
        return state(shown, "Station 2").get("mode") == "teaching"

    def named(role: Role) -> Any:
        browser = seen_by(first, role)
        live = until_shown(browser, teaching)["Station 2"]["state"]["patient"]
        items = {one["shown"]["name"]: one["shown"] for one in browser.get("/api/stations").json()["items"]}
        assert items["Station 2"]["state"]["patient"] == live
        return live and live["name"]

    assert {role: named(role) for role in ("viewer", "therapist", "technician")} == {
        "viewer": "Yamada Hanako",
        "therapist": "Yamada Hanako",
        "technician": None,
    }
    app: Any = first.app
    with app.state.database.write() as session:
        session.execute(update(PatientRow).values(restricted=True))
    assert named("therapist") is None
    accepted(second, "finish-teaching")
    until_shown(first, lambda shown: state(shown, "Station 2").get("mode") == "idle")


def test_a_connection_that_is_lost_is_made_anew(first: TestClient, second: TestClient) -> None:
    until_shown(first, lambda shown: bool(state(shown, "Station 2")))
    app: Any = first.app
    ended = "SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE application_name = 'kata overview'"
    with app.state.database.read() as session:
        assert session.execute(text(ended)).scalar_one() == 4, "each service tells on one and listens on one"
    shown = until_shown(first, lambda shown: shown["Station 2"]["silent"])
    assert shown["Station 1"]["silent"] is False, "its own state needs no database"
    until_shown(first, lambda shown: bool(state(shown, "Station 2")))


def test_a_station_whose_service_has_gone_is_silent_since_then(
    first: TestClient, tmp_path: Path, postgresql_url: str
) -> None:
    with station(tmp_path / "3", "Station 3", postgresql_url):
        shown = until_shown(first, lambda shown: bool(state(shown, "Station 3")))
        heard_at = shown["Station 3"]["heard_at"]
    gone = until_shown(first, lambda shown: shown["Station 3"]["silent"])["Station 3"]
    assert gone["state"] is None
    assert gone["heard_at"] >= heard_at
