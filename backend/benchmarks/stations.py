"""Implements ``python -m benchmarks stations``: runs several stations of one clinic on one PostgreSQL, each with its own service,
apparatus and open pages. Measures the delay until one station shows an event at another, the cycles missed while the database hangs, and
what the stations need of the database.
"""

import random
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import msgspec
import numpy as np
from sqlalchemy import create_engine, text
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from benchmarks import postgresql
from kata.bench.page_load import page_load
from kata.bench.records import BenchRecords
from kata.bench.report import Report
from kata.bench.running_service import BenchError, RunningService, causes, cpu_s, prepare_records

_CONNECTIONS_PER_STATION: Final = 20
"""A service opens up to 17."""
_CONNECTIONS: Final = "select count(*) - 1 from pg_stat_activity where backend_type = 'client backend'"
"""Without the connection that asks."""
_SPARE_S: Final = 20.0
"""Playing time for each station, because the stations begin to play one after the other."""
_SEEN_LIMIT_S: Final = 10.0
_DELIVERED_LIMIT_S: Final = 60.0
_LONGEST_PAUSE_S: Final = 0.3


class _State(msgspec.Struct):
    estop: str


class _Shown(msgspec.Struct):
    name: str
    state: _State | None


class _Message(msgspec.Struct):
    stations: list[_Shown]


_MESSAGE: Final = msgspec.json.Decoder(_Message)


@dataclass(frozen=True)
class _Station:
    name: str
    service: RunningService
    records: BenchRecords


class _Watcher:
    """A client of one station that watches all stations."""

    def __init__(self, at: RunningService) -> None:
        self._socket = connect(
            at.url.replace("http", "ws", 1) + "/api/stations/live", additional_headers={"Cookie": at.cookie}
        )
        self._estop: dict[str, tuple[str, float]] = {}
        """The shown state of each station's emergency stop, and the time of its change on the monotonic clock."""
        self._changed = threading.Condition()
        threading.Thread(target=self._read, daemon=True).start()

    def shown(self, station: str, estop: str) -> float:
        """Wait until this state is shown. Return the time of the change on the monotonic clock.

        :raises BenchError: when the state is not shown in time.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: self._estop.get(station, ("", 0.0))[0] == estop, _SEEN_LIMIT_S):
                raise BenchError(f"another station does not show that the e-stop of {station} is {estop}")
            return self._estop[station][1]

    def close(self) -> None:
        self._socket.close()

    def _read(self) -> None:
        try:
            for message in self._socket:
                now_s = time.monotonic()
                with self._changed:
                    for station in _MESSAGE.decode(message).stations:
                        estop = station.state.estop if station.state else ""
                        if self._estop.get(station.name, ("", 0.0))[0] != estop:
                            self._estop[station.name] = estop, now_s
                    self._changed.notify_all()
        except ConnectionClosed:
            return


def run(
    stations: int, presses: int, seconds: float, pages: int, rate_hz: int, progress: Callable[[str], None]
) -> Report:
    """Press emergency stops. Then play at all stations for ``seconds`` with the database, and for ``seconds`` while it hangs; with 0 do
    not play.

    ``pages``: the number of open pages of all stations together; each station has at least one. ``rate_hz``: rate of the control loops.

    :raises BenchError: when PostgreSQL is missing, or an apparatus stops.
    """
    pages_each = max(1, pages // stations)
    report = Report(
        f"{stations} stations on one PostgreSQL, {rate_hz} Hz and {pages_each} pages each",
        ("", "p50", "p99", "largest", "all together"),
    )
    connections = max(100, stations * _CONNECTIONS_PER_STATION)
    with (
        TemporaryDirectory(prefix="kata-bench-") as folder,
        postgresql.serving(max_connections=connections) as url,
        ExitStack() as stack,
    ):
        server = postgresql.Server(url)
        progress("Starting services and apparatuses")
        stations_running = [
            _start(stack, Path(folder), f"Station {n}", server, 2 * seconds + stations * _SPARE_S, rate_hz)
            for n in range(1, stations + 1)
        ]
        # Without an open page the service would pause the apparatus.
        for station in stations_running:
            stack.enter_context(page_load(station.service, None, pages_each))
        progress("Pressing emergency stops")
        with _measured_load(report, server, stations_running, "at_rest"):
            delays_ms = _delays_ms(stations_running, presses)
        _add_row(report, "delay of the overview, ms", "overview_delay_ms", delays_ms)
        if seconds:
            _play(report, server, stations_running, seconds, progress)
    report.notes.append(
        "delay of the overview: from the opening of an emergency stop's contact until another station's WebSocket shows it."
    )
    return report


def _start(
    stack: ExitStack, folder: Path, name: str, server: postgresql.Server, play_s: float, rate_hz: int
) -> _Station:
    data = folder / name
    records = prepare_records(data, play_s=play_s, plot_s=1.0, database_url=server.url)
    service = RunningService(data, records, cycle_hz=rate_hz, rate_hz=rate_hz, name=name)
    return _Station(name, stack.enter_context(service), records)


def _play(
    report: Report,
    server: postgresql.Server,
    stations_running: Sequence[_Station],
    seconds: float,
    progress: Callable[[str], None],
) -> None:
    """Play at all stations for ``seconds`` with the database, and for ``seconds`` while it hangs."""
    progress("Playing with the database")
    before_mb = [station.service.service_mb for station in stations_running]
    for station in stations_running:
        station.service.play(station.records)
    with _measured_load(report, server, stations_running, "playing"):
        missed = _missed(stations_running, seconds)
    _add_row(report, f"cycles missed in {seconds:g} s, with the database", "missed", missed)
    progress("Playing while the database hangs")
    with server.hanging():
        missed = _missed(stations_running, seconds)
    _add_row(report, f"cycles missed in {seconds:g} s, while it hangs", "missed_hanging", missed)
    progress("Waiting for the spool")
    for station in stations_running:
        station.service.until(
            lambda live: live.database.waiting == 0 and not live.database.unavailable_since, _DELIVERED_LIMIT_S
        )
    growth_mb = [station.service.service_mb - mb for station, mb in zip(stations_running, before_mb, strict=True)]
    _add_row(report, "growth of a service's memory, MB", "growth_mb", growth_mb)


@contextmanager
def _measured_load(
    report: Report, server: postgresql.Server, stations_running: Sequence[_Station], when: str
) -> Iterator[None]:
    """Add the processor time during the block to the report, and the database's connections at its end."""
    shown = when.replace("_", " ")
    services = [station.service.service_pid for station in stations_running]
    devices = [station.service.device_pid for station in stations_running]
    used_s: dict[str, Callable[[], float]] = {
        "database": server.cpu_s,
        "services": lambda: sum(map(cpu_s, services)),
        "devices": lambda: sum(map(cpu_s, devices)),
    }
    began_s, before = time.monotonic(), {name: used() for name, used in used_s.items()}
    yield
    seconds = time.monotonic() - began_s
    for name, used in used_s.items():
        percent = 100 * (used() - before[name]) / seconds
        report.figures[f"cpu_{name}_{when}_percent"] = percent
        report.rows.append((f"{shown}: processor time of the {name}, % of a core", "", "", "", f"{percent:.1f}"))
    engine = create_engine(server.url)
    with engine.connect() as asking:
        connections = asking.execute(text(_CONNECTIONS)).scalar_one()
    engine.dispose()
    report.figures[f"connections_{when}"] = connections
    report.rows.append((f"{shown}: connections of the database", "", "", "", f"{connections}"))


def _delays_ms(stations_running: Sequence[_Station], presses: int) -> list[float]:
    watchers = [_Watcher(station.service) for station in stations_running]
    found: list[float] = []
    for n in range(presses):
        pressed, watcher = stations_running[n % len(stations_running)], watchers[(n + 1) % len(stations_running)]
        watcher.shown(pressed.name, "closed")
        time.sleep(random.uniform(0.0, _LONGEST_PAUSE_S))
        began_s = time.monotonic()
        pressed.service.hand.estop(True)
        found.append((watcher.shown(pressed.name, "pressed") - began_s) * 1000)
        pressed.service.hand.estop(False)
        watcher.shown(pressed.name, "released")
        pressed.service.insist("acknowledge")
    for watcher in watchers:
        watcher.close()
    return found


def _missed(stations_running: Sequence[_Station], seconds: float) -> list[float]:
    """Return the number of cycles that each station misses in ``seconds``."""
    before = [_overruns(station) for station in stations_running]
    time.sleep(seconds)
    return [_overruns(station) - overruns for station, overruns in zip(stations_running, before, strict=True)]


def _overruns(station: _Station) -> int:
    live = station.service.live()
    if live.mode != "playing" or live.loop is None:
        raise BenchError(f"{station.name} is {live.mode} instead of playing; {causes(live)}")
    return live.loop.overruns


def _add_row(report: Report, what: str, figure: str, values: Sequence[float]) -> None:
    p50, p99, largest = (float(value) for value in np.percentile(values, (50, 99, 100)))
    report.figures |= {f"{figure}_p50": p50, f"{figure}_p99": p99, f"{figure}_max": largest}
    together = "" if figure.endswith("delay_ms") else f"{sum(values):.0f}"
    report.rows.append((what, f"{p50:.1f}", f"{p99:.1f}", f"{largest:.1f}", together))
