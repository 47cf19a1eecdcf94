"""``kata bench soak``: playing over and over, whether a cycle is ever missed and whether memory grows."""

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
"""What is asked about a session grows with what was played in it; a clinic's day is many sessions, and none of a hundred runs."""
_LOOK_S: Final = 5.0
_SETTLED_S: Final = 600.0
"""Until then memory may grow: caches fill, modules are imported when they are first needed."""
_ROWS: Final = 12


@dataclass(frozen=True)
class SoakSample:
    """At one moment."""

    at_s: float
    missed: int
    service_mb: float
    device_mb: float


def run(minutes: float, progress: Callable[[str], None]) -> Report:
    """Play for so long, with one page open.

    :raises BenchError: when the apparatus stops by itself.
    """
    report = Report(f"Soak, {minutes:g} min at {_RATE_HZ} Hz", ("Minute", "missed", "service, MB", "device, MB"))
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        records = prepare_records(Path(folder), play_s=_PLAY_S, plot_s=_PLAY_S)
        with (
            RunningService(Path(folder), records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ) as service,
            page_load(service, None, pages=1),
            reference_thread(_RATE_HZ, real_time=report.on.fifo) as floor,
        ):
            samples = _watch(service, records, minutes * 60, progress)
    settled_s = min(_SETTLED_S, samples[-1].at_s / 2)
    later = [look for look in samples if look.at_s >= settled_s]
    report.figures = {
        "soak_missed": samples[-1].missed,
        "soak_witness_missed": floor.missed,
        "soak_service_growth_mb": max(look.service_mb for look in later) - later[0].service_mb,
        "soak_device_growth_mb": max(look.device_mb for look in later) - later[0].device_mb,
    }
    for look in samples[:: max(1, len(samples) // _ROWS)]:
        numbers = (look.service_mb, look.device_mb)
        report.rows.append((f"{look.at_s / 60:.1f}", str(look.missed), *(f"{number:.2f}" for number in numbers)))
    report.notes.append(
        f"A bare thread with the same privileges at the same time missed {floor.missed}, and was {floor.max_ms:.1f} ms late at worst: "
        "that is the computer's own doing."
    )
    report.notes.append(
        f"Growth after minute {later[0].at_s / 60:.1f}, to the highest: service {report.figures['soak_service_growth_mb']:+.2f} MB, "
        f"device {report.figures['soak_device_growth_mb']:+.2f} MB."
    )
    return report


def _watch(
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
        time.sleep(min(_LOOK_S, max(0.1, seconds - at_s)))
    return samples
