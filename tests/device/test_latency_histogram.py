"""The latency histogram compared with numpy."""

from pathlib import Path

import numpy as np
import pytest

from kata.device.config import simulated
from kata.device.latency_histogram import LatencyHistogram
from tests.support.simulated_loop import SimulatedLoop


@pytest.mark.parametrize("typical_us", [5, 60, 900])
def test_percentiles_are_those_of_the_cycles_and_never_flatter(typical_us: int) -> None:
    late_ns = np.random.default_rng(1).lognormal(np.log(typical_us * 1000), 1.0, 20_011).astype(int).tolist()
    lateness = LatencyHistogram()
    for value in late_ns:
        lateness.add(value)

    for percent, told_ms in zip((50, 99, 99.9), lateness.percentiles_ms(50, 99, 99.9), strict=True):
        true_ms = float(np.percentile(late_ns, percent, method="inverted_cdf")) / 1e6
        assert true_ms <= told_ms <= max(true_ms * 1.04, true_ms + 0.0011)
    assert lateness.max_ns == max(late_ns)


def test_before_the_first_cycle_nothing_was_late() -> None:
    assert LatencyHistogram().percentiles_ms(50, 99.9) == (0.0, 0.0)


def test_lateness_beyond_all_classes_counts_in_the_last_one() -> None:
    lateness = LatencyHistogram()
    for late_ns in (-5, 0, 3_000_000_000, 60_000_000_000):
        lateness.add(late_ns)
    assert list(lateness.percentiles_ms(25, 99)) == pytest.approx([0.001024, 60_000.0])


def test_configuring_drives_makes_no_cycle_late(tmp_path: Path) -> None:
    """Opening the port and configuring the drives takes many cycles. The next deadline is counted from the end of both."""
    station = SimulatedLoop(tmp_path, simulated("memory"))
    assert station.snapshot.loop.lateness_max_ms == 0
    sleep = station.loop._sleep
    station.loop._sleep = lambda seconds: sleep(seconds + 0.003)
    station.tick()
    station.loop._sleep = sleep
    station.run(0.2)
    assert station.snapshot.loop.lateness_max_ms == pytest.approx(3, abs=0.1)
