"""Implements ``kata bench estop``: measures the time from the opening of the emergency stop's contact to torque off at all five drives.

The simulator's clock measures both times: that of the press, and that of the last byte of the instruction that switches a drive's
torque off. The phase of a press within the control loop's cycle is random.
"""

import random
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from kata.bench.loop import LoopCase
from kata.bench.page_load import page_load
from kata.bench.records import BenchRecords
from kata.bench.report import Report
from kata.bench.running_service import BenchError, RunningService, causes, prepare_records
from kata.motion.axes import AXES
from kata.simulator.apparatus import State

_PLAY_S: Final = 10.0
_SETTLE_S: Final = (0.02, 0.06)
"""Range of the time with torque on before a press. It spans several cycles, so that the phase of the press within a cycle is random."""
_READ_AFTER_S: Final = 0.03
"""Wait before reading the simulator's state, because reading takes time that the drives' answers need."""
_OFF_LIMIT_S: Final = 2.0
_ON_LIMIT_S: Final = 2.0
_CAUSE: Final = "estop_pressed"


@dataclass(frozen=True)
class Press:
    """One press with torque on."""

    off_ms: float
    """Time from the press until the last of the five drives has no torque."""
    cause: str
    """First cause of the stop."""


def run(presses: int, case: LoopCase, plot_s: float, progress: Callable[[str], None]) -> Report:
    """Press the emergency stop ``presses`` times.

    :raises BenchError: when torque does not switch off or cannot be switched on again.
    """
    load = "loaded" if case.loaded else "idle"
    report = Report(
        f"Emergency stop to torque off, {case.rate_hz} Hz, {load}",
        ("Presses", "p50, ms", "p99, ms", "p99.9, ms", "max, ms", "other causes"),
    )
    with TemporaryDirectory(prefix="kata-bench-") as folder, ExitStack() as stack:
        records = prepare_records(Path(folder), play_s=_PLAY_S, plot_s=plot_s)
        service = stack.enter_context(
            RunningService(Path(folder), records, cycle_hz=case.cycle_hz, rate_hz=case.rate_hz, settings=case.settings)
        )
        clients = stack.enter_context(page_load(service, records)) if case.loaded else None
        before = service.live().loop
        done: list[Press] = []
        early: list[str] = []
        while len(done) < presses:
            if len(done) % 50 == 0:
                progress(f"{len(done)} of {presses} presses")
            pressed = _press(service, records)
            if isinstance(pressed, Press):
                done.append(pressed)
            else:
                early.append(pressed)
        after = service.live().loop
    _add_figures(report, done, early)
    if before and after:
        granted = "with" if after.real_time else "without"
        report.notes.append(
            f"The loop ran {granted} SCHED_FIFO and missed {after.overruns - before.overruns} cycles during the presses."
        )
    if clients:
        report.notes.append(f"{clients.line()}.")
    return report


def _press(service: RunningService, records: BenchRecords) -> Press | str:
    """Switch torque on, press the emergency stop and acknowledge. If another stop came before the press, return its cause."""
    try:
        service.approach(records)
        _wait_for_state(service, lambda state: all(axis.torque_on for axis in state.axes), _ON_LIMIT_S)
    except BenchError:
        live = service.live()
        if not live.stop:
            raise
        service.insist("acknowledge")
        return causes(live)[0]
    time.sleep(random.uniform(*_SETTLE_S))
    service.hand.estop(pressed=True)
    time.sleep(_READ_AFTER_S)
    state = _wait_for_state(service, lambda state: not any(axis.torque_on for axis in state.axes), _OFF_LIMIT_S)
    pressed_ns = max(event.t_ns for event in state.events if event.what == "estop_pressed")
    off = {event.motor: event.t_ns for event in state.events if event.what == "torque_off" and event.t_ns >= pressed_ns}
    live = service.until(lambda live: live.mode == "stopped", _OFF_LIMIT_S)
    cause = causes(live)[0]
    service.hand.estop(pressed=False)
    service.insist("acknowledge")
    if set(off) != set(AXES):
        return cause
    return Press((max(off.values()) - pressed_ns) / 1e6, cause)


def _wait_for_state(service: RunningService, condition: Callable[[State], object], within_s: float) -> State:
    limit = time.monotonic() + within_s
    while not condition(state := service.hand.state()):
        if time.monotonic() > limit:
            raise BenchError(f"torque was not switched within {within_s:.0f} s; {causes(service.live())}")
        time.sleep(0.01)
    return state


def _add_figures(report: Report, done: list[Press], early: list[str]) -> None:
    by_estop = [press.off_ms for press in done if press.cause == _CAUSE]
    causes = [press.cause for press in done if press.cause != _CAUSE] + early
    if not by_estop:
        raise BenchError(f"no stop came from the emergency stop: {sorted(set(causes))}")
    p50, p99, p999 = np.percentile(by_estop, (50, 99, 99.9), method="inverted_cdf").tolist()
    longest = max(by_estop)
    report.figures |= {
        "estop_presses": len(done) + len(early),
        "estop_p50_ms": p50,
        "estop_p99_ms": p99,
        "estop_p999_ms": p999,
        "estop_max_ms": longest,
        "estop_other_causes": len(causes),
    }
    figures = (f"{value:.2f}" for value in (p50, p99, p999, longest))
    report.rows.append((str(len(done) + len(early)), *figures, str(len(causes))))
    for cause in sorted(set(causes)):
        report.notes.append(f"{causes.count(cause)} stops had {cause} as their first cause. The figures exclude them.")
