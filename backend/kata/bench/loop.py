"""``kata bench loop``: how late the control loop's cycles begin, idle and under load, with and without privileges."""

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from kata.bench.clinic import BenchError, Clinic, causes, prepared
from kata.bench.load import Told, loading
from kata.bench.prepared import Prepared
from kata.bench.reference_thread import Floor, witnessing
from kata.bench.report import Report
from kata.station.schemas import LoopLive

SLOWEST_CYCLE_HZ: Final = 100
"""A slower station reads its bus this often all the same (decisions/0002)."""
_LOOK_AGAIN_S: Final = 0.5
_SPARE_S: Final = 60.0
"""The recording is this much longer than the measurement: it must not end within."""


@dataclass(frozen=True)
class Cell:
    """One measurement."""

    rate_hz: int
    loaded: bool
    real_time: bool

    @property
    def cycle_hz(self) -> int:
        """Bus cycles a second."""
        return self.rate_hz if self.rate_hz >= 50 else SLOWEST_CYCLE_HZ


@dataclass(frozen=True)
class Measured:
    """What came of a cell: the loop's own account since it started, and what it missed within the time measured."""

    loop: LoopLive
    missed: int
    bus_errors: int
    """Replies that stayed away or came late within that time; each makes a cycle longer."""
    floor: Floor
    load: Told | None


def cells(rates: Sequence[int], *, real_time: Sequence[bool], loaded: Sequence[bool]) -> list[Cell]:
    """In the order they are measured."""
    return [Cell(rate, busy, granted) for granted in real_time for rate in rates for busy in sorted(loaded)]


def run(wanted: Sequence[Cell], seconds: float, plot_s: float, progress: Callable[[str], None]) -> Report:
    """Measure every cell, each with a service of its own, while a recording plays.

    :raises BenchError: when no cell came to its end.
    """
    report = Report(
        f"Lateness of the control loop's cycles, {seconds:g} s each",
        ("Loop", "p50, ms", "p99, ms", "p99.9, ms", "max, ms", "missed", "bus errors", "witness p99.9", "max"),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder:
        records = prepared(Path(folder), play_s=seconds + _SPARE_S, plot_s=plot_s)
        for cell in wanted:
            if cell.real_time and not report.on.fifo:
                report.notes.append(f"{cell.rate_hz} Hz with SCHED_FIFO: not measured, it is not granted.")
                continue
            progress(_name(cell))
            try:
                _tell(report, cell, measure(Path(folder), cell, records, seconds))
            except BenchError as error:
                # A measurement that a stop has ended is told, and the others are not lost with it.
                report.notes.append(f"{_name(cell)}: no figures, {error}.")
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
    cell: Cell,
    records: Prepared,
    seconds: float,
    beside: Callable[[Clinic], AbstractContextManager[object]] | None = None,
) -> Measured:
    """One cell. ``beside``: what goes on besides, from before the recording plays until after the measurement."""
    with ExitStack() as stack:
        clinic = stack.enter_context(
            Clinic(data, records, cycle_hz=cell.cycle_hz, rate_hz=cell.rate_hz, real_time=cell.real_time)
        )
        # The load comes first, so that little of the loop's life is without it.
        told = stack.enter_context(loading(clinic, records)) if cell.loaded else None
        if beside:
            stack.enter_context(beside(clinic))
        floor = stack.enter_context(witnessing(cell.cycle_hz, real_time=cell.real_time))
        clinic.play(records)
        before = _loop(clinic)
        cycles = before.cycles + round(seconds * cell.cycle_hz)
        while (now := _loop(clinic)).cycles < cycles:
            time.sleep(_LOOK_AGAIN_S)
    return Measured(now, now.overruns - before.overruns, now.bus_errors - before.bus_errors, floor, told)


def _loop(clinic: Clinic) -> LoopLive:
    live = clinic.live()
    if live.mode != "playing" or live.loop is None:
        raise BenchError(f"the apparatus is {live.mode} instead of playing; {causes(live)}")
    return live.loop


def _name(cell: Cell) -> str:
    return f"{cell.rate_hz} Hz {'loaded' if cell.loaded else 'idle'}{'' if cell.real_time else ', no FIFO'}"


def _tell(report: Report, cell: Cell, measured: Measured) -> None:
    loop = measured.loop
    suffix = f"{cell.rate_hz}hz_{'loaded' if cell.loaded else 'idle'}{'' if cell.real_time else '_nofifo'}"
    told = {name: getattr(loop, f"lateness_{name}_ms") for name in ("p50", "p99", "p999", "max")}
    report.figures |= {f"lateness_{name}_ms_{suffix}": value for name, value in told.items()}
    report.figures |= {f"missed_{suffix}": measured.missed, f"bus_errors_{suffix}": measured.bus_errors}
    floor = measured.floor
    report.figures |= {f"floor_p999_ms_{suffix}": floor.p999_ms, f"floor_max_ms_{suffix}": floor.max_ms}
    figures = (f"{value:.3f}" for value in told.values())
    report.rows.append(
        (
            _name(cell),
            *figures,
            str(measured.missed),
            str(measured.bus_errors),
            f"{floor.p999_ms:.3f}",
            f"{floor.max_ms:.3f}",
        )
    )
    if loop.overruns > measured.missed:
        report.notes.append(
            f"{_name(cell)}: {loop.overruns - measured.missed} more missed before the measurement began."
        )
    if measured.load:
        report.notes.append(f"{_name(cell)}: {measured.load.line()}.")
