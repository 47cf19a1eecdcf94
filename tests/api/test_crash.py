"""The service is killed during a playback, as by a power cut. The next start finds all measured samples."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx2
import pytest

from benchmarks import postgresql
from kata.auth.login_session import COOKIE
from kata.database.engine import Database
from tests.support.login import signed_in_at
from tests.support.ports import free_port
from tests.support.preflight import BY_HAND, confirmation
from tests.support.recordings import lifted, store
from tests.support.slow_station import RATE_HZ, slow_station_file
from tests.support.station_commands import operate

LIMIT_S = 60.0
KILLED = ("service_silent", "bus_lost", "drive_silent", "estop_unknown")
"""What the device process may notice first when the service and its simulator end."""


class Served:
    """``kata serve --simulate`` on a folder; its database is a file in it, unless one is given."""

    def __init__(self, folder: Path, database_url: str = "") -> None:
        cookie = signed_in_at(folder, database_url=database_url)
        self.database_url = database_url or f"sqlite:///{folder / 'kata.db'}"
        port = free_port()
        command = [sys.executable, "-m", "kata", "serve", "--simulate", "--data", str(folder), "--port", str(port)]
        environment = os.environ | {"KATA_STATION": str(slow_station_file(folder))}
        environment |= {"KATA_DATABASE_URL": database_url} if database_url else {}
        self.process = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True, env=environment)
        self._client = httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=LIMIT_S, cookies={COOKIE: cookie})
        self.until(lambda: self.live()["mode"] == "idle")

    def call(self, method: str, path: str, body: Any = None) -> Any:
        answer = self._client.request(method, f"/api/{path}", json=body)
        answer.raise_for_status()
        return answer.json()

    def operate(self, command: str) -> None:
        operate(self._client, command).raise_for_status()

    def metrics(self) -> str:
        return self._client.get("/metrics").raise_for_status().text

    def live(self) -> Any:
        return self.call("GET", "station")["live"]

    def until(self, condition: Callable[[], object]) -> None:
        limit = time.monotonic() + LIMIT_S
        while True:
            try:
                if condition():
                    return
            except httpx2.TransportError:
                assert self.process.poll() is None
            assert time.monotonic() < limit
            time.sleep(0.05)

    def end(self, how: signal.Signals) -> None:
        self._client.close()
        os.kill(self.process.pid, how)
        self.process.wait(20)


def try_estop(served: Served, patient_id: str) -> None:
    """Test the emergency stop like a therapist before teaching."""
    path = f"patients/{patient_id}/teaching-checklist?fixtures=arm_fixer_1"

    def still_open() -> list[str]:
        return [check["check"] for check in served.call("GET", path)["checks"] if not check["given"]]

    assert "estop" in still_open()
    for pressed, state in ((True, "pressed"), (False, "released")):
        served.call("POST", "simulator/estop", {"pressed": pressed})
        served.until(lambda wanted=state: served.live()["estop"] == wanted)  # type: ignore[misc]
    served.until(lambda: "acknowledge" not in served.live()["refusals"])
    served.operate("acknowledge")
    served.until(lambda: "estop" not in still_open())


def prepare(served: Served) -> tuple[str, str]:
    """Test the emergency stop, and return the ids of a new patient and a recording."""
    patient_id = served.call("POST", "patients", {"clinic_number": "1", "name": "N", "affected_side": "right"})["id"]
    try_estop(served, patient_id)
    with closing(Database(served.database_url)) as database:
        return patient_id, str(store(database, patient_id, lifted(), fixtures=["arm_fixer_1"]))


def play(served: Served, session_id: str, **what: Any) -> str:
    """Play until the arm moves, and return the run."""
    for check in BY_HAND:
        given = confirmation(check, what["recording_id"])
        served.call("PUT", f"sessions/{session_id}/checklist/{check}", given)
    run_id: str = served.call("POST", "station/load", {"session_id": session_id, "resistance_level": 25, **what})["id"]
    served.operate("approach")
    served.until(lambda: served.live()["mode"] == "paused")
    served.operate("play")
    served.until(lambda: served.live()["run"]["position_s"] > 1.0)
    return run_id


def test_measured_samples_survive_a_killed_service(tmp_path: Path) -> None:
    first = Served(tmp_path)
    patient_id, recording_id = prepare(first)
    session = first.call("POST", "sessions", {"patient_id": patient_id})
    run_id = play(first, session["id"], recording_id=recording_id)
    first.end(signal.SIGKILL)

    second = Served(tmp_path)
    try:
        assert second.live()["torque"] == "off"
        assert second.live()["run"] is None
        run = second.call("GET", f"runs/{run_id}")
        assert run["outcome"] == "stopped"
        assert run["stop"]["code"] in KILLED
        assert run["comparison"]["samples"] > 0.9 * RATE_HZ
    finally:
        second.end(signal.SIGTERM)


@pytest.mark.campaign
def test_service_killed_during_an_outage_recovers_its_session(server: postgresql.Server, tmp_path: Path) -> None:
    first = Served(tmp_path, server.url)
    patient_id, recording_id = prepare(first)
    items = {"name": "Morning", "items": [{"resistance_level": 25, "recording_id": recording_id}]}
    version_id = first.call("POST", f"patients/{patient_id}/programmes", items)["current"]["id"]
    first.until(lambda: "kata_ready_patients 1.0" in first.metrics())
    with server.killed():
        first.until(lambda: first.live()["database"]["unavailable_since"])
        wanted = {"patient_id": patient_id, "programme_version_id": version_id}
        session = first.call("POST", "sessions", wanted)
        first.call("PATCH", f"sessions/{session['id']}", {"pain_before": 6})
        run_id = play(first, session["id"], recording_id=recording_id, programme_position=1)
        first.end(signal.SIGKILL)

    second = Served(tmp_path, server.url)
    try:
        assert second.live()["torque"] == "off"
        assert second.live()["run"] is None
        (found,) = second.call("GET", f"patients/{patient_id}/sessions")["items"]
        assert found["id"] == session["id"]
        there = second.call("GET", f"sessions/{session['id']}")
        assert (there["pain_before"], there["ended_at"]) == (6, None)
        assert [check["check"] for check in there["checks"]] == [*BY_HAND, "pedal", "estop"]
        assert [run["id"] for run in there["runs"]] == [run_id]
        assert there["runs"][0]["outcome"] == "stopped"
        assert there["runs"][0]["stop"]["code"] in KILLED
        assert there["runs"][0]["comparison"]["samples"] > 0.9 * RATE_HZ
    finally:
        second.end(signal.SIGTERM)
