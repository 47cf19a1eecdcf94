"""Implements ``python -m benchmarks pages``: measures a service with hundreds of pages, some of them stalled: the delay of each update,
the control loop's latency, and the growth of the service's memory.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from kata.bench.loop import LoopCase, measure
from kata.bench.page_load import PageLoadFigures, page_load
from kata.bench.report import Report
from kata.bench.running_service import RunningService, prepare_records

_RATE_HZ: Final = 100
_SPARE_S: Final = 30.0


@dataclass
class _PageGroup:
    """Pages that are open at the same time, and the figures measured with them."""

    pages: int
    stalled: int
    figures: PageLoadFigures = field(default_factory=PageLoadFigures)
    growth_mb: float = 0.0

    @contextmanager
    def on(self, service: RunningService) -> Iterator[None]:
        with page_load(service, None, self.pages, self.stalled) as figures:
            before_mb = service.service_mb
            yield
            self.growth_mb = service.service_mb - before_mb
        self.figures = figures

    @property
    def name(self) -> str:
        return f"{self.pages}, {self.stalled} of them stalled" if self.stalled else str(self.pages)


def run(pages: int, stalled: int, seconds: float, progress: Callable[[str], None]) -> Report:
    """Play a recording three times: with one page, with all pages, and with ``stalled`` pages that do not read.

    :raises BenchError: when the apparatus stops.
    """
    report = Report(
        f"Pages on group service at {_RATE_HZ} Hz, {seconds:g} s each",
        ("Pages", "delivery p50, ms", "p99, ms", "max, ms", "loop p99.9, ms", "missed", "memory, MB", "lost"),
    )
    case = LoopCase(_RATE_HZ, loaded=False, real_time=report.on.fifo)
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        records = prepare_records(Path(folder), play_s=seconds + _SPARE_S, plot_s=1.0)
        for suffix, group in (
            ("1", _PageGroup(1, 0)),
            ("all", _PageGroup(pages, 0)),
            ("stalled", _PageGroup(pages, stalled)),
        ):
            progress(f"{group.name} pages")
            measured = measure(Path(folder), case, records, seconds, beside=group.on)
            figures = group.figures
            report.figures |= {
                f"delivery_p99_ms_{suffix}": figures.delivery_p99_ms,
                f"delivery_max_ms_{suffix}": figures.delivery_max_ms,
                f"lateness_p999_ms_{suffix}": measured.loop.lateness_p999_ms,
                f"missed_{suffix}": measured.missed,
                f"growth_mb_{suffix}": group.growth_mb,
            }
            delivery = (figures.delivery_p50_ms, figures.delivery_p99_ms, figures.delivery_max_ms)
            report.rows.append(
                (group.name, *(f"{value:.1f}" for value in delivery), f"{measured.loop.lateness_p999_ms:.3f}",
                 str(measured.missed), f"{group.growth_mb:+.1f}", str(figures.connections_lost))
            )  # fmt: skip
    report.notes.append(
        "delivery: from the message's own time until the page has read it. The pages are on the same computer."
    )
    report.notes.append("memory: growth of the service's memory, from all pages connected until the end.")
    report.notes.append(
        "lost: connections that the service closed because they were not read; a real page connects again."
    )
    return report
