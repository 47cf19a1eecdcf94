"""Implements ``kata bench loop``: measures the latency of the control loop's cycles, idle and under load, with and without privileges."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from kata.bench.page_load import PageLoadFigures, page_load
from kata.bench.records import BenchRecords
from kata.bench.reference_thread import ReferenceLateness, reference_thread
from kata.bench.report import Report
from kata.bench.running_service import WITHOUT_REAL_TIME, BenchError, RunningService, causes, prepare_records
from kata.station.schemas import LoopLive

SLOWEST_CYCLE_HZ: Final = 100
"""A station with a lower sample rate still reads its bus at this rate (decision 0002)."""
_POLL_S: Final = 0.5
_SPARE_S: Final = 60.0
"""The recording is longer than the measurement by this time, so that it does not end first."""


@dataclass(frozen=True)
class LoopCase:
    """The conditions of one measurement."""

    rate_hz: int
    loaded: bool
    real_time: bool

    @property
    def cycle_hz(self) -> int:
        """Number of bus cycles a second."""
        return self.rate_hz if self.rate_hz >= 50 else SLOWEST_CYCLE_HZ

    @property
    def settings(self) -> Mapping[str, str]:
        """Settings of the case's service."""
        return {} if self.real_time else WITHOUT_REAL_TIME


@dataclass(frozen=True)
class LoopFigures:
    """The figures of a case: the loop's own statistics since its start, and the missed cycles during the measurement."""

    loop: LoopLive
    missed: int
    bus_errors: int
    """Number of missing or late replies during the measurement. Each makes a cycle longer."""
    reference: ReferenceLateness
    load: PageLoadFigures | None


def loop_cases(rates: Sequence[int], *, real_time: Sequence[bool], loaded: Sequence[bool]) -> list[LoopCase]:
    """Return the cases in the order of their measurement."""
    return [LoopCase(rate, busy, granted) for granted in real_time for rate in rates for busy in sorted(loaded)]


def run(cases: Sequence[LoopCase], seconds: float, plot_s: float, progress: Callable[[str], None]) -> Report:
    """Measure every case with its own service while a recording plays.

    :raises BenchError: when no case was completed.
    """
    report = Report(
        f"Lateness of the control loop's cycles, {seconds:g} s each",
        ("Loop", "p50, ms", "p99, ms", "p99.9, ms", "max, ms", "missed", "bus errors", "reference p99.9", "max"),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        records = prepare_records(Path(folder), play_s=seconds + _SPARE_S, plot_s=plot_s)
        for case in cases:
            if case.real_time and not report.on.fifo:
                report.notes.append(f"{case.rate_hz} Hz with SCHED_FIFO: not measured, it is not granted.")
                continue
            progress(_name(case))
            try:
                _add_row(report, case, measure(Path(folder), case, records, seconds))
            except BenchError as error:
                # Report a measurement that was ended by a stop, and continue with the others.
                report.notes.append(f"{_name(case)}: no figures, {error}.")
    if not report.rows:
        raise BenchError(" ".join(report.notes))
    report.notes.append(
        "Lateness since the control loop started; missed: during the measurement. Torque is on and a recording plays."
    )
    report.notes.append(
        "bus errors: missing or late replies, because the simulator had to wait for the processor too; a cycle waits for them."
    )
    report.notes.append(
        "reference: a bare thread with the same privileges at the same time; its lateness is that of the computer."
    )
    report.notes.append("loaded: 100 WebSocket clients read every message; another client repeatedly plots a long run.")
    return report


def measure(
    data: Path,
    case: LoopCase,
    records: BenchRecords,
    seconds: float,
    beside: Callable[[RunningService], AbstractContextManager[object]] | None = None,
) -> LoopFigures:
    """Measure one case. ``beside``: a context with an additional load, from before the playback until after the measurement."""
    with ExitStack() as stack:
        service = stack.enter_context(
            RunningService(data, records, cycle_hz=case.cycle_hz, rate_hz=case.rate_hz, settings=case.settings)
        )
        # Start the load first, because the loop's statistics begin when the loop starts.
        clients = stack.enter_context(page_load(service, records)) if case.loaded else None
        if beside:
            stack.enter_context(beside(service))
        reference = stack.enter_context(reference_thread(case.cycle_hz, real_time=case.real_time))
        service.play(records)
        before = _loop(service)
        cycles = before.cycles + round(seconds * case.cycle_hz)
        while (now := _loop(service)).cycles < cycles:
            time.sleep(_POLL_S)
    return LoopFigures(now, now.overruns - before.overruns, now.bus_errors - before.bus_errors, reference, clients)


def _loop(service: RunningService) -> LoopLive:
    live = service.live()
    if live.mode != "playing" or live.loop is None:
        raise BenchError(f"the apparatus is {live.mode} instead of playing; {causes(live)}")
    return live.loop


def _name(case: LoopCase) -> str:
    return f"{case.rate_hz} Hz {'loaded' if case.loaded else 'idle'}{'' if case.real_time else ', no FIFO'}"


def _add_row(report: Report, case: LoopCase, measured: LoopFigures) -> None:
    loop = measured.loop
    suffix = f"{case.rate_hz}hz_{'loaded' if case.loaded else 'idle'}{'' if case.real_time else '_nofifo'}"
    lateness = {name: getattr(loop, f"lateness_{name}_ms") for name in ("p50", "p99", "p999", "max")}
    report.figures |= {f"lateness_{name}_ms_{suffix}": value for name, value in lateness.items()}
    report.figures |= {f"missed_{suffix}": measured.missed, f"bus_errors_{suffix}": measured.bus_errors}
    reference = measured.reference
    report.figures |= {f"floor_p999_ms_{suffix}": reference.p999_ms, f"floor_max_ms_{suffix}": reference.max_ms}
    figures = (f"{value:.3f}" for value in lateness.values())
    report.rows.append(
        (
            _name(case),
            *figures,
            str(measured.missed),
            str(measured.bus_errors),
            f"{reference.p999_ms:.3f}",
            f"{reference.max_ms:.3f}",
        )
    )
    if loop.overruns > measured.missed:
        report.notes.append(
            f"{_name(case)}: {loop.overruns - measured.missed} more cycles missed before the measurement."
        )
    if measured.load:
        report.notes.append(f"{_name(case)}: {measured.load.line()}.")
