"""``kata bench stations``: several stations of one clinic on one PostgreSQL, each a service with an apparatus of its own: how soon one
shows what happens at another, and what a database that hangs costs them while they play.
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
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from benchmarks import postgresql
from kata.bench.page_load import page_load
from kata.bench.records import BenchRecords
from kata.bench.report import Report
from kata.bench.running_service import BenchError, RunningService, causes, prepare_records

_RATE_HZ: Final = 100
_SPARE_S: Final = 60.0
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
    """Somebody who samples at all stations at one of them."""

    def __init__(self, at: RunningService) -> None:
        self._socket = connect(
            at.url.replace("http", "ws", 1) + "/api/stations/live", additional_headers={"Cookie": at.cookie}
        )
        self._estop: dict[str, tuple[str, float]] = {}
        """By station: as it is shown, and since when, by the monotonic clock."""
        self._news = threading.Condition()
        threading.Thread(target=self._read, daemon=True).start()

    def shown(self, station: str, estop: str) -> float:
        """When this was shown, by the monotonic clock; waits for it.

        :raises BenchError: when it is not for seconds.
        """
        with self._news:
            if not self._news.wait_for(lambda: self._estop.get(station, ("", 0.0))[0] == estop, _SEEN_LIMIT_S):
                raise BenchError(f"another station does not show that the e-stop of {station} is {estop}")
            return self._estop[station][1]

    def close(self) -> None:
        self._socket.close()

    def _read(self) -> None:
        try:
            for message in self._socket:
                now_s = time.monotonic()
                with self._news:
                    for one in _MESSAGE.decode(message).stations:
                        told = one.state.estop if one.state else ""
                        if self._estop.get(one.name, ("", 0.0))[0] != told:
                            self._estop[one.name] = told, now_s
                    self._news.notify_all()
        except ConnectionClosed:
            return


def run(stations: int, presses: int, seconds: float, progress: Callable[[str], None]) -> Report:
    """Press emergency stops, then play at all of them at once: ``seconds`` with the database, and as long while it hangs.

    :raises BenchError: when there is no PostgreSQL, or an apparatus stops by itself.
    """
    report = Report(
        f"{stations} stations on one PostgreSQL, {_RATE_HZ} Hz each", ("", "p50", "p99", "largest", "all together")
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder, _server() as server, ExitStack() as stack:
        progress("Starting services and apparatuses")
        there = [
            _start(stack, Path(folder), f"Station {n}", server, 2 * seconds + _SPARE_S) for n in range(1, stations + 1)
        ]
        progress("Pressing emergency stops")
        _tell(report, "delay of the overview, ms", "overview_delay_ms", _delays_ms(there, presses))
        progress("Playing with the database")
        before_mb = [one.service.service_mb for one in there]
        for one in there:
            # A page is open, or the apparatus would be paused for want of one.
            stack.enter_context(page_load(one.service, None, pages=1))
            one.service.play(one.records)
        _tell(report, f"cycles missed in {seconds:g} s, with the database", "missed", _missed(there, seconds))
        progress("Playing while the database hangs")
        with server.hanging():
            missed = _missed(there, seconds)
        _tell(report, f"cycles missed in {seconds:g} s, while it hangs", "missed_hanging", missed)
        progress("Waiting for what was kept")
        for one in there:
            one.service.until(
                lambda live: live.database.waiting == 0 and not live.database.unavailable_since, _DELIVERED_LIMIT_S
            )
        growth_mb = [one.service.service_mb - mb for one, mb in zip(there, before_mb, strict=True)]
        _tell(report, "growth of a service's memory, MB", "growth_mb", growth_mb)
    report.notes.append(
        "delay of the overview: from the moment an emergency stop's contact opens until another station's WebSocket has said so."
    )
    return report


@contextmanager
def _server() -> Iterator[postgresql.Server]:
    try:
        with postgresql.serving() as url:
            yield postgresql.Server(url)
    except postgresql.MissingError as error:
        raise BenchError(str(error)) from error


def _start(stack: ExitStack, folder: Path, name: str, server: postgresql.Server, play_s: float) -> _Station:
    data = folder / name
    records = prepare_records(data, play_s=play_s, plot_s=1.0, database_url=server.url)
    service = RunningService(data, records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ, name=name)
    return _Station(name, stack.enter_context(service), records)


def _delays_ms(there: Sequence[_Station], presses: int) -> list[float]:
    watchers = [_Watcher(one.service) for one in there]
    found: list[float] = []
    for n in range(presses):
        pressed, watcher = there[n % len(there)], watchers[(n + 1) % len(there)]
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


def _missed(there: Sequence[_Station], seconds: float) -> list[float]:
    """Of each, in so many seconds."""
    before = [_overruns(one) for one in there]
    time.sleep(seconds)
    return [_overruns(one) - overruns for one, overruns in zip(there, before, strict=True)]


def _overruns(one: _Station) -> int:
    live = one.service.live()
    if live.mode != "playing" or live.loop is None:
        raise BenchError(f"{one.name} is {live.mode} instead of playing; {causes(live)}")
    return live.loop.overruns


def _tell(report: Report, what: str, figure: str, values: Sequence[float]) -> None:
    p50, p99, largest = (float(value) for value in np.percentile(values, (50, 99, 100)))
    report.figures |= {f"{figure}_p50": p50, f"{figure}_p99": p99, f"{figure}_max": largest}
    together = "" if figure.endswith("delay_ms") else f"{sum(values):.0f}"
    report.rows.append((what, f"{p50:.1f}", f"{p99:.1f}", f"{largest:.1f}", together))
