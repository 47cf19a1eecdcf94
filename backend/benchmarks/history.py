"""Implements ``python -m benchmarks history``: measures answer times and the size of an hour of samples with ten years of a clinic."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from sqlalchemy import text

from benchmarks import postgresql
from benchmarks.http_load import ERROR_PLOT, LISTS, percentiles_ms, serving
from benchmarks.stores import BACKENDS, store
from kata.bench.report import Report
from kata.database.engine import Database

_FEWER: Final = 10
_Took = dict[tuple[str, str], list[tuple[float, float]]]
"""Median and 95th percentile of the answer times with a tenth of the history and with all of it, by database and request."""


def run(
    patients: int, visits: int, hour_s: float, times: int, store_folder: Path | None, progress: Callable[[str], None]
) -> Report:
    """Build a tenth of the history and all of it on both databases. Send every request ``times`` times to both sizes, alternately.

    ``store_folder``: folder in which the databases are kept. An existing database is used again.
    """
    report = Report(
        f"{patients} patients, {visits} sessions: 50 / 95 of 100 answers within, ms",
        ("Request", "a tenth", "all", "a tenth, PostgreSQL", "all, PostgreSQL"),
    )
    sizes = ((max(1, patients // _FEWER), max(1, visits // _FEWER)), (patients, visits))
    took_ms: _Took = {}
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
                        took_ms[backend, kind.name] = percentiles_ms(kind, services, times)
                if backend == "sqlite":
                    report.figures["bytes_per_hour"] = _bytes(database, 3600 / hour_s)
                    report.figures["error_plot_p95_ms"] = took_ms[backend, ERROR_PLOT.name][-1][1]
        except postgresql.MissingError as error:
            report.notes.append(f"{error} It was not measured.")
    _add_rows(report, took_ms)
    report.notes.append(
        "Over HTTP, one request at a time. The service runs without its apparatus, in a thread of the process that sends the "
        "requests."
    )
    return report


def _bytes(database: Database, parts: float) -> float:
    """Return the size of the run's samples in bytes, scaled to an hour. The size of the overview does not depend on the length."""
    with database.read() as session:
        blocks = session.scalars(text("SELECT SUM(LENGTH(data)) FROM run_sample_blocks")).one()
        more = session.scalars(text("SELECT LENGTH(data) + COALESCE(LENGTH(overview), 0) FROM run_samples")).one()
        return float(blocks * parts + more)


def _add_rows(report: Report, took_ms: _Took) -> None:
    backends = [backend for backend in BACKENDS if any(of == backend for of, _ in took_ms)]
    for name in dict.fromkeys(name for _, name in took_ms):
        cells = [f"{median:.1f} / {p95:.1f}" for backend in backends for median, p95 in took_ms[backend, name]]
        report.rows.append((name, *cells))
    ratios = []
    for backend in backends:
        lists = {name: of for (on, name), of in took_ms.items() if on == backend and name != ERROR_PLOT.name}
        fewer, every = (max(of[size][1] for of in lists.values()) for size in (0, 1))
        report.figures[f"lists_p95_ms_{backend}"] = every
        report.figures[f"lists_p50_ms_{backend}"] = max(of[1][0] for of in lists.values())
        ratios.append(every / fewer)
    report.figures["growth_ratio_10x"] = max(ratios)
