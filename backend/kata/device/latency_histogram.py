"""How late cycles begin, counted in classes that grow with the lateness: a few hundred numbers, whatever happens."""

from bisect import bisect_left
from itertools import accumulate
from typing import Final

_SHARES: Final = 32
"""Classes an octave: each is 3 % wide."""
_UNIT_BITS: Final = 10
"""Below 32 units of 1,024 ns a class is one unit."""
_OCTAVES: Final = 16
"""Up to two seconds; what is later is counted in the last class and known by the maximum."""
_LAST: Final = (_OCTAVES + 1) * _SHARES - 1


class LatencyHistogram:
    """Adding costs a fraction of a microsecond, asking for percentiles some ten."""

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
        """For each percentage, what so many of the cycles were not later than; rounded up to the end of a class."""
        sums = list(accumulate(self._counts))
        return tuple(self._end_ns(bisect_left(sums, sums[-1] * percent / 100)) / 1e6 for percent in percents)

    def _end_ns(self, place: int) -> int:
        octave = max(place // _SHARES - 1, 0)
        end_ns = (place - octave * _SHARES + 1) << octave << _UNIT_BITS
        return self.max_ns if place == _LAST else min(end_ns, self.max_ns)
