"""The page runs the procedure of commissioning."""

import asyncio
import contextlib
import json
import time
from datetime import datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient
from msgspec import structs
from sqlalchemy import select

from kata.api import commissioning_run
from kata.audit.tables import AuditRow
from kata.bench.commissioned import write_commissioned
from kata.commissioning import texts
from kata.commissioning.record import own_steps, read_record, record_path
from kata.device import config
from kata.device import texts as device_texts
from kata.device.config import StationConfig, simulated
from kata.device.ipc_messages import Refusal
from kata.simulator.process import SimulatorProcess
from kata.station.guard import COMMAND_VALID_S, Guard
from kata.station.lease import PAUSE_AFTER_ABSENCE_S, Browser
from tests.support.open_page import open_page
from tests.support.service import running
from tests.support.station_api import until
from tests.support.station_commands import seen

RUN: Final = "/api/station/commissioning/run"
_LIMIT_S: Final = 120.0
_GUARD: Final = Guard(stops=0, expires_ns=2**63)
_POLL_S: Final = 0.1
"""Interval of requests for the state. Each takes the service several milliseconds of processor time."""


def state(client: TestClient) -> dict[str, Any]:
    found: dict[str, Any] = client.get(RUN).json()
    return found


def start(client: TestClient, kind: str, **more: Any) -> Any:
    """Start a run as a page does that shows the newest state."""
    return client.post(RUN, json=seen(client) | {"kind": kind} | more)


def confirm(client: TestClient, number: int, **more: Any) -> Any:
    """Confirm an instruction as a page does that shows the newest state."""
    return client.post(f"{RUN}/confirm", json=seen(client) | {"number": number} | more)


def do(client: TestClient, last: str, limit_s: float = _LIMIT_S) -> dict[str, Any]:
    """Confirm instructions until a step has ended."""
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        now = state(client)
        of_step = next(step for step in now["steps"] if step["key"] == last)
        if of_step["state"] in ("passed", "failed") or not now["running"]:
            return now
        if now["instruction"] and now["instruction"]["press"]:
            confirm(client, now["instruction"]["number"])
        time.sleep(_POLL_S)
    raise AssertionError("the step did not end")


def states(run: dict[str, Any]) -> list[str]:
    return [step["state"] for step in run["steps"]]


def test_a_practice_runs_and_stop_ends_it(tmp_path: Path) -> None:
    with running(tmp_path, "technician") as client:
        until(client, lambda live: live["mode"] == "idle")
        assert start(client, "full", begin="axes").json()["code"] == "steps_missing"
        assert start(client, "full").json()["running"]
        assert start(client, "full").json()["code"] == "commissioning_runs"
        assert confirm(client, 99).json()["code"] == "other_instruction"
        run = do(client, "inputs")
        assert states(run)[:4] == ["passed", "passed", "passed", "running"]
        assert run["steps"][1]["result"]["values"]
        refusals = until(client, lambda live: live["mode"] == "offline")["refusals"]
        assert refusals["teach"]["code"] == "commissioning_runs"
        assert client.post("/api/station/stop").status_code == 200
        ended = state(client)
        assert (ended["running"], ended["passed"], ended["instruction"]) == (False, False, None)
        fault = next(step["result"]["fault"] for step in ended["steps"] if step["state"] == "failed")
        assert fault == texts.TECHNICIAN_STOPPED()
        until(client, lambda live: live["mode"] == "idle")
        with client.app.state.services.database.read() as session:  # type: ignore[attr-defined]
            actions = session.scalars(select(AuditRow.action)).all()
        assert {"start_commissioning", "stop"} <= set(actions)


def test_delayed_starts_and_confirmations_are_refused(tmp_path: Path) -> None:
    """The network delays a request. Meanwhile Stop is pressed, or so much time passes that the technician no longer expects motion."""
    with running(tmp_path, "technician") as client:
        until(client, lambda live: live["mode"] == "idle")
        before = seen(client)
        client.post("/api/station/stop")
        client.post("/api/station/acknowledge", json=seen(client))
        late = client.post(RUN, json=before | {"kind": "full"})
        assert (late.status_code, late.json()["code"]) == (409, "stopped_meanwhile")
        until(client, lambda live: live["mode"] == "idle")
        assert start(client, "full").json()["running"]
        while not (shown := state(client))["instruction"] or not shown["instruction"]["press"]:
            time.sleep(_POLL_S)
        number = shown["instruction"]["number"]
        old = (datetime.fromisoformat(seen(client)["seen_at"]) - timedelta(seconds=COMMAND_VALID_S + 0.1)).isoformat()
        late = client.post(f"{RUN}/confirm", json={"number": number, "stops": 0, "seen_at": old})
        assert (late.status_code, late.json()["code"]) == (409, "expired")
        assert state(client)["presses"] == 0
        assert confirm(client, number).json()["presses"] == 1


def review(client: TestClient, load: str) -> dict[str, Any]:
    """Confirm instructions until the page shows a review of gains with this load. Return the instruction."""
    end = time.monotonic() + _LIMIT_S
    while time.monotonic() < end:
        now = state(client)
        assert now["running"], now["steps"]
        instruction = now["instruction"]
        if instruction and instruction["press"]:
            if instruction["review"]:
                assert instruction["review"]["load"] == load
                found: dict[str, Any] = instruction
                return found
            confirm(client, instruction["number"])
        time.sleep(_POLL_S)
    raise AssertionError("no review was shown")


def answer(client: TestClient, instruction: dict[str, Any], **gains: Any) -> dict[str, Any]:
    found: dict[str, Any] = confirm(client, instruction["number"], gains=gains).json()
    return found


@pytest.mark.campaign
@pytest.mark.timeout(240)
def test_gains_are_tried_and_taken_back(tmp_path: Path) -> None:
    with running(tmp_path, "technician") as client:
        until(client, lambda live: live["mode"] == "idle")
        start(client, "full")
        assert do(client, "range")["steps"][6]["state"] == "passed"
        first = review(client, "weight")
        present = [motor["gains"] for motor in first["review"]["motors"]]
        assert answer(client, first, action="take_back")["code"] == "gains_refused"
        too_much = [*present[:2], present[2] | {"d": 2 * present[2]["d"] + 1}, *present[3:]]
        assert answer(client, first, action="measure", gains=too_much)["code"] == "gains_refused"
        assert answer(client, first, action="measure", gains=present[:4])["code"] == "gains_refused"
        less = [*present[:2], present[2] | {"d": present[2]["d"] // 2}, *present[3:]]
        assert answer(client, first, action="measure", gains=less)["running"]
        assert answer(client, first, action="keep")["code"] == "other_instruction"
        tried = review(client, "weight")
        motor = tried["review"]["motors"][2]
        assert (motor["gains"], motor["former_gains"]) == (less[2], present[2])
        assert motor["response"]["overshoot"] > motor["former_response"]["overshoot"]
        assert len(tried["review"]["curves"]) == len(tried["review"]["former_curves"]) == 5
        answer(client, tried, action="take_back")
        again = review(client, "weight")
        assert [motor["gains"] for motor in again["review"]["motors"]] == present
        answer(client, again, action="measure", gains=less)
        answer(client, review(client, "weight"), action="keep")
        answer(client, review(client, "empty"), action="keep")
        ran = do(client, "gains")["steps"][8]["result"]
        assert ran["passed"], ran["fault"]
        kept = {
            value["motor"]: (value["before"], value["after"]) for value in ran["values"] if value["name"] == "d gain"
        }
        assert kept[3] == (present[2]["d"], less[2]["d"]) and kept[4] == (present[3]["d"], present[3]["d"])
        client.post("/api/station/stop")


def test_an_open_session_refuses_commissioning(tmp_path: Path) -> None:
    with running(tmp_path) as client:
        until(client, lambda live: live["mode"] == "idle")
        patient = client.post("/api/patients", json={"name": "Sato", "clinic_number": "1", "affected_side": "left"})
        assert patient.status_code == 201, patient.json()
        opened = client.post("/api/sessions", json={"patient_id": patient.json()["id"]})
        assert opened.status_code in (200, 201), opened.json()
        assert start(client, "full").json()["code"] == "session_open"


def test_a_therapist_may_not_commission(tmp_path: Path) -> None:
    with running(tmp_path, "therapist") as client:
        assert start(client, "full").status_code == 403


def begin_check(client: TestClient, until_asked: str) -> None:
    """Start the periodic check and wait for an instruction. On a busy computer a simulated drive may answer too late; then start again."""
    for _ in range(3):
        assert start(client, "check").json()["running"]
        while (now := state(client))["running"]:
            if (now["instruction"] or {}).get("kind") == until_asked:
                return
            time.sleep(0.05)
        until(client, lambda live: live["mode"] == "idle")
    raise AssertionError(now["steps"])


def test_a_real_station_is_checked_and_names_a_pulled_adapter(tmp_path: Path) -> None:
    with contextlib.closing(SimulatorProcess(tmp_path)) as apparatus:
        station = tmp_path / "station.toml"
        write_commissioned(simulated(apparatus.port), station)
        with running(tmp_path, "technician", simulate=False, station=station) as client:
            until(client, lambda live: live["mode"] == "idle")
            assert state(client)["may_check"] and state(client)["may_repeat"]
            begin_check(client, "press_estop")
            assert state(client)["instruction"]["press"] is False, "the drives show it"
            apparatus.close()
            end = time.monotonic() + _LIMIT_S
            while state(client)["running"] and time.monotonic() < end:
                time.sleep(0.05)
            failed = next(step for step in state(client)["steps"] if step["state"] == "failed")
            assert failed["key"] == "inputs"
            assert failed["result"]["fault"]


def test_commissioning_is_refused_if_its_record_could_not_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The drives stay with the control program. systemd's ProtectSystem=strict makes /etc read-only for the service."""
    station = tmp_path / "station.toml"
    write_commissioned(simulated("/dev/null"), station)
    run = commissioning_run.CommissioningRun(
        SimpleNamespace(info=SimpleNamespace(simulated=False)),  # type: ignore[arg-type]
        station,
        tmp_path,
        lambda config, name: None,
        lambda browser: None,
    )
    monkeypatch.setattr("os.access", lambda path, mode: Path(path) != tmp_path)
    refusal = asyncio.run(run.start("check", None, Browser(uuid4(), "Test technician"), set(), _GUARD))
    assert refusal is not None and refusal.code == "station_file_not_written"
    assert f"may not write to {tmp_path}" in refusal.message
    assert not run.running


def test_an_instruction_is_confirmed_once(tmp_path: Path) -> None:
    """A second confirmation that arrives before the procedure's answer must not replace the first one's choice."""
    run = commissioning_run.CommissioningRun(
        SimpleNamespace(info=SimpleNamespace(simulated=True)),  # type: ignore[arg-type]
        None,
        tmp_path,
        lambda config, name: None,
        lambda browser: None,
    )
    technician = Browser(uuid4(), "Test technician")
    run.progress = commissioning_run.RunProgress("full", technician.name, simulated=True)
    run.progress.instruction = {"number": 7, "press": True}
    assert run.confirm(7, technician, {"action": "measure"})
    assert not run.confirm(7, technician, {"action": "keep"})
    assert run.progress.presses == 1


class _SlowHandOver:
    """A station whose device process takes time to end. A second hand-over is refused meanwhile, as by :class:`Station`."""

    info = SimpleNamespace(simulated=True)
    operating = SimpleNamespace(shows=lambda browser: True)

    def __init__(self) -> None:
        self.stop: Any = None
        self.ended = asyncio.Event()

    async def hand_over(self, stop: Any, guard: Guard) -> Refusal | None:
        if self.stop is not None:
            return Refusal(code="commissioning_runs", message="", next_step="")
        self.stop = stop
        await self.ended.wait()
        return None

    def take_back(self, config: StationConfig | None) -> None:
        self.stop = None


def test_a_second_start_discards_no_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stop is pressed while the control program ends. A second browser starts the procedure, which is refused."""
    lines = tmp_path / "lines"
    program = tmp_path / "procedure.sh"
    program.write_text(f"#!/bin/sh\nhead -n 1 > {lines}\n")
    program.chmod(0o700)
    monkeypatch.setattr(commissioning_run, "sys", SimpleNamespace(executable=str(program)))
    technician = Browser(uuid4(), "Test technician")

    async def start_twice() -> None:
        station: Any = _SlowHandOver()
        run = commissioning_run.CommissioningRun(
            station, None, tmp_path, lambda config, name: None, lambda browser: None
        )
        first = asyncio.create_task(run.start("full", None, technician, set(), _GUARD))
        await asyncio.sleep(0)
        assert await station.stop() is None
        refusal = await run.start("full", None, Browser(uuid4(), "Second technician"), set(), _GUARD)
        assert refusal is not None and refusal.code == "commissioning_runs"
        station.ended.set()
        assert await first is None
        assert run._following is not None
        async with asyncio.timeout(_LIMIT_S):
            await run._following

    asyncio.run(start_twice())
    assert json.loads(lines.read_text()) == {"stop": True}


def test_a_confirmation_of_an_earlier_run_confirms_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A confirmation is delayed. Meanwhile the run ends, and the next run shows its own first instruction."""
    program = tmp_path / "procedure.sh"
    program.write_text(
        """#!/bin/sh\necho '{"event": "instruct", "number": 1, "press": true}'\nhead -n 1 >> """ f"{tmp_path}/lines\n"
    )
    program.chmod(0o700)
    monkeypatch.setattr(commissioning_run, "sys", SimpleNamespace(executable=str(program)))
    technician = Browser(uuid4(), "Test technician")

    async def run_twice() -> None:
        station: Any = _SlowHandOver()
        station.ended.set()
        run = commissioning_run.CommissioningRun(
            station, None, tmp_path, lambda config, name: None, lambda browser: None
        )
        numbers = []
        for _ in range(2):
            assert await run.start("full", None, technician, set(), _GUARD) is None
            assert run.progress is not None
            async with asyncio.timeout(_LIMIT_S):
                while run.progress.instruction is None:  # noqa: ASYNC110
                    await asyncio.sleep(0.01)
            numbers.append(run.progress.instruction["number"])
            if len(numbers) == 1:
                run._send({"stop": True})
            else:
                assert not run.confirm(numbers[0], technician)
                assert run.confirm(numbers[1], technician)
            assert run._following is not None
            async with asyncio.timeout(_LIMIT_S):
                await run._following

    asyncio.run(run_twice())
    lines = [json.loads(line) for line in (tmp_path / "lines").read_text().splitlines()]
    assert lines == [{"stop": True}, {"confirm": 1, "choice": {"action": "keep"}}]


def test_a_station_adopts_the_finished_configuration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program takes the place of the procedure and writes what it writes. The service uses it without a restart."""
    with contextlib.closing(SimulatorProcess(tmp_path)) as apparatus:
        station, finished = tmp_path / "station.toml", tmp_path / "finished.toml"
        draft = simulated(apparatus.port)
        config.write(draft, station)
        axes = tuple(
            structs.replace(axis, lag_s=0.07, position_d_gain=axis.position_d_gain + 60) for axis in draft.axes
        )
        write_commissioned(structs.replace(draft, axes=axes), finished)
        program = tmp_path / "procedure.sh"
        program.write_text(
            f"#!/bin/sh\ncp {finished} {station}\ncp {record_path(finished)} {record_path(station)}\n"
            """echo '{"event": "finished", "passed": true}'\n"""
        )
        program.chmod(0o700)
        monkeypatch.setattr(commissioning_run, "sys", SimpleNamespace(executable=str(program)))
        with running(tmp_path, "technician", simulate=False, station=station) as client:
            until(client, lambda live: live["mode"] == "idle")
            assert client.get("/api/station/commissioning").json()["state"] == "not_commissioned"
            start(client, "full")
            until(client, lambda live: live["mode"] == "idle" and live["refusals"].get("teach") is None)
            used = client.app.state.services.station.config  # type: ignore[attr-defined]
            assert used == config.read(station) and used.axes == axes
            assert client.get("/api/station/commissioning").json()["state"] == "commissioned"


@pytest.mark.campaign
def test_gains_are_tuned_again_on_a_commissioned_station(tmp_path: Path) -> None:
    with contextlib.closing(SimulatorProcess(tmp_path)) as apparatus:
        station = tmp_path / "station.toml"
        former = write_commissioned(simulated(apparatus.port), station)
        with running(tmp_path, "technician", simulate=False, station=station) as client:
            until(client, lambda live: live["mode"] == "idle")
            assert start(client, "full", begin="gains").json()["running"]
            end = time.monotonic() + _LIMIT_S
            while (now := state(client))["running"] and not now["instruction"] and time.monotonic() < end:
                time.sleep(0.05)
            assert now["instruction"]["kind"] == "free_arm"
            assert states(now) == ["passed"] * 8 + ["running", "waiting", "waiting"]
            client.post("/api/station/stop")
            until(client, lambda live: live["mode"] == "idle")
            assert states(state(client)) == ["passed"] * 8 + ["failed", "waiting", "waiting"]
            assert not state(client)["may_repeat"]
            assert client.get("/api/station/commissioning").json()["state"] == "not_commissioned"
        unfinished = read_record(record_path(station))
        assert unfinished and unfinished.previous == former.digest
        assert [step.step for step in own_steps(unfinished)] == ["gains"]


def test_a_lost_browser_stops_moving_motors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page of the browser listens, and is closed while motors have torque. Manual steps wait for the browser."""
    # Shorter than the waits below. Otherwise an instruction is shown for 30 s.
    monkeypatch.setattr(commissioning_run, "STOP_AND_END_LEASE_AFTER_S", 1.5 * PAUSE_AFTER_ABSENCE_S)
    with running(tmp_path, "technician") as client:
        until(client, lambda live: live["mode"] == "idle")
        run = client.app.state.services.commissioning_run  # type: ignore[attr-defined]
        start(client, "full")
        do(client, "registers")
        time.sleep(2 * PAUSE_AFTER_ABSENCE_S)
        assert run.running, "no motor has torque in this step"
        with open_page(client):
            do(client, "axes")
            while (instruction := run.progress.instruction) is None or not instruction["press"]:
                time.sleep(0.02)
            time.sleep(2 * PAUSE_AFTER_ABSENCE_S)
            assert run.running, "the page shows the live state"
            confirm(client, instruction["number"])
        began = time.monotonic()
        while run.running and time.monotonic() < began + _LIMIT_S:
            time.sleep(0.02)
        assert run.progress.ended[-1]["fault"] == device_texts.BROWSER_LOST(), run.progress.ended[-1]
        assert time.monotonic() - began > PAUSE_AFTER_ABSENCE_S
        until(client, lambda live: live["mode"] == "idle")
        with client.app.state.services.database.read() as session:  # type: ignore[attr-defined]
            assert "stop_without_browser" in session.scalars(select(AuditRow.action)).all()
