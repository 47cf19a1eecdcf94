"""What ``kata bench bus`` asks of everybody: one cycle, over and over; and what it is told of them."""

from typing import Final, Protocol

import msgspec

from kata.device.config import StationConfig

_SWING_DEG: Final = 1.0


class CycleRunner(Protocol):
    """A library with its port open."""

    def cycle(self) -> int:
        """One cycle; how many of the five drives answered soundly."""

    def close(self) -> None:
        """Close the port."""


class Goals:
    """Two sets in turn, in the middle of the axes' ranges: no library may send what it has sent before."""

    def __init__(self, config: StationConfig) -> None:
        middle = [(axis.min_deg + axis.max_deg) / 2 for axis in config.axes]
        self._sets = middle, [angle + _SWING_DEG for angle in middle]
        self._turn = 0

    def next_deg(self) -> list[float]:
        """Motor angles of the next cycle."""
        self._turn = 1 - self._turn
        return self._sets[self._turn]


class CycleOrder(msgspec.Struct, frozen=True):
    """Cycles to measure: for so long, or so many of them."""

    seconds: float = 0.0
    cycles: int = 0
    before: int = 0
    """Cycles that come first and are not measured."""
    hz: int = 0
    """Cycles a second as the control loop paces them; 0 is one after the other."""


class CycleFigures(msgspec.Struct, frozen=True):
    """What came of an order."""

    cycles: int
    per_s: float
    mean_ms: float
    """Time a cycle took, without the wait for the next."""
    p50_ms: float
    max_ms: float
    sd_us: float
    spread_us: float
    """99th percentile minus median."""
    cpu_percent: float
    """Of one core, this process."""
    lost: int
    """Answers of drives that did not come or were not taken, of five a cycle."""
