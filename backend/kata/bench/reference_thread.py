"""Runs a reference thread beside the control loop. It only wakes at every deadline and so measures the latency of the computer itself.

Latency that the loop and the reference have in common comes from the kernel or, on a virtual machine, from its host. Additional
latency of the loop comes from the device process.
"""

import argparse
import json
import select
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import msgspec

from kata.bench.helper_process import helper_process
from kata.device.latency_histogram import LatencyHistogram
from kata.system import realtime


class ReferenceLateness(msgspec.Struct):
    """The latency with which the reference thread woke."""

    p999_ms: float = 0.0
    max_ms: float = 0.0
    missed: int = 0
    """Number of deadlines missed by a whole period, counted as in the loop."""


@contextmanager
def reference_thread(hz: int, *, real_time: bool) -> Iterator[ReferenceLateness]:
    """Run a reference thread during the block. The result is filled in at the end."""
    arguments = ["--hz", str(hz)]
    if not real_time:
        arguments.append("--no-real-time")
    lateness = ReferenceLateness()
    with helper_process(
        "kata.bench.reference_thread", *arguments, failure="the reference thread did not start"
    ) as output:
        yield lateness
    result = msgspec.json.decode(output.text, type=ReferenceLateness)
    lateness.p999_ms, lateness.max_ms, lateness.missed = result.p999_ms, result.max_ms, result.missed


def main() -> None:
    """Run ``python -m kata.bench.reference_thread``."""
    parser = argparse.ArgumentParser(prog="python -m kata.bench.reference_thread", description=__doc__)
    parser.add_argument("--hz", type=int, required=True, help="deadlines a second")
    parser.add_argument("--no-real-time", action="store_true", help="without SCHED_FIFO")
    arguments = parser.parse_args()
    realtime.prepare_interpreter()
    if not arguments.no_real_time:
        realtime.schedule(realtime.CONTROL_PRIORITY)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    lateness, missed = _watch(1_000_000_000 // arguments.hz, until_closed=sys.stdin.fileno())
    (p999_ms,) = lateness.percentiles_ms(99.9)
    sys.stdout.write(json.dumps({"p999_ms": p999_ms, "max_ms": lateness.max_ns / 1e6, "missed": missed}))


def _watch(period_ns: int, until_closed: int) -> tuple[LatencyHistogram, int]:
    lateness = LatencyHistogram()
    deadline_ns = time.monotonic_ns()
    cycles = missed = 0
    while cycles % 100 or not select.select([until_closed], [], [], 0)[0]:
        cycles += 1
        # Skip missed deadlines, as the control loop does.
        steps = max(1, (time.monotonic_ns() - deadline_ns) // period_ns + 1)
        missed += steps - 1
        deadline_ns += steps * period_ns
        time.sleep(max(0, deadline_ns - time.monotonic_ns()) / 1e9)
        lateness.add(time.monotonic_ns() - deadline_ns)
    return lateness, missed


if __name__ == "__main__":
    main()
