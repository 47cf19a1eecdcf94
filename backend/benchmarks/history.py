"""``python -m benchmarks history``: ten years of a clinic: the size of an hour of samples, and the answer times of lists, charts and its plot."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from sqlalchemy import text

from benchmarks import postgresql
from benchmarks.http_load import ERROR_PLOT, LISTS, p95_ms, serving
from benchmarks.stores import BACKENDS, store
from kata.bench.report import Report
from kata.database.engine import Database

_FEWER: Final = 10


def run(
    patients: int, visits: int, hour_s: float, times: int, store_folder: Path | None, progress: Callable[[str], None]
) -> Report:
    """Build a tenth of the history and all of it, on both databases; send both every request ``times`` times, in turns.

    ``store_folder``: where the databases stay; an existing one is used again.
    """
    report = Report(
        f"{patients} patients, {visits} sessions: 95 of 100 answers within, ms",
        ("Request", "a tenth", "all", "a tenth, PostgreSQL", "all, PostgreSQL"),
    )
    sizes = ((max(1, patients // _FEWER), max(1, visits // _FEWER)), (patients, visits))
    p95s: dict[tuple[str, str], list[float]] = {}
    for backend in BACKENDS:
        try:
            with ExitStack() as open_databases:
                services = []
                for patients_here, sessions in sizes:
                    progress(f"Creating {sessions} sessions on {backend}")
                    database, folder, history = open_databases.enter_context(
                        store(backend, patients_here, sessions, hour_s, store_folder)
                    )
                    services.append((open_databases.enter_context(serving(database, folder)), history))
                progress(f"Requesting from {backend}")
                for kind in (*LISTS, ERROR_PLOT):
                    if services[0][0].has(kind):
                        p95s[backend, kind.name] = p95_ms(kind, services, times)
                if backend == "sqlite":
                    report.figures["bytes_per_hour"] = _bytes(database, 3600 / hour_s)
                    report.figures["error_plot_p95_ms"] = p95s[backend, ERROR_PLOT.name][-1]
        except postgresql.MissingError as error:
            report.notes.append(f"{error} It was not measured.")
    _add_rows(report, p95s)
    report.notes.append(
        "Over HTTP, one request at a time. The service runs without its apparatus, in a thread of the process that sends the "
        "requests."
    )
    return report


def _bytes(database: Database, parts: float) -> float:
    """Return the size of the run's samples, scaled to an hour; the size of the overview does not depend on the length."""
    with database.read() as session:
        blocks = session.scalars(text("SELECT SUM(LENGTH(data)) FROM run_sample_blocks")).one()
        more = session.scalars(text("SELECT LENGTH(data) + COALESCE(LENGTH(overview), 0) FROM run_samples")).one()
        return float(blocks * parts + more)


def _add_rows(report: Report, p95s: dict[tuple[str, str], list[float]]) -> None:
    backends = [backend for backend in BACKENDS if any(of == backend for of, _ in p95s)]
    for name in dict.fromkeys(name for _, name in p95s):
        cells = [f"{p95:.1f}" for backend in backends for p95 in p95s[backend, name]]
        report.rows.append((name, *cells))
    ratios = []
    for backend in backends:
        lists = [p95 for (of, name), p95 in p95s.items() if of == backend and name != ERROR_PLOT.name]
        fewer, every = (max(p95[size] for p95 in lists) for size in (0, 1))
        report.figures[f"lists_p95_ms_{backend}"] = every
        ratios.append(every / fewer)
    report.figures["growth_ratio_10x"] = max(ratios)
