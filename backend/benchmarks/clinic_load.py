"""Implements ``python -m benchmarks clinic-load``: many stations with stepped buses and hundreds of pages on one PostgreSQL. Measures the delay of the
overview, the server's processor time and connections, and the growth of the database.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import msgspec
import numpy as np
import psycopg
from sqlalchemy.engine import make_url

from benchmarks import postgresql
from benchmarks.stepped_station import StationFigures
from kata.bench.report import Report
from kata.bench.running_service import BenchError, children
from kata.database.engine import Database
from kata.database.upgrade import upgrade

_RUN_S: Final = 60.0
_LATEST_S: Final = 6.0
"""An emergency stop that a page shows later than this counts as not shown. The next press comes later."""
_CONNECTIONS_A_STATION: Final = 20
"""A service has at most fifteen for requests and two for the overview of the stations."""
_SESSION_S: Final = 1800.0
_SESSIONS_A_YEAR: Final = 8 * 250
"""Sessions of a station a year: eight a day, 250 days."""
_GB: Final = 1e9


class _ServerLoad:
    """Processor time and connections of the server during a measurement."""

    def __init__(self, url: str) -> None:
        self._folder = Path(str(make_url(url).query["host"]))
        self._connection = psycopg.connect(host=str(self._folder), user="kata", dbname="postgres", autocommit=True)
        self.connections = 0
        self._first = self._used_s()
        self._began_s = time.monotonic()

    def measure(self, seconds: float) -> None:
        """Count the connections every second for ``seconds``."""
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            time.sleep(1.0)
            query = "SELECT count(*) FROM pg_stat_activity WHERE backend_type = 'client backend'"
            self.connections = max(self.connections, self._number(query) - 1)

    @property
    def cpu_percent(self) -> float:
        """Return the processor time of all server processes since the beginning, in percent of one core."""
        now = self._used_s()
        used_s = sum(used_s - self._first.get(pid, 0.0) for pid, used_s in now.items())
        return 100 * used_s / (time.monotonic() - self._began_s)

    @property
    def size_bytes(self) -> int:
        return self._number("SELECT pg_database_size(current_database())")

    def close(self) -> None:
        self._connection.close()

    def _number(self, query: str) -> int:
        row = self._connection.execute(query).fetchone()
        assert row is not None
        return int(row[0])

    def _used_s(self) -> dict[int, float]:
        first = int((self._folder / "data/postmaster.pid").read_text().split()[0])
        return {pid: used_s for pid in [*children(first), first] if (used_s := _cpu_s(pid)) is not None}


def run(stations: int, pages: int, seconds: float, progress: Callable[[str], None]) -> Report:
    """Let ``stations`` stations and ``pages`` pages use one PostgreSQL for ``seconds``.

    :raises BenchError: when PostgreSQL is missing, or a station does not start.
    """
    report = Report(
        f"{stations} stations and {pages} pages on one PostgreSQL, {seconds:g} s", ("", "p50", "p99", "largest")
    )
    with (
        TemporaryDirectory(prefix="kata-bench-") as folder,
        postgresql.serving(most_connections=stations * _CONNECTIONS_A_STATION) as url,
    ):
        database = Database(url)
        upgrade(database)
        database.close()
        progress("Starting the stations")
        with _stations(stations, pages, url, Path(folder)) as running:
            load = _ServerLoad(url)
            before = load.size_bytes
            for process in running:
                _begin(process)
            progress("Measuring")
            load.measure(seconds)
            cpu_percent, grown = load.cpu_percent, load.size_bytes - before
            figures = [_finish(process) for process in running]
            load.close()
    delays_ms, missed = overview_delays_ms(figures)
    _add_row(report, "overview: emergency stop shown, ms", "overview_delay_ms", delays_ms)
    _add_row(report, "list of patients, ms", "list_ms", [ms for each in figures for ms in each.lists_ms])
    stored_s = sum(each.stored_s for each in figures)
    year_gb = grown / stored_s * _SESSION_S * _SESSIONS_A_YEAR * stations / _GB if stored_s else 0.0
    report.figures |= {
        "overview_not_shown": missed,
        "database_cpu_percent": cpu_percent,
        "database_connections": load.connections,
        "database_growth_gb_a_year": year_gb,
    }
    report.notes += [
        f"The overview's delay has {len(delays_ms)} values; {missed} presses were not shown within {_LATEST_S:g} s.",
        f"PostgreSQL: {cpu_percent:.0f} % of one core, {load.connections} connections.",
        f"The database grew by {grown / 1e6:.1f} MB for {stored_s:.0f} s of stored motion. {_SESSIONS_A_YEAR} sessions of half an hour a "
        f"year at each station are {year_gb:.0f} GB.",
        "Stations and pages run on this computer too, without web server and network. A page is the code that builds the overview's message.",
    ]
    return report


def overview_delays_ms(figures: Sequence[StationFigures]) -> tuple[list[float], int]:
    """Return the time from each press until each page showed it, in milliseconds, and the number of presses that a page did not show.

    Presses in the last seconds are left out, because a page had no time to show them.
    """
    delays_ms: list[float] = []
    for pressed in figures:
        seen_s = [
            np.sort([at_s for n, name, at_s in watcher.seen_s if n == page and name == pressed.name])
            for watcher in figures
            for page in sorted({n for n, _, _ in watcher.seen_s})
        ]
        for press_s in pressed.presses_s:
            if press_s > pressed.ended_s - _LATEST_S:
                continue
            for times_s in seen_s:
                following_s = times_s[np.searchsorted(times_s, press_s) :]
                delays_ms.append((following_s[0] - press_s) * 1000 if len(following_s) else np.inf)
    shown_ms = [delay_ms for delay_ms in delays_ms if delay_ms <= _LATEST_S * 1000]
    return shown_ms, len(delays_ms) - len(shown_ms)


@contextmanager
def _stations(stations: int, pages: int, url: str, folder: Path) -> Iterator[list["subprocess.Popen[str]"]]:
    """Run the stations' processes during the block. The pages are distributed evenly."""
    running: list[subprocess.Popen[str]] = []
    try:
        for number in range(stations):
            share = pages // stations + (number < pages % stations)
            arguments = ["--name", f"Station {number + 1}", "--url", url, "--pages", str(share), "--run-s", str(_RUN_S)]
            arguments += ["--folder", str(folder / str(number))]
            running.append(
                subprocess.Popen(
                    [sys.executable, "-m", "benchmarks.stepped_station", *arguments],
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                )
            )  # fmt: skip
        for process in running:
            assert process.stdout is not None
            if process.stdout.readline() != "ready\n":
                raise BenchError("a station does not start")
        yield running
    finally:
        for process in running:
            process.kill()
            process.wait()


def _begin(process: "subprocess.Popen[str]") -> None:
    assert process.stdin is not None
    process.stdin.write("begin\n")
    process.stdin.flush()


def _finish(process: "subprocess.Popen[str]") -> StationFigures:
    assert process.stdin is not None and process.stdout is not None
    process.stdin.close()
    return msgspec.json.decode(process.stdout.read(), type=StationFigures)


def _cpu_s(pid: int) -> float | None:
    """Return the processor time of a process in seconds, None if it has ended."""
    try:
        times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except FileNotFoundError:
        return None
    return (int(times[11]) + int(times[12])) / os.sysconf("SC_CLK_TCK")


def _add_row(report: Report, what: str, figure: str, values: Sequence[float]) -> None:
    p50, p99, largest = (float(value) for value in np.percentile(values or [np.nan], (50, 99, 100)))
    report.figures |= {f"{figure}_p50": p50, f"{figure}_p99": p99, f"{figure}_max": largest}
    report.rows.append((what, f"{p50:.1f}", f"{p99:.1f}", f"{largest:.1f}"))
