"""Measures how long the computer was suspended."""

import time


def suspended_ns() -> int:
    """Return the time for which the computer has been suspended since it started. CLOCK_MONOTONIC does not count this time."""
    # If this thread waits between the two calls, the result is too small, never too large.
    since_start_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    return since_start_ns - time.monotonic_ns()
