"""Defines the cycle that ``kata bench bus`` measures, and the messages between the benchmark and the process that drives the bus."""

from typing import Final, Protocol

import msgspec

from kata.device.config import StationConfig

_SWING_DEG: Final = 1.0


class CycleRunner(Protocol):
    """One library with its port open."""

    inputs_lost: int
    """Number of cycles without an answer of the inputs; 0 for libraries that do not read them."""

    def cycle(self) -> int:
        """Run one cycle. Return the number of drives that answered correctly (0 to 5)."""

    def close(self) -> None:
        """Close the port."""


class Goals:
    """Two alternating sets of goals in the middle of the axes' ranges, so that no library can repeat its last message."""

    def __init__(self, config: StationConfig) -> None:
        middle = [(axis.min_deg + axis.max_deg) / 2 for axis in config.axes]
        self._goals = middle, [angle + _SWING_DEG for angle in middle]
        self._next = 0

    def next_deg(self) -> list[float]:
        """Return the motor angles of the next cycle."""
        self._next = 1 - self._next
        return self._goals[self._next]


class CycleOrder(msgspec.Struct, frozen=True):
    """Cycles to measure, by duration or by number."""

    seconds: float = 0.0
    cycles: int = 0
    before: int = 0
    """Number of cycles before the measurement."""
    hz: int = 0
    """Cycle rate, paced as in the control loop; 0: without a pause."""


class CycleFigures(msgspec.Struct, frozen=True):
    """The figures of one :class:`CycleOrder`."""

    cycles: int
    per_s: float
    mean_ms: float
    """Mean duration of a cycle, without the wait for the next cycle."""
    p50_ms: float
    max_ms: float
    sd_us: float
    spread_us: float
    """99th percentile minus median of the durations."""
    cpu_percent: float
    """Processor time of this process, in percent of one core."""
    lost: int
    """Number of missing or rejected answers. A cycle has five answers."""
    inputs_lost: int
    """Number of cycles without an answer of the inputs."""
