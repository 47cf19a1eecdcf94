"""``kata bench loop``: how late the control loop's cycles begin, idle and under load, with and without privileges."""

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from kata.bench.page_load import PageLoadFigures, page_load
from kata.bench.records import BenchRecords
from kata.bench.reference_thread import ReferenceLateness, reference_thread
from kata.bench.report import Report
from kata.bench.running_service import BenchError, RunningService, causes, prepare_records
from kata.station.schemas import LoopLive

SLOWEST_CYCLE_HZ: Final = 100
"""A slower station reads its bus this often all the same (decision 0002)."""
_LOOK_AGAIN_S: Final = 0.5
_SPARE_S: Final = 60.0
"""The recording is this much longer than the measurement: it must not end within."""


@dataclass(frozen=True)
class LoopCase:
    """One measurement."""

    rate_hz: int
    loaded: bool
    real_time: bool

    @property
    def cycle_hz(self) -> int:
        """Bus cycles a second."""
        return self.rate_hz if self.rate_hz >= 50 else SLOWEST_CYCLE_HZ


@dataclass(frozen=True)
class LoopFigures:
    """What came of a case: the loop's own account since it started, and what it missed within the time measured."""

    loop: LoopLive
    missed: int
    bus_errors: int
    """Replies that stayed away or came late within that time; each makes a cycle longer."""
    floor: ReferenceLateness
    load: PageLoadFigures | None


def loop_cases(rates: Sequence[int], *, real_time: Sequence[bool], loaded: Sequence[bool]) -> list[LoopCase]:
    """In the order they are measured."""
    return [LoopCase(rate, busy, granted) for granted in real_time for rate in rates for busy in sorted(loaded)]


def run(wanted: Sequence[LoopCase], seconds: float, plot_s: float, progress: Callable[[str], None]) -> Report:
    """Measure every case, each with a service of its own, while a recording plays.

    :raises BenchError: when no case came to its end.
    """
    report = Report(
        f"Lateness of the control loop's cycles, {seconds:g} s each",
        ("Loop", "p50, ms", "p99, ms", "p99.9, ms", "max, ms", "missed", "bus errors", "witness p99.9", "max"),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        records = prepare_records(Path(folder), play_s=seconds + _SPARE_S, plot_s=plot_s)
        for case in wanted:
            if case.real_time and not report.on.fifo:
                report.notes.append(f"{case.rate_hz} Hz with SCHED_FIFO: not measured, it is not granted.")
                continue
            progress(_name(case))
            try:
                _tell(report, case, measure(Path(folder), case, records, seconds))
            except BenchError as error:
                # A measurement that a stop has ended is told, and the others are not lost with it.
                report.notes.append(f"{_name(case)}: no figures, {error}.")
    if not report.rows:
        raise BenchError(" ".join(report.notes))
    report.notes.append(
        "Since the control loop started; missed: within the time measured. Torque is on and a recording plays."
    )
    report.notes.append(
        "bus errors: replies that stayed away or came late, because the simulator was kept waiting too; a cycle waits for them."
    )
    report.notes.append(
        "witness: a bare thread with the same privileges at the same time; what it is late is the computer's own doing."
    )
    report.notes.append("loaded: 100 WebSocket clients read everything, another one draws a long run again and again.")
    return report


def measure(
    data: Path,
    case: LoopCase,
    records: BenchRecords,
    seconds: float,
    beside: Callable[[RunningService], AbstractContextManager[object]] | None = None,
) -> LoopFigures:
    """One case. ``beside``: what goes on besides, from before the recording plays until after the measurement."""
    with ExitStack() as stack:
        service = stack.enter_context(
            RunningService(data, records, cycle_hz=case.cycle_hz, rate_hz=case.rate_hz, real_time=case.real_time)
        )
        # The load comes first, so that little of the loop's life is without it.
        told = stack.enter_context(page_load(service, records)) if case.loaded else None
        if beside:
            stack.enter_context(beside(service))
        floor = stack.enter_context(reference_thread(case.cycle_hz, real_time=case.real_time))
        service.play(records)
        before = _loop(service)
        cycles = before.cycles + round(seconds * case.cycle_hz)
        while (now := _loop(service)).cycles < cycles:
            time.sleep(_LOOK_AGAIN_S)
    return LoopFigures(now, now.overruns - before.overruns, now.bus_errors - before.bus_errors, floor, told)


def _loop(service: RunningService) -> LoopLive:
    live = service.live()
    if live.mode != "playing" or live.loop is None:
        raise BenchError(f"the apparatus is {live.mode} instead of playing; {causes(live)}")
    return live.loop


def _name(case: LoopCase) -> str:
    return f"{case.rate_hz} Hz {'loaded' if case.loaded else 'idle'}{'' if case.real_time else ', no FIFO'}"


def _tell(report: Report, case: LoopCase, measured: LoopFigures) -> None:
    loop = measured.loop
    suffix = f"{case.rate_hz}hz_{'loaded' if case.loaded else 'idle'}{'' if case.real_time else '_nofifo'}"
    told = {name: getattr(loop, f"lateness_{name}_ms") for name in ("p50", "p99", "p999", "max")}
    report.figures |= {f"lateness_{name}_ms_{suffix}": value for name, value in told.items()}
    report.figures |= {f"missed_{suffix}": measured.missed, f"bus_errors_{suffix}": measured.bus_errors}
    floor = measured.floor
    report.figures |= {f"floor_p999_ms_{suffix}": floor.p999_ms, f"floor_max_ms_{suffix}": floor.max_ms}
    figures = (f"{value:.3f}" for value in told.values())
    report.rows.append(
        (
            _name(case),
            *figures,
            str(measured.missed),
            str(measured.bus_errors),
            f"{floor.p999_ms:.3f}",
            f"{floor.max_ms:.3f}",
        )
    )
    if loop.overruns > measured.missed:
        report.notes.append(
            f"{_name(case)}: {loop.overruns - measured.missed} more missed before the measurement began."
        )
    if measured.load:
        report.notes.append(f"{_name(case)}: {measured.load.line()}.")
