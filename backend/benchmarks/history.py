"""A clinic of ten years: what an hour of samples takes, and how long lists, charts and the plot of that hour do."""

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
    patients: int, visits: int, hour_s: float, times: int, kept: Path | None, progress: Callable[[str], None]
) -> Report:
    """Build it on both databases, a tenth of it and all, and ask both in turns for everything ``times`` times.

    ``kept``: a folder where they stay; what it has of them is not built again.
    """
    report = Report(
        f"{patients} patients, {visits} sessions: 95 of 100 answers within, ms",
        ("Asked for", "a tenth", "all", "a tenth, PostgreSQL", "all, PostgreSQL"),
    )
    sizes = ((max(1, patients // _FEWER), max(1, visits // _FEWER)), (patients, visits))
    took: dict[tuple[str, str], list[float]] = {}
    for backend in BACKENDS:
        try:
            with ExitStack() as kept_open:
                asked_of = []
                for people, sessions in sizes:
                    progress(f"Writing down {sessions} sessions on {backend}")
                    database, folder, history = kept_open.enter_context(store(backend, people, sessions, hour_s, kept))
                    asked_of.append((kept_open.enter_context(serving(database, folder)), history))
                progress(f"Asking {backend}")
                for ask in (*LISTS, ERROR_PLOT):
                    if asked_of[0][0].has(ask):
                        took[backend, ask.name] = p95_ms(ask, asked_of, times)
                if backend == "sqlite":
                    report.figures["bytes_per_hour"] = _bytes(database, 3600 / hour_s)
                    report.figures["error_plot_p95_ms"] = took[backend, ERROR_PLOT.name][-1]
        except postgresql.MissingError as error:
            report.notes.append(f"{error} So it was not measured.")
    _tell(report, took)
    report.notes.append(
        "Over HTTP, one request at a time, from this process: the service, without its apparatus, runs in a thread beside "
        "what asks it."
    )
    return report


def _bytes(database: Database, parts: float) -> float:
    """What the run's samples take in an hour of as many parts; its overview is as large, however long it is."""
    with database.read() as session:
        blocks = session.scalars(text("SELECT SUM(LENGTH(data)) FROM run_sample_blocks")).one()
        more = session.scalars(text("SELECT LENGTH(data) + COALESCE(LENGTH(overview), 0) FROM run_samples")).one()
        return float(blocks * parts + more)


def _tell(report: Report, took: dict[tuple[str, str], list[float]]) -> None:
    told = [backend for backend in BACKENDS if any(of == backend for of, _ in took)]
    for name in dict.fromkeys(name for _, name in took):
        cells = [f"{p95:.1f}" for backend in told for p95 in took[backend, name]]
        report.rows.append((name, *cells))
    ratios = []
    for backend in told:
        lists = [p95 for (of, name), p95 in took.items() if of == backend and name != ERROR_PLOT.name]
        fewer, every = (max(p95[size] for p95 in lists) for size in (0, 1))
        report.figures[f"lists_p95_ms_{backend}"] = every
        ratios.append(every / fewer)
    report.figures["growth_ratio_10x"] = max(ratios)
