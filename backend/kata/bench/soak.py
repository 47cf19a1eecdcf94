"""``kata bench soak``: playing over and over, whether a cycle is ever missed and whether memory grows."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from kata.bench.clinic import BenchError, Clinic, causes, prepared, rss_mb
from kata.bench.load import loading
from kata.bench.prepared import Prepared
from kata.bench.reference_thread import witnessing
from kata.bench.report import Report

_RATE_HZ: Final = 100
_PLAY_S: Final = 60.0
_RUNS_A_SESSION: Final = 5
"""What is asked about a session grows with what was played in it; a clinic's day is many sessions, and none of a hundred runs."""
_LOOK_S: Final = 5.0
_SETTLED_S: Final = 600.0
"""Until then memory may grow: caches fill, modules are imported when they are first needed."""
_ROWS: Final = 12


@dataclass(frozen=True)
class Look:
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
        records = prepared(Path(folder), play_s=_PLAY_S, plot_s=_PLAY_S)
        with (
            Clinic(Path(folder), records, cycle_hz=_RATE_HZ, rate_hz=_RATE_HZ) as clinic,
            loading(clinic, None, pages=1),
            witnessing(_RATE_HZ, real_time=report.on.fifo) as floor,
        ):
            looks = _watch(clinic, records, minutes * 60, progress)
    settled_s = min(_SETTLED_S, looks[-1].at_s / 2)
    later = [look for look in looks if look.at_s >= settled_s]
    report.figures = {
        "soak_missed": looks[-1].missed,
        "soak_witness_missed": floor.missed,
        "soak_service_growth_mb": max(look.service_mb for look in later) - later[0].service_mb,
        "soak_device_growth_mb": max(look.device_mb for look in later) - later[0].device_mb,
    }
    for look in looks[:: max(1, len(looks) // _ROWS)]:
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


def _watch(clinic: Clinic, records: Prepared, seconds: float, progress: Callable[[str], None]) -> list[Look]:
    service, device = clinic.service_pid, clinic.device_pid
    first = clinic.live().loop
    assert first is not None
    began = time.monotonic()
    looks: list[Look] = []
    played = 0
    while not looks or looks[-1].at_s < seconds:
        live = clinic.live()
        if live.stop or live.loop is None:
            raise BenchError(
                f"the apparatus has stopped after {(time.monotonic() - began) / 60:.1f} min; {causes(live)}"
            )
        if live.mode == "idle":
            if played and played % _RUNS_A_SESSION == 0:
                records = clinic.begin_another(records)
            clinic.play(records)
            played += 1
        at_s = time.monotonic() - began
        looks.append(Look(at_s, live.loop.overruns - first.overruns, rss_mb(service), rss_mb(device)))
        progress(f"{at_s / 60:.1f} of {seconds / 60:g} min")
        time.sleep(min(_LOOK_S, max(0.1, seconds - at_s)))
    return looks
