"""The database hangs, dies and comes back while somebody is treated: the session goes on, and nothing is lost or doubled."""

import time
from collections.abc import Iterator

import pytest
from fastapi.testclient import TestClient

from kata.bench import postgresql
from tests.outages import Server
from tests.web.conftest import running
from tests.web.test_derived import lifted, taught
from tests.web.test_records import problem
from tests.web.test_station import accepted, load, until, until_mode

FEW_S = 8.0
"""So long the first who ask may wait until they are told; everybody after them is told at once."""


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    try:
        with postgresql.serving() as url:
            yield Server(url)
    except postgresql.MissingError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def client(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with running(tmp_path_factory.mktemp("kata"), database_url=server.url) as made:
        yield made


def test_a_session_goes_on_while_the_database_hangs_and_the_page_says_so(client: TestClient, server: Server) -> None:
    until_mode(client, "idle")
    patient = client.post(
        "/api/patients", json={"clinic_number": "O-1", "name": "Mori Ken", "affected_side": "right"}
    ).json()
    run = load(client, patient, taught(client, patient, lifted()), speed_percent=50.0)
    assert client.get("/api/me").status_code == 200
    accepted(client, "approach")
    until_mode(client, "paused")
    accepted(client, "play")
    with server.hanging():
        began = time.monotonic()
        accepted(client, "pause")
        assert time.monotonic() - began < 3.0
        until_mode(client, "paused")
        accepted(client, "play")

        refused = client.get("/api/patients", headers={"accept-language": "ja"})
        assert (refused.status_code, refused.json()["code"]) == (503, "database_away")
        assert "データベースが応答しません" in refused.json()["detail"]
        assert refused.headers["retry-after"]
        assert time.monotonic() - began < 2 * FEW_S

        began = time.monotonic()
        for path in ("patients", "sessions", f"runs/{run['id']}"):
            told = problem(client.get(f"/api/{path}"), 503, "database_away")
            assert "nothing of it is lost" in told["detail"]
        problem(client.post("/api/sign-in", json={"username": "a", "password": "b"}), 503, "database_away")
        assert time.monotonic() - began < 3.0

        # A page that is loaded anew shows who one is, the apparatus and since when.
        assert client.get("/api/me").json()["name"] == "Test administrator"
        live = until(client, lambda live: live["kept"]["away_since"])
        assert live["refusals"]["load"]["code"] in ("database_away", "not_idle")
        assert live["run"]["patient"] is None or live["run"]["run_id"] == run["id"]
        accepted(client, "stop")
        until(client, lambda live: live["mode"] == "stopped" and not live["torque_on"])
    until(client, lambda live: live["kept"]["away_since"] is None)
    assert client.get("/api/patients").status_code == 200
