"""Measures the latency of the drives' answers, and calculates the cycle rate that an adapter allows. It writes no register."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from kata.commissioning.drive_line import DriveLine
from kata.device.bus.bandwidth import cycle_time_ns
from kata.device.bus.factory import make_bus
from kata.device.bus.serial_transport import Transport, port_of
from kata.device.config import StationConfig

_TRIES: Final = 5
"""Number of requests without an answer after which a drive counts as silent."""
_REQUESTS: Final = 100
"""Number of requests to each drive that answers."""
_BLOCK: Final = 126
_BLOCK_BYTES: Final = 20
"""Number of bytes read: current, velocity, position, voltage and temperature. A drive's part of a cycle's answer is as long."""
LOOP_NS: Final = 2_500_000
"""Time of a cycle in addition to bytes and latency: for the rest of the loop's work, and the margin for a later answer
(:mod:`kata.device.bus.dynamixel.requests`)."""
_PERCENTILE: Final = 99


@dataclass(frozen=True)
class LatencyFigures:
    """The result of a measurement. Times are in ms; NaN without an answer."""

    requests: int
    """Number of expected answers."""
    damaged: int
    silent: tuple[int, ...]
    """Numbers of the motors that did not answer."""
    median_ms: float
    late_ms: float
    """99 % of the times were at most this long."""
    carried_hz: float
    """The highest cycle rate that leaves enough time for ``late_ms``; 0 without an answer."""
    words: str
    """Name of the measured time, as a sentence with a place for the median."""

    @property
    def measured(self) -> str:
        """The times in words."""
        return f"{self.words.format(self.median_ms)}, 99 % of them within {self.late_ms:.1f} ms"


def measure_adapter(
    station: StationConfig, open_transport: Callable[[str, int], Transport] | None = None
) -> LatencyFigures:
    """Read each drive of a station many times. Return the figures.

    :raises BusError: when the port cannot be opened or is gone.
    """
    transport = (open_transport or port_of(station))(station.port, station.baud)
    try:
        line = DriveLine(transport, station.baud)
        silent = tuple(motor for motor, axis in enumerate(station.axes, start=1) if not _measure(line, axis.id))
    finally:
        transport.close()
    return _figures(
        (line.requests, line.damaged, silent), line.latencies_ns, cycle_time_ns(station), "Answers come {:.1f} ms late"
    )


def measure_bus(
    station: StationConfig, open_transport: Callable[[str, int], Transport] | None = None
) -> LatencyFigures:
    """Read many cycles with the station's own driver, for any protocol. Return the figures.

    :raises BusError: when the port cannot be opened or is gone.
    """
    opened: list[Transport] = []

    def open_and_keep(port: str, baud: int) -> Transport:
        opened.append((open_transport or port_of(station))(port, baud))
        return opened[-1]

    bus = make_bus(station, open_and_keep)
    bus.open()
    answering: set[int] = set()
    damaged = 0
    times_ns = []
    try:
        for _ in range(_REQUESTS):
            began_ns = opened[0].now_ns()
            sample = bus.read()
            times_ns.append(opened[0].now_ns() - began_ns)
            damaged += len(sample.corrupt)
            answering |= {motor for motor, drive in enumerate(sample.drives, start=1) if drive}
    finally:
        bus.close()
    silent = tuple(motor for motor in range(1, len(station.axes) + 1) if motor not in answering)
    counts = _REQUESTS * len(station.axes), damaged, silent
    return _figures(counts, times_ns if answering else [], 0.0, "A cycle is read in {:.1f} ms")


def _figures(
    counts: tuple[int, int, tuple[int, ...]], times_ns: Sequence[float], beside_ns: float, words: str
) -> LatencyFigures:
    """Return the figures of measured times. ``counts``: requests, damaged answers, silent motors. ``beside_ns``: rest of a cycle's time."""
    if not times_ns:
        return LatencyFigures(*counts, float("nan"), float("nan"), 0.0, words)
    late_ns = float(np.percentile(times_ns, _PERCENTILE))
    carried_hz = 1e9 / (beside_ns + late_ns + LOOP_NS)
    return LatencyFigures(*counts, float(np.median(times_ns)) / 1e6, late_ns / 1e6, carried_hz, words)


def _measure(line: DriveLine, drive_id: int) -> bool:
    """Read one drive many times. Return False if it is silent."""
    if all(line.read_once(drive_id, _BLOCK, _BLOCK_BYTES)[0] is None for _ in range(_TRIES)):
        return False
    for _ in range(_REQUESTS):
        line.read_once(drive_id, _BLOCK, _BLOCK_BYTES)
    return True
