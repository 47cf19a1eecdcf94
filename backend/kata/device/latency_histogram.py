"""Histogram of the latency with which cycles begin. Its bins widen with the latency, so a few hundred bins are enough."""

from bisect import bisect_left
from itertools import accumulate
from typing import Final

_SHARES: Final = 32
"""Number of bins in each octave. A bin's width is at most 3 % of its latency."""
_UNIT_BITS: Final = 10
"""A unit has 2^10 ns. Below 32 units a bin is one unit wide."""
_OCTAVES: Final = 16
"""Number of octaves. The octaves cover latencies up to two seconds. Longer latencies are counted in the last bin.
The maximum is recorded separately.
"""
_LAST: Final = (_OCTAVES + 1) * _SHARES - 1


class LatencyHistogram:
    """Counts latencies. Adding one takes less than 1 us, calculating the percentiles some 10 us."""

    def __init__(self) -> None:
        self._counts = [0] * (_LAST + 1)
        self.max_ns = 0

    def add(self, late_ns: int) -> None:
        """Count one cycle."""
        if late_ns > self.max_ns:
            self.max_ns = late_ns
        units = max(late_ns, 0) >> _UNIT_BITS
        octave = units.bit_length() - _SHARES.bit_length()
        place = units if octave < 0 else (octave << _SHARES.bit_length() - 1) + (units >> octave)
        self._counts[min(place, _LAST)] += 1

    def percentiles_ms(self, *percents: float) -> tuple[float, ...]:
        """Return for each percentage the latency that this share of the cycles did not exceed. The value is rounded up to the
        end of a bin.
        """
        sums = list(accumulate(self._counts))
        return tuple(self._end_ns(bisect_left(sums, sums[-1] * percent / 100)) / 1e6 for percent in percents)

    def _end_ns(self, place: int) -> int:
        octave = max(place // _SHARES - 1, 0)
        end_ns = (place - octave * _SHARES + 1) << octave << _UNIT_BITS
        return self.max_ns if place == _LAST else min(end_ns, self.max_ns)
