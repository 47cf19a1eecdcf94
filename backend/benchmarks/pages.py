"""``kata bench pages``: hundreds of pages on one service: how soon each has the newest state, and what the control loop and memory
feel of them, also when some have stalled.
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
class _Pages:
    """So many, and what they and the service were told by."""

    pages: int
    stalled: int
    told: PageLoadFigures = field(default_factory=PageLoadFigures)
    growth_mb: float = 0.0

    @contextmanager
    def on(self, service: RunningService) -> Iterator[None]:
        with page_load(service, None, self.pages, self.stalled) as told:
            before_mb = service.service_mb
            yield
            self.growth_mb = service.service_mb - before_mb
        self.told = told

    @property
    def name(self) -> str:
        return f"{self.pages}, {self.stalled} of them stalled" if self.stalled else str(self.pages)


def run(pages: int, stalled: int, seconds: float, progress: Callable[[str], None]) -> Report:
    """Play a recording three times: with one page, with all of them, and with ``stalled`` of them reading nothing.

    :raises BenchError: when the apparatus stops by itself.
    """
    report = Report(
        f"Pages on one service at {_RATE_HZ} Hz, {seconds:g} s each",
        ("Pages", "delivery p50, ms", "p99, ms", "max, ms", "loop p99.9, ms", "missed", "memory, MB", "hung up"),
    )
    case = LoopCase(_RATE_HZ, loaded=False, real_time=report.on.fifo)
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        records = prepare_records(Path(folder), play_s=seconds + _SPARE_S, plot_s=1.0)
        for suffix, one in (("1", _Pages(1, 0)), ("all", _Pages(pages, 0)), ("stalled", _Pages(pages, stalled))):
            progress(f"{one.name} pages")
            measured = measure(Path(folder), case, records, seconds, beside=one.on)
            told = one.told
            report.figures |= {
                f"delivery_p99_ms_{suffix}": told.delivery_p99_ms,
                f"delivery_max_ms_{suffix}": told.delivery_max_ms,
                f"lateness_p999_ms_{suffix}": measured.loop.lateness_p999_ms,
                f"missed_{suffix}": measured.missed,
                f"growth_mb_{suffix}": one.growth_mb,
            }
            delivery = (told.delivery_p50_ms, told.delivery_p99_ms, told.delivery_max_ms)
            report.rows.append(
                (one.name, *(f"{value:.1f}" for value in delivery), f"{measured.loop.lateness_p999_ms:.3f}",
                 str(measured.missed), f"{one.growth_mb:+.1f}", str(told.connections_lost))
            )  # fmt: skip
    report.notes.append(
        "delivery: from the message's own time until the page has read it; the pages are on this computer, too."
    )
    report.notes.append("memory: what the service's grew by, from when all pages were there until the end.")
    report.notes.append(
        "hung up: connections that the service ended because nobody read them; a page would connect again."
    )
    return report
