"""The service is killed in the middle of a playback, as by a power cut; the next one finds everything that was measured."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx2

from kata.access.sign_in import COOKIE
from tests.conftest import free_port
from tests.signed_in import signed_in_at

LIMIT_S = 60.0


class Served:
    """``kata serve --simulate`` on a folder."""

    def __init__(self, folder: Path) -> None:
        cookie = signed_in_at(folder)
        port = free_port()
        command = [sys.executable, "-m", "kata", "serve", "--simulate", "--data", str(folder), "--port", str(port)]
        self.process = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
        self._client = httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=20, cookies={COOKIE: cookie})
        self.until(lambda: self.live()["mode"] == "idle")

    def call(self, method: str, path: str, body: Any = None) -> Any:
        answer = self._client.request(method, f"/api/{path}", json=body)
        answer.raise_for_status()
        return answer.json()

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


def go_through_checklist(served: Served, session_id: str, recording_id: str) -> None:
    """As a therapist would, before anything is played."""
    path, body = f"sessions/{session_id}/checklist", {"checked_by": "T", "recording_id": recording_id}

    def still_open() -> list[str]:
        checks = served.call("GET", f"{path}?recording_id={recording_id}")["checks"]
        return [one["check"] for one in checks if not one["given"]]

    assert "estop" in still_open()
    for pressed, state in ((True, "pressed"), (False, "released")):
        served.call("POST", "simulator/estop", {"pressed": pressed})
        served.until(lambda wanted=state: served.live()["estop"] == wanted)  # type: ignore[misc]
    served.until(lambda: "acknowledge" not in served.live()["refusals"])
    served.call("POST", "station/acknowledge")
    for check in ("side", "fixtures", "belt"):
        served.call("PUT", f"{path}/{check}", body)
    served.until(lambda: not still_open())


def test_what_was_measured_survives_a_killed_service(tmp_path: Path) -> None:
    first = Served(tmp_path)
    patient = first.call("POST", "patients", {"clinic_number": "1", "name": "N", "affected_side": "right"})
    first.call("POST", "station/teach", {"patient_id": patient["id"]})
    first.call("POST", "simulator/guide", {"motion_id": "built-in-1"})
    first.until(lambda: first.call("GET", "simulator")["hand"]["phase"] == "away")
    first.call("POST", "station/finish-teaching")
    recordings = f"patients/{patient['id']}/recordings"
    first.until(lambda: first.call("GET", recordings)["items"])
    recording = first.call("GET", recordings)["items"][0]
    session = first.call("POST", "sessions", {"patient_id": patient["id"]})
    go_through_checklist(first, session["id"], recording["id"])
    run = first.call("POST", "station/load", {"session_id": session["id"], "recording_id": recording["id"]})
    first.call("POST", "station/approach")
    first.until(lambda: first.live()["mode"] == "paused")
    first.call("POST", "station/play")
    first.until(lambda: first.live()["run"]["position_s"] > 1.0)
    first.end(signal.SIGKILL)

    second = Served(tmp_path)
    try:
        assert second.live()["torque_on"] is False
        assert second.live()["run"] is None
        kept = second.call("GET", f"runs/{run['id']}")
        assert kept["outcome"] == "stopped"
        assert kept["stop"]["code"] in ("service_silent", "bus_lost", "drive_silent", "estop_unknown")
        assert kept["comparison"]["samples"] > 90
    finally:
        second.end(signal.SIGTERM)
