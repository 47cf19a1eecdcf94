"""Implements ``python -m benchmarks footprint``: measures memory of each process, idle processor time, and bytes written to the disk."""

import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final
from urllib.request import Request, urlopen

from kata.bench.account import ACTIVE_HEADER
from kata.bench.page_load import page_load
from kata.bench.records import BenchRecords
from kata.bench.report import Report
from kata.bench.running_service import RunningService, causes, children, cpu_s, prepare_records

_RATE_HZ: Final = 100
_MB: Final = 1e6
_KIB: Final = 1024
_SETTLE_S: Final = 40.0
"""Longer than the service waits until it starts the figure worker, so that the worker counts as idle memory."""
_ACTIVITY_S: Final = 60.0
_REPLACED_S: Final = 10.0
"""A new worker has started, and the former one has ended, within this time."""
_ACKNOWLEDGED_S: Final = 60.0
"""The drives are verified and the arm is at rest within this time."""
_NAMES: Final = (
    ("kata.device.reference_builder", "reference builder"),
    ("kata.device", "device"),
    ("kata.simulator", "simulator"),
    ("spawn_main", "worker"),
    ("resource_tracker", "resource tracker"),
)
"""Pairs of a word in the command line and the process's name."""
_PART_OF_KATA: Final = ("service", "worker", "device", "reference builder", "resource tracker")


@dataclass(frozen=True)
class Process:
    """The resources of a process at one moment."""

    name: str
    pss_mb: float
    """Proportional set size: memory of the process, with its part of the pages that several processes share."""
    locked_mb: float
    cpu_s: float
    written: int
    """Bytes that the process has caused to be written to a disk."""


def run(seconds: float, progress: Callable[[str], None]) -> Report:
    """Measure a service with one open page: idle, then playing, each for ``seconds``. A stopped playback begins again.

    :raises BenchError: when a playback cannot begin.
    """
    report = Report(
        f"Footprint at {_RATE_HZ} Hz, one page open, {seconds:g} s idle and {seconds:g} s of playing",
        (
            "Process",
            "PSS idle, MB",
            "PSS later, MB",
            "locked, MB",
            "CPU idle, %",
            "written idle, MB/h",
            "playing, MB/h",
        ),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        records = prepare_records(Path(folder), play_s=seconds + 2 * _SETTLE_S, plot_s=60.0)
        with (
            RunningService(Path(folder), records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ) as service,
            page_load(service, None, pages=1),
        ):
            progress("Settling")
            time.sleep(_SETTLE_S)
            progress("Idle")
            idle = _between(service, seconds, service.live)
            progress("Playing")
            playback = _Playback(service, records)
            playing = _between(service, seconds, playback.resume)
            playback.end()
            # The next session begins when the playback is imported. Without this wait, the import was missing from "later" by chance.
            service.begin_next_session(records)
            _use_worker(service, records)
            later = {process.name: process for process in _processes(service.service_pid)}
    for name, (first, last) in idle.items():
        used = {
            "pss_idle_mb": last.pss_mb,
            "pss_later_mb": later[name].pss_mb,
            "locked_mb": later[name].locked_mb,
            "cpu_idle_percent": 100 * (last.cpu_s - first.cpu_s) / seconds,
            "written_idle_mb_h": _per_hour(first, last, seconds),
            "written_playing_mb_h": _per_hour(*playing[name], seconds) if name in playing else 0.0,
        }
        report.figures |= {f"footprint_{name.replace(' ', '_')}_{figure}": value for figure, value in used.items()}
        report.rows.append((name, *(f"{value:.1f}" for value in used.values())))
    for when, mb in (
        ("idle", sum(last.pss_mb for name, (_, last) in idle.items() if name in _PART_OF_KATA)),
        ("later", sum(process.pss_mb for name, process in later.items() if name in _PART_OF_KATA)),
    ):
        report.figures[f"footprint_pss_{when}_mb"] = mb
        report.notes.append(f"Together without the simulator, {when}: {mb:.0f} MB.")
    report.notes += [
        f"The apparatus stopped while playing and was started again: {', '.join(stop)}." for stop in playback.stops
    ]
    report.notes.append(
        "later: after a playback, its import, a figure and a printed report. PSS: a shared page counts in parts."
    )
    return report


class _Playback:
    """A playback that begins again when the apparatus stops, which it does when other programs keep a small computer busy."""

    def __init__(self, service: RunningService, records: BenchRecords) -> None:
        self._service = service
        self._records = records
        self.stops: list[Sequence[str]] = []
        """Causes of each stop."""
        service.play(records)

    def resume(self) -> None:
        """Play again if the apparatus has stopped."""
        live = self._service.live()
        if live.stop:
            self.stops.append(causes(live))
            self._service.insist("acknowledge", _ACKNOWLEDGED_S)
            self._service.play(self._records)

    def end(self) -> None:
        """End the playback with a Stop and acknowledge it, so that its run is imported."""
        self._service.command("stop")
        self._service.insist("acknowledge", _ACKNOWLEDGED_S)
        self._service.until(lambda live: live.mode == "idle", _ACKNOWLEDGED_S)


def _between(service: RunningService, seconds: float, look: Callable[[], object]) -> dict[str, tuple[Process, Process]]:
    """Return the resources of each process before and after ``seconds``, by name. ``look`` is called once a minute."""
    before = {process.name: process for process in _processes(service.service_pid)}
    until_s = time.monotonic() + seconds
    while (left_s := until_s - time.monotonic()) > 0:
        time.sleep(min(left_s, _ACTIVITY_S))
        # Without a request the service locks the screen after fifteen minutes and then refuses the playback.
        look()
    after = {process.name: process for process in _processes(service.service_pid)}
    return {name: (before[name], after[name]) for name in before if name in after}


def _per_hour(first: Process, last: Process, seconds: float) -> float:
    return (last.written - first.written) / seconds * 3600 / _MB


def _use_worker(service: RunningService, records: BenchRecords) -> None:
    """Request a figure and a printed report, as the page does. Wait until a worker that has become large is replaced."""
    for path in (f"runs/{records.run_id}/figures", f"sessions/{records.session_id}/report.pdf?language=ja"):
        request = Request(f"{service.url}/api/{path}", headers={"Cookie": service.cookie} | ACTIVE_HEADER)
        with urlopen(request, timeout=60.0) as answer:
            answer.read()
    time.sleep(_REPLACED_S)


def _processes(service_pid: int) -> Iterator[Process]:
    """Yield the service's process and all its descendants."""
    waiting = [service_pid]
    while waiting:
        pid = waiting.pop(0)
        waiting += children(pid)
        yield _process(pid, "service" if pid == service_pid else _name(pid))


def _name(pid: int) -> str:
    command = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    return next((name for word, name in _NAMES if word in command), command.strip())


def _process(pid: int, name: str) -> Process:
    folder = Path(f"/proc/{pid}")
    memory = (folder / "smaps_rollup").read_text()
    return Process(
        name=name,
        pss_mb=_number(r"^Pss:\s+(\d+) kB", memory) * _KIB / _MB,
        locked_mb=_number(r"^Locked:\s+(\d+) kB", memory) * _KIB / _MB,
        cpu_s=cpu_s(pid),
        written=_number(r"^write_bytes: (\d+)", (folder / "io").read_text()),
    )


def _number(pattern: str, text: str) -> int:
    found = re.search(pattern, text, re.MULTILINE)
    return int(found[1]) if found else 0
