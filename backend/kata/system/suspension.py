"""Measures how long the computer was suspended."""

import time


class SuspensionClock:
    """Counts the time for which the computer was suspended. CLOCK_MONOTONIC does not count it."""

    def __init__(self) -> None:
        """Count from now on."""
        self._counted_ns = self.read_ns()

    def read_ns(self) -> int:
        """Return the time for which the computer has been suspended since it started."""
        # If this thread waits between the two calls, the result is too small, never too large.
        since_start_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
        return since_start_ns - time.monotonic_ns()

    def take_ns(self) -> int:
        """Return the time that was not returned before."""
        new_ns = max(0, self.read_ns() - self._counted_ns)
        self._counted_ns += new_ns
        return new_ns
