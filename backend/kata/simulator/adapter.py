"""Simulates the latency of the adapter between computer and bus, for example of a USB serial adapter."""

import random
from dataclasses import dataclass, field
from typing import Final

_BURST_NS: Final = 1_000_000
"""A byte that follows another byte within this time has the same latency."""


@dataclass
class AdapterLatency:
    """The latency of the drives' bytes at the computer: a fixed time, plus a random time up to ``jitter_ms`` for each request."""

    fixed_ms: float = 0.0
    jitter_ms: float = 0.0
    _random: random.Random = field(default_factory=lambda: random.Random(0))
    _left_ns: int = 0
    _late_ns: int = 0

    def arrival_ns(self, left_ns: int) -> int:
        """Return the arrival time of the bytes that left a drive at ``left_ns``."""
        if left_ns - self._left_ns > _BURST_NS:
            self._late_ns = int((self.fixed_ms + self._random.random() * self.jitter_ms) * 1e6)
        self._left_ns = left_ns
        return left_ns + self._late_ns
