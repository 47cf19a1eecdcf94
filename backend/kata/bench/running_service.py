"""The real service on a simulated apparatus, started for a benchmark and driven over HTTP as a page drives it."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self
from urllib.error import HTTPError
from urllib.request import Request, urlopen
from uuid import UUID

import msgspec

from kata.bench.account import ACTIVE_HEADER
from kata.bench.records import BenchRecords, make_records
from kata.device import config
from kata.device.messages import LOAD_LEVELS
from kata.simulator.process import SimulatorProcess
from kata.station.schemas import Live

GUARDED: Final = frozenset({"approach", "play", "return", "release-torque", "acknowledge"})
"""Commands that carry the state that their sender saw last."""
_START_LIMIT_S: Final = 60.0
_ANSWER_LIMIT_S: Final = 60.0
_LOOK_AGAIN_S: Final = 0.005
_READY: Final = "Kata is ready: "


class BenchError(Exception):
    """The benchmark could not go on; the message says why."""


def prepare_records(data: Path, *, play_s: float, plot_s: float, database_url: str | None = None) -> BenchRecords:
    """The records of a benchmark: a recording to play that begins where the simulated arm rests, and a run to draw.

    ``database_url`` None: in a file in ``data``.
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
    """A service process, its device process and a simulated apparatus; ends them with the ``with`` block.

    The simulator is the benchmark's own child, so that what it saw can be asked for: the service has a station as any.
    """

    def __init__(
        self,
        data: Path,
        records: BenchRecords,
        *,
        cycle_hz: int,
        rate_hz: int,
        real_time: bool = True,
        name: str = "Benchmark",
        database_url: str | None = None,
    ) -> None:
        """``data`` holds the records, unless ``database_url`` does; ``name`` is the station's."""
        self.cookie = records.cookie
        self.simulator = SimulatorProcess(data)
        self.hand = self.simulator.client()
        station = data / "station.toml"
        station_config = msgspec.structs.replace(
            config.simulated(self.simulator.port), name=name, cycle_hz=cycle_hz, rate_hz=rate_hz
        )
        config.write(station_config, station)
        self._log_path = data / "service.log"
        self._log_path.write_text("")
        self._log = self._log_path.open("ab")
        # What this user has set for a clinic of their own is not for this one.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("KATA_")}
        environment |= {"COLUMNS": "200", "KATA_REAL_TIME": "1" if real_time else "0"}
        if database_url:
            environment["KATA_DATABASE_URL"] = database_url
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
        """The service's process."""
        return self._service.pid

    @property
    def device_pid(self) -> int:
        """The device process."""
        for pid in children(self._service.pid):
            if b"kata.device" in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0"):
                return pid
        raise BenchError("the device process is gone")

    @property
    def service_mb(self) -> float:
        """Memory that the service's process really occupies.

        :raises BenchError: when it has ended.
        """
        return rss_mb(self._service.pid)

    def live(self) -> Live:
        """The newest state."""
        return Live.model_validate(self._ask("GET", "/api/station")["live"])

    def until(self, condition: Callable[[Live], object], within_s: float) -> Live:
        """Look until it holds.

        :raises BenchError: when it does not in time.
        """
        limit = time.monotonic() + within_s
        while not condition(live := self.live()):
            if time.monotonic() > limit:
                raise BenchError(f"the apparatus is {live.mode} after {within_s:.0f} s; {causes(live)}")
            time.sleep(_LOOK_AGAIN_S)
        return live

    def command(self, name: str, **body: object) -> str | None:
        """Ask for it; the refusal's code when it is refused.

        :raises BenchError: when the service cannot answer.
        """
        return self._post(f"/api/station/{name}", body | (self._seen() if name in GUARDED else {}))

    def insist(self, name: str, within_s: float = 5.0, **body: object) -> None:
        """Ask for it until it is accepted.

        :raises BenchError: when it is not in time.
        """
        self._until_accepted(name, lambda: self.command(name, **body), within_s)

    def begin_another(self, records: BenchRecords) -> BenchRecords:
        """The patient's session ends, as soon as what was played in it is kept, and the next one begins."""
        here = f"/api/sessions/{records.session_id}"
        self._until_accepted("end", lambda: self._post(f"{here}/end", {}), _ANSWER_LIMIT_S)
        patient_id = self._ask("GET", here)["patient"]["id"]
        return replace(records, session_id=UUID(self._ask("POST", "/api/sessions", {"patient_id": patient_id})["id"]))

    def approach(self, records: BenchRecords) -> None:
        """From idle: load the recording and go to its start, which switches torque on."""
        self._go_through_checklist(records)
        session_id, recording_id = str(records.session_id), str(records.recording_id)
        self.insist("load", session_id=session_id, recording_id=recording_id, load_level=LOAD_LEVELS)
        self.insist("approach")

    def play(self, records: BenchRecords) -> None:
        """From idle: load, approach and play."""
        self.approach(records)
        self.until(lambda live: live.mode == "paused", 30.0)
        self.insist("play")

    def _go_through_checklist(self, records: BenchRecords) -> None:
        """As a therapist would; what is given already is not asked again."""
        path = f"/api/sessions/{records.session_id}/checklist"
        about = f"?recording_id={records.recording_id}"
        for check in self._still_open(path + about):
            if check == "estop":
                self._try_estop(path + about)
            else:
                body = {"checked_by": "Benchmark", "recording_id": str(records.recording_id)}
                self._ask("PUT", f"{path}/{check}", body)

    def _try_estop(self, checklist: str) -> None:
        self.hand.estop(True)
        self.until(lambda live: live.estop == "pressed", _ANSWER_LIMIT_S)
        self.hand.estop(False)
        self.until(lambda live: live.estop == "released", _ANSWER_LIMIT_S)
        self.insist("acknowledge")
        limit = time.monotonic() + _ANSWER_LIMIT_S
        while "estop" in self._still_open(checklist):
            if time.monotonic() > limit:
                raise BenchError("that the emergency stop was tried is not written down")
            time.sleep(_LOOK_AGAIN_S)

    def _post(self, path: str, body: object) -> str | None:
        try:
            self._ask("POST", path, body)
        except HTTPError as error:
            told = json.loads(error.read())
            if error.code != 409:
                raise BenchError(f"{path}: {told.get('detail', error)}") from error
            return str(told["code"])
        return None

    def _until_accepted(self, what: str, ask: Callable[[], str | None], within_s: float) -> None:
        limit = time.monotonic() + within_s
        while refusal := ask():
            if time.monotonic() > limit:
                raise BenchError(f"{what} is still refused after {within_s:.0f} s: {refusal}; {causes(self.live())}")
            time.sleep(_LOOK_AGAIN_S)

    def _seen(self) -> dict[str, object]:
        """Return the body of a guarded command that is based on the newest state."""
        live = self._ask("GET", "/api/station")["live"]
        return {"stops": live["stops"], "seen_at": live["at"]}

    def _still_open(self, checklist: str) -> list[str]:
        return [one["check"] for one in self._ask("GET", checklist)["checks"] if not one["given"]]

    def _ask(self, method: str, path: str, body: object = None) -> Any:
        request = Request(self.url + path, method=method, headers={"Cookie": self.cookie} | ACTIVE_HEADER)
        if method != "GET":
            request.add_header("Content-Type", "application/json")
            request.data = json.dumps(body or {}).encode()
        with urlopen(request, timeout=_ANSWER_LIMIT_S) as answer:
            return json.load(answer)

    def _wait_until_ready(self) -> str:
        limit = time.monotonic() + _START_LIMIT_S
        while _READY not in (told := self._log_path.read_text()):
            if self._service.poll() is not None or time.monotonic() > limit:
                raise BenchError(f"the service did not start: {told[-500:].strip()}")
            time.sleep(0.02)
        return told.partition(_READY)[2].split()[0]

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


def rss_mb(pid: int) -> float:
    """Memory that a process really occupies.

    :raises BenchError: when it has ended.
    """
    found = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    if not found:
        raise BenchError("a process has ended")
    return int(found[1]) / 1024


def causes(live: Live) -> Sequence[str]:
    """Codes of a stop's causes, first one first; none without a stop."""
    return [cause.code for cause in live.stop.causes] if live.stop else []


def children(pid: int) -> list[int]:
    """The processes that a process has started and that still are its own."""
    return [
        int(child) for task in Path(f"/proc/{pid}/task").iterdir() for child in (task / "children").read_text().split()
    ]
