"""The station of a running clinic, put into the states that a screenshot shows."""

import time
from collections.abc import Callable
from typing import Any, Final, Self

import httpx2

from kata.auth.login_session import COOKIE
from tests.support.browser_clinic import START_LIMIT_S, Clinic
from tests.support.preflight import TEACHING_CHECKED, confirmation, still_open
from tests.support.station_commands import operate

_POLL_S: Final = 0.1
_AGAIN: Final = frozenset({"not_verified", "expired"})
"""Refusals that end: the drives' settings are being checked, or a busy computer delayed the command."""
_PLAYED: Final = {"speed_percent": 50.0, "repetitions": 20, "resistance_level": 15}
"""Long enough for a screenshot of every size."""
_EFFORT_NM: Final = 1.5
"""Effort of the simulated patient that carries a self-paced motion."""
_STRETCH: Final = {"torque_nm": 1.5, "speed_deg_s": 10.0, "resistance_level": 20, "hold_s": 60.0}


def _of(session: dict[str, Any], recording: dict[str, Any]) -> dict[str, Any]:
    return {"session_id": session["id"], "recording_id": recording["id"]}


class ShownStation:
    """Moves the simulated apparatus of a clinic over its API, with the login session of the clinic's page."""

    def __init__(self, clinic: Clinic) -> None:
        cookies = {COOKIE: clinic.cookie}
        self._client = httpx2.Client(base_url=clinic.url, cookies=cookies, headers={"X-Kata-Active": "1"}, timeout=30)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def make_idle(self) -> None:
        """Wait until the apparatus is idle. Acknowledge a stop: on a busy computer the device misses answers while it starts."""
        limit = time.monotonic() + START_LIMIT_S
        while (live := self._live())["mode"] != "idle":
            assert time.monotonic() < limit, live
            if live["mode"] == "stopped":
                operate(self._client, "acknowledge")
            time.sleep(_POLL_S)

    def begin_session(self, clinic_number: str) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin a session of this patient, whose checklist is open. Return the session and a recording."""
        patient = self._first("/api/patients", search=clinic_number)
        recording = self._first(f"/api/patients/{patient['id']}/recordings")
        self.set_side(recording["side"])
        session = self._sent("POST", "/api/sessions", {"patient_id": patient["id"]})
        return session, recording

    def set_side(self, side: str) -> None:
        """Set up the apparatus for the shoulder of this side."""
        limit = time.monotonic() + START_LIMIT_S
        while self._live()["side"] != side:
            self.make_idle()
            answer = operate(self._client, "side", {"side": side})
            # On a busy computer the device can stop between the two.
            assert answer.status_code == 200 or time.monotonic() < limit, answer.text

    def play(self, session: dict[str, Any], recording: dict[str, Any]) -> None:
        """Complete the checklist, enter the pain before, and play the recording for minutes."""
        path = f"/api/sessions/{session['id']}"
        # The pedal's check is automatic. While a device process starts, the pedal's state is unknown.
        self.make_idle()
        for check in still_open(self._client, session["id"], recording["id"]):
            if check == "estop":
                self.press_estop()
                self.release_estop()
            else:
                self._sent("PUT", f"{path}/checklist/{check}", confirmation(check, recording["id"]))
        seen = self._client.get(path).json()["updated_at"]
        self._sent("PATCH", path, {"pain_before": 4, "updated_at": seen})
        self._play("load", _of(session, recording) | _PLAYED)

    def load(self, session: dict[str, Any], recording: dict[str, Any]) -> None:
        """Load the recording, whose checks were made before."""
        self._answer("load", _of(session, recording) | _PLAYED)
        self._until_mode("ready")

    def play_self_paced(self, session: dict[str, Any], recording: dict[str, Any]) -> None:
        """Play the recording at the patient's pace, with the doctor's permission. The simulated patient helps."""
        permitted = {"self_paced_permitted": True, "limits_by": "Dr. Mori"}
        self._sent("PATCH", f"/api/episodes/{session['episode_id']}", permitted)
        self._play("load", _of(session, recording) | _PLAYED | {"self_paced": True, "resistance_level": 20})
        self._sent("POST", "/api/simulator/effort", {"effort_nm": _EFFORT_NM})
        self._until(lambda live: live["run"]["self_pacing"]["work_j"] > 0)

    def stretch(self, session: dict[str, Any], recording: dict[str, Any]) -> None:
        """Measure the baseline of an end-feel test, then stretch until the arm is held."""
        self._sent("POST", "/api/simulator/effort", {"effort_nm": 0.0})
        asked = _of(session, recording) | _STRETCH
        self._play("load-end-feel", asked | {"kind": "baseline"})
        self._until_mode("idle")
        self._play("load-end-feel", asked | {"kind": "stretch"})
        self._until(lambda live: live["run"]["stretch"]["phase"] == "hold")

    def _play(self, load: str, body: dict[str, Any]) -> None:
        limit = time.monotonic() + START_LIMIT_S
        while refused := self._try_to_play(load, body):
            assert time.monotonic() < limit, refused

    def _try_to_play(self, load: str, body: dict[str, Any]) -> str:
        """Load, approach and play. Return why it failed, or ""."""
        self.make_idle()
        for command, wanted in ((load, "ready"), ("approach", "paused"), ("play", "playing")):
            answer = self._answer(command, body if command == load else None)
            if answer.status_code != 200:
                return str(answer.text)
            live = self._until_mode(wanted, "stopped", "idle")
            if live["mode"] != wanted:
                return str(live["stop"])
        return ""

    def teach(self, clinic_number: str) -> dict[str, Any]:
        """Begin to teach this patient a motion, with every check answered. Return the patient."""
        patient = self._first("/api/patients", search=clinic_number)
        body = {"patient_id": patient["id"], "fixtures": ["arm_fixer_1"]} | TEACHING_CHECKED
        self.set_side(patient["affected_side"])
        self.press_estop()
        self.release_estop()
        limit = time.monotonic() + START_LIMIT_S
        while (answer := self._answer("teach", body)).status_code != 200:
            # A thread stores the test of the emergency stop, and on a busy computer the device can stop.
            assert time.monotonic() < limit, answer.text
            self.make_idle()
        self._until_mode("teaching")
        return patient

    def finish_teaching(self) -> None:
        """End the teaching without a take."""
        self._answer("finish-teaching")
        self.make_idle()

    def press_estop(self) -> None:
        """Press the emergency stop."""
        self._sent("POST", "/api/simulator/estop", {"pressed": True})
        self._until_mode("stopped")

    def release_estop(self) -> None:
        """Release the emergency stop and acknowledge."""
        self._sent("POST", "/api/simulator/estop", {"pressed": False})
        self._until(lambda live: live["estop"] != "pressed")
        self.make_idle()

    def end_session(self, session: dict[str, Any]) -> None:
        """End the session after its run is stored."""
        limit = time.monotonic() + START_LIMIT_S
        while (answer := self._client.post(f"/api/sessions/{session['id']}/end")).status_code == 409:
            assert time.monotonic() < limit, answer.text
            time.sleep(_POLL_S)
        assert answer.status_code == 200, answer.text

    def _live(self) -> dict[str, Any]:
        live: dict[str, Any] = self._client.get("/api/station").json()["live"]
        return live

    def _until_mode(self, *modes: str) -> dict[str, Any]:
        return self._until(lambda live: live["mode"] in modes)

    def _until(self, condition: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        limit = time.monotonic() + START_LIMIT_S
        while not condition(live := self._live()):
            assert time.monotonic() < limit, (live["mode"], live["stop"], live["estop"])
            time.sleep(_POLL_S)
        return live

    def _answer(self, name: str, body: dict[str, Any] | None = None) -> Any:
        """Send a command, and again while the device refuses it for a reason that ends. Return the answer."""
        limit = time.monotonic() + START_LIMIT_S
        while (answer := operate(self._client, name, body)).status_code == 409 and answer.json()["code"] in _AGAIN:
            assert time.monotonic() < limit, answer.text
            time.sleep(_POLL_S)
        return answer

    def _sent(self, method: str, path: str, body: dict[str, Any]) -> dict[str, Any]:
        answer = self._client.request(method, path, json=body)
        assert answer.is_success, (path, answer.text)
        result: dict[str, Any] = answer.json()
        return result

    def _first(self, path: str, **params: str) -> dict[str, Any]:
        first: dict[str, Any] = self._client.get(path, params=params).json()["items"][0]
        return first
