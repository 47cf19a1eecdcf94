"""Operation of the service: liveness, readiness, metrics and log."""

import json
import logging
import re
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import pytest
from fastapi.testclient import TestClient
from prometheus_client.parser import text_string_to_metric_families
from sqlalchemy.orm import Session

from kata.api.database_probe import DatabaseProbe
from kata.api.logs import JsonLines
from kata.auth.login_session import COOKIE
from kata.database.engine import Database
from tests.support.login import signed_in
from tests.support.paths import ROOT
from tests.support.preflight import teaching
from tests.support.service import other_browser, replaced, running
from tests.support.station_api import accepted, until, until_mode

TOKEN: Final = "a-token-of-the-tests-0123456789"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    folder = tmp_path_factory.mktemp("operations")
    (folder / "token").write_text(TOKEN + "\n")
    with running(folder, metrics_token_file=folder / "token") as made:
        yield made


def values(client: TestClient) -> dict[tuple[str, str], float]:
    """Return every metric's value by name and labels."""
    text = client.get("/metrics").text
    samples = [sample for family in text_string_to_metric_families(text) for sample in family.samples]
    return {(sample.name, " ".join(sample.labels.values())): sample.value for sample in samples}


# -- health ---------------------------------------------------------------------------------------------------------


def test_a_service_with_database_and_apparatus_is_alive_and_ready(client: TestClient) -> None:
    until_mode(client, "idle")
    nobody = TestClient(client.app)
    assert nobody.get("/health/live").json() == {"status": "alive"}
    answer = nobody.get("/health/ready")
    found = answer.json()
    assert (answer.status_code, found["status"], found["database"]) == (200, "ready", "sqlite")


class _Stuck(Database):
    """A database that answers only after it is released."""

    def __init__(self) -> None:
        super().__init__("sqlite://")
        self.asked = 0
        self.let_go = threading.Event()

    @contextmanager
    def read(self) -> Iterator[Session]:
        self.asked += 1
        self.let_go.wait(60)
        with super().read() as session:
            yield session


def put_so_far(app: Any) -> int:
    """Return the number of records put into the station's spool."""
    spool = app.state.services.event_spool.spool
    return int(spool.last + spool.unwritten)


def test_service_with_hanging_database_is_alive_but_not_ready(client: TestClient) -> None:
    stuck = _Stuck()
    app: Any = client.app
    waiting = put_so_far(app)
    try:
        with replaced(client.app, probe=DatabaseProbe(stuck, limit_s=0.01)):
            for _ in range(3):
                answer = client.get("/health/ready")
                assert (answer.status_code, answer.json()["code"]) == (503, "database_away")
            assert client.get("/health/live").status_code == 200
        assert stuck.asked == 1
        assert put_so_far(app) == waiting, "monitoring adds no audit entries"
    finally:
        stuck.let_go.set()


def idle(client: TestClient) -> tuple[int, str]:
    """Return status and code of the answer whether the service may be stopped, asked without a login."""
    # In the service's event loop: a loop of its own would end only after the database that hangs.
    answer = other_browser(client).get("/health/idle")
    found = answer.json()
    return answer.status_code, found.get("code") or found["status"]


def test_a_service_may_be_stopped_between_sessions(client: TestClient) -> None:
    until_mode(client, "idle")
    assert idle(client) == (200, "idle")
    app: Any = client.app
    stuck = _Stuck()
    try:
        with replaced(client.app, probe=DatabaseProbe(stuck, limit_s=0.01)):
            assert idle(client) == (503, "database_away"), "without a database, open sessions are unknown"
    finally:
        stuck.let_go.set()
    running: Any = SimpleNamespace(running=True)
    with replaced(app, commissioning_run=running):
        assert idle(client) == (503, "station_occupied")


def test_an_open_session_and_torque_keep_the_service(client: TestClient, patient: dict[str, Any]) -> None:
    until_mode(client, "idle")
    session = client.post("/api/sessions", json={"patient_id": patient["id"]}).json()
    assert idle(client) == (503, "session_open")
    client.post(f"/api/sessions/{session['id']}/end", json={})
    assert idle(client) == (200, "idle")
    with replaced(client.app, station=SimpleNamespace(occupied=True)):
        assert idle(client) == (503, "station_occupied")


# -- metrics --------------------------------------------------------------------------------------------------------


def test_metrics_need_technician_administrator_or_token(client: TestClient) -> None:
    app: Any = client.app
    allowed = {}
    for role in ("viewer", "therapist", "technician", "administrator"):
        browser = TestClient(client.app)
        browser.cookies.set(COOKIE, signed_in(app.state.services.database, role))
        allowed[role] = browser.get("/metrics").status_code
    assert allowed == {"viewer": 403, "therapist": 403, "technician": 200, "administrator": 200}
    scraper = TestClient(client.app)
    for header, status in (
        (f"Bearer {TOKEN}", 200),
        (f"bearer {TOKEN}", 200),
        (f"Bearer {TOKEN[:-1]}", 401),
        (f"Basic {TOKEN}", 401),
        ("Bearer ", 401),
        ("", 401),
    ):
        assert scraper.get("/metrics", headers={"authorization": header}).status_code == status, header
    assert scraper.get("/api/patients", headers={"authorization": f"Bearer {TOKEN}"}).status_code == 401


@pytest.mark.parametrize("content", ["", "short", None], ids=["empty", "short", "no file"])
def test_empty_token_file_grants_no_access(client: TestClient, tmp_path: Path, content: str | None) -> None:
    if content is not None:
        (tmp_path / "token").write_text(content)
    header = {"authorization": f"Bearer {content or ''}"}
    app: Any = client.app
    settings = app.state.services.settings.model_copy(update={"metrics_token_file": tmp_path / "token"})
    with replaced(app, settings=settings):
        assert TestClient(client.app).get("/metrics", headers=header).status_code == 401


def test_metrics_describe_loop_and_database(client: TestClient) -> None:
    until_mode(client, "idle")
    answer = values(client)
    assert answer["kata_device_running", ""] == 1
    assert answer["kata_loop_cycles_total", ""] > 0
    assert answer["kata_loop_lateness_seconds", "0.5"] <= answer["kata_loop_lateness_seconds", "1"] < 60
    assert {labels for name, labels in answer if name == "kata_drive_errors_total"} == {"1", "2", "3", "4", "5"}
    assert answer["kata_database_write_wait_seconds_count", ""] > 0
    for name in ("kata_loop_overruns_total", "kata_bus_errors_total", "kata_telemetry_dropped_total"):
        assert (name, "") in answer
    for name in ("kata_spool_waiting", "process_resident_memory_bytes"):
        assert answer[name, ""] >= 0


def test_a_stop_is_counted_once_by_its_cause(client: TestClient) -> None:
    until_mode(client, "idle")
    before = values(client).get(("kata_stops_total", "estop_pressed"), 0)
    client.post("/api/simulator/estop", json={"pressed": True})
    until_mode(client, "stopped")
    client.post("/api/simulator/estop", json={"pressed": False})
    until(client, lambda live: live["estop"] == "released" and "acknowledge" not in live["refusals"])
    accepted(client, "acknowledge")
    until_mode(client, "idle")
    assert values(client)["kata_stops_total", "estop_pressed"] == before + 1


def test_live_listeners_are_counted_while_connected(client: TestClient) -> None:
    before = values(client)["kata_websocket_clients", ""]
    with client.websocket_connect("/api/live") as socket:
        socket.receive_json()
        assert values(client)["kata_websocket_clients", ""] == before + 1
    assert values(client)["kata_websocket_clients", ""] == before


def test_a_sign_in_that_is_refused_is_counted(client: TestClient) -> None:
    before = values(client).get(("kata_sign_ins_refused_total", "wrong_password"), 0)
    answer = TestClient(client.app).post("/api/sign-in", json={"username": "nobody", "password": "not this one"})
    assert answer.status_code == 401
    assert values(client)["kata_sign_ins_refused_total", "wrong_password"] == before + 1


def test_metrics_contain_no_names(client: TestClient, patient: dict[str, Any]) -> None:
    until_mode(client, "idle")
    accepted(client, "teach", teaching(client, patient["id"]))
    until_mode(client, "teaching")
    text = client.get("/metrics").text
    accepted(client, "finish-teaching")
    until_mode(client, "idle")
    assert "kata_loop_cycles_total" in text
    me = client.get("/api/me").json()
    for hidden in (*patient["name"].split(), patient["id"], patient["clinic_number"], me["name"], me["username"]):
        assert hidden not in text
    assert not re.search(r"[0-9a-f]{8}-[0-9a-f]{4}-", text), "no id of anything"


def test_every_dashboard_expression_uses_an_existing_metric(client: TestClient) -> None:
    text = client.get("/metrics").text
    known = set()
    for family in text_string_to_metric_families(text):
        ends = {"counter": ("_total",), "histogram": ("_bucket", "_sum", "_count")}.get(family.type, ("",))
        known |= {family.name + end for end in ends}
    dashboard = json.loads((ROOT / "deploy/grafana/kata.json").read_text())
    asked = [target["expr"] for panel in dashboard["panels"] for target in panel.get("targets", ())]
    asked += [variable["query"] for variable in dashboard["templating"]["list"] if variable["type"] == "query"]
    assert len(asked) > 10
    for expression in asked:
        names = re.findall(r"\b(?:kata|process)_\w+", expression)
        assert names, expression
        assert set(names) <= known, expression
    # The dashboard shows the metrics that operators need.
    everything = " ".join(asked)
    assert {
        name for name in known if name.startswith("kata_") and not name.endswith(("_sum", "_count", "_created"))
    } <= set(re.findall(r"\bkata_\w+", everything))


# -- logs -----------------------------------------------------------------------------------------------------------


def test_json_log_has_one_object_per_line_with_traceback() -> None:
    try:
        raise ValueError("two\nlines")
    except ValueError:
        record = logging.LogRecord("kata.api", logging.ERROR, "", 0, "not %s", ("written",), sys.exc_info())
    line = JsonLines().format(record)
    answer = json.loads(line)
    assert "\n" not in line
    assert (answer["level"], answer["logger"], answer["message"]) == ("error", "kata.api", "not written")
    assert answer["at"].endswith("+00:00")
    assert answer["traceback"].endswith("ValueError: two\nlines")
