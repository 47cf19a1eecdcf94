"""Implements ``python -m benchmarks soak``: plays for an hour and measures missed cycles and the growth of memory."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from kata.bench.page_load import page_load
from kata.bench.records import BenchRecords
from kata.bench.reference_thread import reference_thread
from kata.bench.report import Report
from kata.bench.running_service import BenchError, RunningService, causes, prepare_records, rss_mb

_RATE_HZ: Final = 100
_PLAY_S: Final = 60.0
_RUNS_A_SESSION: Final = 5
"""Number of runs in a session. Answers about a session grow with its runs, and a clinic's sessions do not have a hundred runs."""
_SAMPLE_S: Final = 5.0
_SETTLED_S: Final = 600.0
"""Time in which memory may grow, because caches fill and modules are imported at their first use."""
_ROWS: Final = 12


@dataclass(frozen=True)
class SoakSample:
    """Missed cycles and memory of both processes at one moment."""

    at_s: float
    missed: int
    service_mb: float
    device_mb: float


def run(minutes: float, progress: Callable[[str], None]) -> Report:
    """Play for ``minutes`` with one page open.

    :raises BenchError: when the apparatus stops.
    """
    report = Report(f"Soak, {minutes:g} min at {_RATE_HZ} Hz", ("Minute", "missed", "service, MB", "device, MB"))
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        records = prepare_records(Path(folder), play_s=_PLAY_S, plot_s=_PLAY_S)
        with (
            RunningService(Path(folder), records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ) as service,
            page_load(service, None, pages=1),
            reference_thread(_RATE_HZ, real_time=report.on.fifo) as reference,
        ):
            samples = _play_and_sample(service, records, minutes * 60, progress)
    settled_s = min(_SETTLED_S, samples[-1].at_s / 2)
    later = [sample for sample in samples if sample.at_s >= settled_s]
    report.figures = {
        "soak_missed": samples[-1].missed,
        "soak_reference_missed": reference.missed,
        "soak_service_growth_mb": max(sample.service_mb for sample in later) - later[0].service_mb,
        "soak_device_growth_mb": max(sample.device_mb for sample in later) - later[0].device_mb,
    }
    for sample in samples[:: max(1, len(samples) // _ROWS)]:
        numbers = (sample.service_mb, sample.device_mb)
        report.rows.append((f"{sample.at_s / 60:.1f}", str(sample.missed), *(f"{number:.2f}" for number in numbers)))
    report.notes.append(
        f"A reference thread with the same privileges at the same time missed {reference.missed} and was {reference.max_ms:.1f} ms late at "
        "most: that is the lateness of the computer."
    )
    report.notes.append(
        f"Growth after minute {later[0].at_s / 60:.1f}, to the maximum: service {report.figures['soak_service_growth_mb']:+.2f} MB, "
        f"device {report.figures['soak_device_growth_mb']:+.2f} MB."
    )
    return report


def _play_and_sample(
    service: RunningService, records: BenchRecords, seconds: float, progress: Callable[[str], None]
) -> list[SoakSample]:
    service_pid, device_pid = service.service_pid, service.device_pid
    first = service.live().loop
    assert first is not None
    began = time.monotonic()
    samples: list[SoakSample] = []
    played = 0
    while not samples or samples[-1].at_s < seconds:
        live = service.live()
        if live.stop or live.loop is None:
            raise BenchError(
                f"the apparatus has stopped after {(time.monotonic() - began) / 60:.1f} min; {causes(live)}"
            )
        if live.mode == "idle":
            if played and played % _RUNS_A_SESSION == 0:
                records = service.begin_next_session(records)
            service.play(records)
            played += 1
        at_s = time.monotonic() - began
        samples.append(SoakSample(at_s, live.loop.overruns - first.overruns, rss_mb(service_pid), rss_mb(device_pid)))
        progress(f"{at_s / 60:.1f} of {seconds / 60:g} min")
        time.sleep(min(_SAMPLE_S, max(0.1, seconds - at_s)))
    return samples
