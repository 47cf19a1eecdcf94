"""A clinic of ten years: what an hour of samples takes, and how long lists, charts and the plot of that hour do."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from sqlalchemy import text

from kata.bench import postgresql
from kata.bench.asks import ERROR_PLOT, LISTS, serving
from kata.bench.report import Report
from kata.bench.stores import BACKENDS, store
from kata.bench.synthetic import History
from kata.database.engine import Database

_FEWER: Final = 10


def run(
    patients: int, visits: int, hour_s: float, times: int, kept: Path | None, progress: Callable[[str], None]
) -> Report:
    """Build it on both databases, once a tenth of it and once all, and ask for everything ``times`` times.

    ``kept``: a folder where they stay; what it has of them is not built again.
    """
    report = Report(
        f"{patients} patients, {visits} sessions: 95 of 100 answers within, ms",
        ("Asked for", "a tenth", "all", "a tenth, PostgreSQL", "all, PostgreSQL"),
    )
    sizes = ((max(1, patients // _FEWER), max(1, visits // _FEWER)), (patients, visits))
    took: dict[tuple[str, int], dict[str, float]] = {}
    for backend in BACKENDS:
        for size, (people, sessions) in enumerate(sizes):
            what = f"{sessions} sessions on {backend}"
            try:
                progress(f"Writing down {what}")
                with store(backend, people, sessions, hour_s, kept) as (database, folder, history):
                    progress(f"Asking for {what}")
                    took[backend, size] = _asked(database, folder, history, times)
                    if backend == "sqlite" and size == 1:
                        report.figures["bytes_per_hour"] = _bytes(database, 3600 / hour_s)
                        report.figures["error_plot_p95_ms"] = took[backend, size][ERROR_PLOT.name]
            except postgresql.MissingError as error:
                report.notes.append(f"{error} So it was not measured.")
                break
    _tell(report, took)
    report.notes.append(
        "Over HTTP, one request at a time, from this process: the service, without its apparatus, runs in a thread beside "
        "what asks it."
    )
    return report


def _asked(database: Database, folder: Path, history: History, times: int) -> dict[str, float]:
    with serving(database, folder) as service:
        found = {ask.name: service.p95_ms(ask, history, times) for ask in (*LISTS, ERROR_PLOT)}
    return {name: p95_ms for name, p95_ms in found.items() if p95_ms is not None}


def _bytes(database: Database, parts: float) -> float:
    """What the run's samples take in an hour of as many parts; its overview is as large, however long it is."""
    with database.read() as session:
        blocks = session.scalars(text("SELECT SUM(LENGTH(data)) FROM run_sample_blocks")).one()
        more = session.scalars(text("SELECT LENGTH(data) + COALESCE(LENGTH(overview), 0) FROM run_samples")).one()
        return float(blocks * parts + more)


def _tell(report: Report, took: dict[tuple[str, int], dict[str, float]]) -> None:
    names = [ask.name for ask in (*LISTS, ERROR_PLOT) if ask.name in took["sqlite", 1]]
    for name in names:
        cells = (took.get((backend, size), {}).get(name) for backend in BACKENDS for size in (0, 1))
        report.rows.append((name, *("" if cell is None else f"{cell:.1f}" for cell in cells)))
    ratios = []
    for backend in BACKENDS:
        if (backend, 1) not in took:
            continue
        fewer, every = (
            max(p95 for name, p95 in took[backend, size].items() if name != ERROR_PLOT.name) for size in (0, 1)
        )
        report.figures[f"lists_p95_ms_{backend}"] = every
        ratios.append(every / fewer)
    report.figures["growth_ratio_10x"] = max(ratios)
