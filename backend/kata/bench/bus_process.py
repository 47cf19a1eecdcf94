"""Runs the bus cycles of one library in a separate process, so that processor time and garbage collection belong to that library.

The process reads one :class:`~kata.bench.bus_cycle.CycleOrder` in each line of standard input, as JSON, and answers with its figures.
"""

import argparse
import contextlib
import logging
import os
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgspec

from kata.bench.bus_cycle import CycleFigures, CycleOrder, CycleRunner
from kata.bench.other_libraries import DynamixelSdk, Pymodbus, Rustypot
from kata.bench.own_drivers import KataCycle, KataDrives
from kata.device import config
from kata.device.bus.interface import BusError
from kata.device.config import StationConfig
from kata.system import realtime

_OPEN_ATTEMPTS: Final = 10

RUNNERS: Final[dict[str, Callable[[StationConfig], CycleRunner]]] = {
    "kata": KataDrives,
    "kata_plain": lambda station: KataDrives(station, fast=False),
    "kata_cycle": KataCycle,
    "dynamixel_sdk": lambda station: DynamixelSdk(station, fast=False),
    "dynamixel_sdk_fast": lambda station: DynamixelSdk(station, fast=True),
    "rustypot": Rustypot,
    "pymodbus": Pymodbus,
}


def main() -> None:
    """Run ``python -m kata.bench.bus_process``."""
    parser = argparse.ArgumentParser(prog="python -m kata.bench.bus_process", description=__doc__)
    parser.add_argument("--name", choices=sorted(RUNNERS), required=True, help="the library that drives the bus")
    parser.add_argument("--station", type=Path, required=True, help="the station's configuration")
    parser.add_argument("--no-real-time", action="store_true", help="without SCHED_FIFO")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.CRITICAL)
    try:
        host = _open_runner(arguments.name, config.read(arguments.station))
    except (BusError, OSError, ImportError) as error:
        sys.exit(f"{arguments.name}: {error}")
    realtime.prepare_interpreter()
    granted = not arguments.no_real_time and realtime.schedule(realtime.CONTROL_PRIORITY)
    _reply(b"real time" if granted else b"ordinary")
    for line in sys.stdin.buffer:
        _reply(msgspec.json.encode(_measure(host, msgspec.json.decode(line, type=CycleOrder))))
    host.close()


def _open_runner(name: str, station: StationConfig) -> CycleRunner:
    """Open the port. Try again after a time-out, which a busy computer may cause."""
    for _ in range(_OPEN_ATTEMPTS - 1):
        with contextlib.suppress(BusError):
            return RUNNERS[name](station)
    return RUNNERS[name](station)


def _reply(line: bytes) -> None:
    os.write(sys.stdout.fileno(), line + b"\n")


def _measure(host: CycleRunner, order: CycleOrder) -> CycleFigures:
    for _ in range(order.before):
        host.cycle()
    durations_ns: list[int] = []
    answers, inputs_lost = 0, host.inputs_lost
    period_ns = 1_000_000_000 // order.hz if order.hz else 0
    cpu_ns, began_ns = time.process_time_ns(), time.monotonic_ns()
    deadline_ns = now_ns = began_ns
    end_ns = began_ns + int(order.seconds * 1e9)
    while len(durations_ns) < order.cycles or now_ns < end_ns:
        if period_ns:
            deadline_ns += max(1, (now_ns - deadline_ns) // period_ns + 1) * period_ns
            time.sleep(max(0, deadline_ns - time.monotonic_ns()) / 1e9)
            now_ns = time.monotonic_ns()
        start_ns = now_ns
        answers += host.cycle()
        now_ns = time.monotonic_ns()
        durations_ns.append(now_ns - start_ns)
    spent_ns, cpu_ns = now_ns - began_ns, time.process_time_ns() - cpu_ns
    sorted_ns = sorted(durations_ns)
    return CycleFigures(
        cycles=len(durations_ns),
        per_s=len(durations_ns) / spent_ns * 1e9,
        mean_ms=statistics.fmean(durations_ns) / 1e6,
        p50_ms=sorted_ns[len(sorted_ns) // 2] / 1e6,
        max_ms=sorted_ns[-1] / 1e6,
        sd_us=statistics.pstdev(durations_ns) / 1e3,
        spread_us=(sorted_ns[len(sorted_ns) * 99 // 100] - sorted_ns[len(sorted_ns) // 2]) / 1e3,
        cpu_percent=cpu_ns / spent_ns * 100,
        lost=5 * len(durations_ns) - answers,
        inputs_lost=host.inputs_lost - inputs_lost,
    )


if __name__ == "__main__":
    main()
