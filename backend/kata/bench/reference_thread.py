"""A thread that does nothing but wake at every deadline, beside the control loop: how late this computer itself makes it.

What the loop is later than the witness is its own doing or the work's beside it in the device process; what both are late,
the kernel's or, on a virtual machine, the host's.
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
from kata.device.latency_histogram import Lateness
from kata.system import realtime


class ReferenceLateness(msgspec.Struct):
    """How late the witness woke."""

    p999_ms: float = 0.0
    max_ms: float = 0.0
    missed: int = 0
    """Deadlines that it slept through whole, as the loop counts its own."""


@contextmanager
def reference_thread(hz: int, *, real_time: bool) -> Iterator[ReferenceLateness]:
    """A witness while the block lasts; then it is told how late it was."""
    arguments = ["--hz", str(hz)]
    if not real_time:
        arguments.append("--no-real-time")
    floor = ReferenceLateness()
    with helper_process("kata.bench.reference_thread", *arguments, failure="the witness did not start") as output:
        yield floor
    told = msgspec.json.decode(output.text, type=ReferenceLateness)
    floor.p999_ms, floor.max_ms, floor.missed = told.p999_ms, told.max_ms, told.missed


def main() -> None:
    """Entry of ``python -m kata.bench.reference_thread``."""
    parser = argparse.ArgumentParser(prog="python -m kata.bench.reference_thread", description=__doc__)
    parser.add_argument("--hz", type=int, required=True, help="deadlines a second")
    parser.add_argument("--no-real-time", action="store_true", help="without SCHED_FIFO")
    arguments = parser.parse_args()
    realtime.settle()
    if not arguments.no_real_time:
        realtime.schedule(realtime.CONTROL_PRIORITY)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    lateness, missed = _watch(1_000_000_000 // arguments.hz, until_closed=sys.stdin.fileno())
    (p999_ms,) = lateness.percentiles_ms(99.9)
    sys.stdout.write(json.dumps({"p999_ms": p999_ms, "max_ms": lateness.max_ns / 1e6, "missed": missed}))


def _watch(period_ns: int, until_closed: int) -> tuple[Lateness, int]:
    lateness = Lateness()
    deadline_ns = time.monotonic_ns()
    cycles = missed = 0
    while cycles % 100 or not select.select([until_closed], [], [], 0)[0]:
        cycles += 1
        # As the control loop: a missed deadline is skipped whole.
        steps = max(1, (time.monotonic_ns() - deadline_ns) // period_ns + 1)
        missed += steps - 1
        deadline_ns += steps * period_ns
        time.sleep(max(0, deadline_ns - time.monotonic_ns()) / 1e9)
        lateness.add(time.monotonic_ns() - deadline_ns)
    return lateness, missed


if __name__ == "__main__":
    main()
