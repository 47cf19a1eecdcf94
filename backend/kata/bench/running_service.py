"""Starts the real service with a simulated apparatus for a benchmark, and uses it over HTTP as the page does."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Any, Final, Self
from urllib.error import HTTPError
from urllib.request import Request, urlopen
from uuid import UUID

import msgspec

from kata.bench.account import ACTIVE_HEADER
from kata.bench.commissioned import write_commissioned
from kata.bench.records import BenchRecords, make_records
from kata.device import config
from kata.device.config import StationConfig
from kata.device.ipc_messages import RESISTANCE_LEVELS
from kata.simulator.process import SimulatorProcess
from kata.station.schemas import Live

GUARDED: Final = frozenset({"approach", "play", "return", "release-torque", "acknowledge"})
"""Commands that carry the newest state that their sender has seen."""
_START_LIMIT_S: Final = 60.0
_ANSWER_LIMIT_S: Final = 60.0
_POLL_S: Final = 0.005
_READY: Final = "Kata is ready: "
WITHOUT_REAL_TIME: Final[Mapping[str, str]] = {"KATA_REAL_TIME": "0"}


class BenchError(Exception):
    """The benchmark failed. The exception's message states the reason."""


def prepare_records(data: Path, *, play_s: float, plot_s: float, database_url: str | None = None) -> BenchRecords:
    """Create the records of a benchmark: a recording that begins at the simulated arm's rest pose, and a run for plotting.

    Without ``database_url``, the database is a file in ``data``.
    """
    data.mkdir(parents=True, exist_ok=True)
    simulator = SimulatorProcess(data)
    try:
        with closing(simulator.client()) as hand:
            rest_deg = [axis.angle_deg for axis in hand.state().axes]
    finally:
        simulator.close()
    return make_records(data, rest_deg, play_s=play_s, plot_s=plot_s, database_url=database_url)


class RunningService:
    """A service process, its device process and a simulated apparatus. The end of the ``with`` block ends them.

    The simulator is a child process of the benchmark, which can read its state. For the service it is an ordinary station.
    """

    def __init__(
        self,
        data: Path,
        records: BenchRecords,
        *,
        cycle_hz: int,
        rate_hz: int,
        settings: Mapping[str, str] = MappingProxyType({}),
        name: str = "Benchmark",
    ) -> None:
        """Start the processes. ``settings``: environment variables of the service. ``name``: name of the station."""
        self.cookie = records.cookie
        self.simulator = SimulatorProcess(data)
        self.hand = self.simulator.client()
        station = data / "station.toml"
        usual = msgspec.structs.replace(config.simulated(self.simulator.port), name=name)
        station_config = at_cycle_rate(usual, cycle_hz, rate_hz)
        # The service treats this apparatus as a real one, which must be commissioned.
        write_commissioned(station_config, station)
        self._log_path = data / "service.log"
        self._log_path.write_text("")
        self._log = self._log_path.open("ab")
        # Ignore this user's settings for another clinic.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("KATA_")}
        # All clients of a benchmark have the same address, unlike those of a clinic.
        environment |= {"COLUMNS": "200", "KATA_CONNECTIONS_PER_ADDRESS": "1000", **settings}
        if records.database_url:
            environment["KATA_DATABASE_URL"] = records.database_url
        command = [sys.executable, "-m", "kata", "serve", "--port", "0"]
        self._service = subprocess.Popen(
            [*command, "--station", str(station), "--data", str(data)],
            stderr=self._log,
            env=environment,
            start_new_session=True,
        )
        self.url = ""

    def __enter__(self) -> Self:
        try:
            self.url = self._wait_until_ready()
            self.until(lambda live: live.mode == "idle", _START_LIMIT_S)
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    @property
    def service_pid(self) -> int:
        """Process id of the service."""
        return self._service.pid

    @property
    def device_pid(self) -> int:
        """Process id of the device process.

        :raises BenchError: when it has ended.
        """
        for pid in children(self._service.pid):
            if b"kata.device" in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0"):
                return pid
        raise BenchError("the device process is gone")

    @property
    def service_mb(self) -> float:
        """Resident memory of the service's process in MB.

        :raises BenchError: when it has ended.
        """
        return rss_mb(self._service.pid)

    def live(self) -> Live:
        """Return the newest state."""
        return Live.model_validate(self._request("GET", "/api/station")["live"])

    def until(self, condition: Callable[[Live], object], within_s: float) -> Live:
        """Wait until the condition holds. Return the state.

        :raises BenchError: when it does not hold in time.
        """
        limit = time.monotonic() + within_s
        while not condition(live := self.live()):
            if time.monotonic() > limit:
                raise BenchError(f"the apparatus is {live.mode} after {within_s:.0f} s; {causes(live)}")
            time.sleep(_POLL_S)
        return live

    def command(self, name: str, **body: object) -> str | None:
        """Send a command. Return the code of its refusal; None if it is accepted.

        :raises BenchError: when the service answers with another error.
        """
        return self._post(f"/api/station/{name}", body | (self._guard_body() if name in GUARDED else {}))

    def insist(self, name: str, within_s: float = 5.0, **body: object) -> None:
        """Send a command until it is accepted.

        :raises BenchError: when it is still refused after ``within_s``.
        """
        self._until_accepted(name, lambda: self.command(name, **body), within_s)

    def begin_next_session(self, records: BenchRecords) -> BenchRecords:
        """End the patient's session when its runs are saved, and begin the next session. Return the records with its id."""
        session_path = f"/api/sessions/{records.session_id}"
        self._until_accepted("end", lambda: self._post(f"{session_path}/end", {}), _ANSWER_LIMIT_S)
        patient_id = self._request("GET", session_path)["patient"]["id"]
        return replace(
            records, session_id=UUID(self._request("POST", "/api/sessions", {"patient_id": patient_id})["id"])
        )

    def approach(self, records: BenchRecords) -> None:
        """Load the recording and approach its start, which switches torque on. The apparatus must be idle."""
        self._go_through_checklist(records)
        session_id, recording_id = str(records.session_id), str(records.recording_id)
        self.insist("load", session_id=session_id, recording_id=recording_id, resistance_level=RESISTANCE_LEVELS)
        self.insist("approach")

    def play(self, records: BenchRecords) -> None:
        """Load the recording, approach its start and play it. The apparatus must be idle."""
        self.approach(records)
        self.until(lambda live: live.mode == "paused", 30.0)
        self.insist("play")

    def _go_through_checklist(self, records: BenchRecords) -> None:
        """Answer the open checks of the checklist, as a therapist would."""
        path = f"/api/sessions/{records.session_id}/checklist"
        about = f"?recording_id={records.recording_id}"
        for check in self._open_checks(path + about):
            if check == "estop":
                self._test_estop(path + about)
            else:
                body: dict[str, object] = {"checked_by": "Benchmark", "recording_id": str(records.recording_id)}
                if check == "identity":
                    body["identifiers"] = ["name", "clinic_number"]
                self._request("PUT", f"{path}/{check}", body)

    def _test_estop(self, checklist: str) -> None:
        self.hand.estop(True)
        self.until(lambda live: live.estop == "pressed", _ANSWER_LIMIT_S)
        self.hand.estop(False)
        self.until(lambda live: live.estop == "released", _ANSWER_LIMIT_S)
        self.insist("acknowledge")
        limit = time.monotonic() + _ANSWER_LIMIT_S
        while "estop" in self._open_checks(checklist):
            if time.monotonic() > limit:
                raise BenchError("the test of the emergency stop was not detected")
            time.sleep(_POLL_S)

    def _post(self, path: str, body: object) -> str | None:
        try:
            self._request("POST", path, body)
        except HTTPError as error:
            problem = json.loads(error.read())
            if error.code != 409:
                raise BenchError(f"{path}: {problem.get('detail', error)}") from error
            return str(problem["code"])
        return None

    def _until_accepted(self, action: str, ask: Callable[[], str | None], within_s: float) -> None:
        limit = time.monotonic() + within_s
        while refusal := ask():
            if time.monotonic() > limit:
                raise BenchError(f"{action} is still refused after {within_s:.0f} s: {refusal}; {causes(self.live())}")
            time.sleep(_POLL_S)

    def _guard_body(self) -> dict[str, object]:
        """Return the body of a guarded command, based on the newest state."""
        live = self._request("GET", "/api/station")["live"]
        return {"stops": live["stops"], "seen_at": live["at"]}

    def _open_checks(self, checklist: str) -> list[str]:
        return [check["check"] for check in self._request("GET", checklist)["checks"] if not check["given"]]

    def _request(self, method: str, path: str, body: object = None) -> Any:
        request = Request(self.url + path, method=method, headers={"Cookie": self.cookie} | ACTIVE_HEADER)
        if method != "GET":
            request.add_header("Content-Type", "application/json")
            request.data = json.dumps(body or {}).encode()
        with urlopen(request, timeout=_ANSWER_LIMIT_S) as answer:
            return json.load(answer)

    def _wait_until_ready(self) -> str:
        limit = time.monotonic() + _START_LIMIT_S
        while _READY not in (text := self._log_path.read_text()):
            if self._service.poll() is not None or time.monotonic() > limit:
                raise BenchError(f"the service did not start: {text[-500:].strip()}")
            time.sleep(0.02)
        return text.partition(_READY)[2].split()[0]

    def _end(self) -> None:
        self._service.terminate()
        try:
            self._service.wait(20.0)
        except subprocess.TimeoutExpired:
            self._service.kill()
            self._service.wait()
        self.hand.close()
        self.simulator.close()
        self._log.close()


def at_cycle_rate(usual: StationConfig, cycle_hz: int, rate_hz: int) -> StationConfig:
    """Return a station with other rates. At a lower rate the same age of the inputs is fewer cycles."""
    usual_cycles = usual.inputs.max_age_cycles
    max_age_cycles = min(usual_cycles, usual_cycles * cycle_hz // usual.cycle_hz)
    inputs = msgspec.structs.replace(usual.inputs, max_age_cycles=max_age_cycles)
    return msgspec.structs.replace(usual, cycle_hz=cycle_hz, rate_hz=rate_hz, inputs=inputs)


def rss_mb(pid: int) -> float:
    """Return the resident memory of a process in MB.

    :raises BenchError: when it has ended.
    """
    resident = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    if not resident:
        raise BenchError("a process has ended")
    return int(resident[1]) / 1024


def cpu_s(pid: int, *, with_ended_children: bool = False) -> float:
    """Return the processor time of a process in seconds.

    :raises OSError: when it has ended.
    """
    times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    counted = times[11:15] if with_ended_children else times[11:13]
    return sum(map(int, counted)) / os.sysconf("SC_CLK_TCK")


def causes(live: Live) -> Sequence[str]:
    """Return the codes of a stop's causes in order; empty without a stop."""
    return [cause.code for cause in live.stop.causes] if live.stop else []


def children(pid: int) -> list[int]:
    """Return the process ids of a process's children."""
    return [
        int(child) for task in Path(f"/proc/{pid}/task").iterdir() for child in (task / "children").read_text().split()
    ]
