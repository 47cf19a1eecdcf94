"""Makes the guard of a command that can start motion, release an arm or reset a stop: the state that its sender saw, and its expiry."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Final

from kata.device.ipc_messages import Refusal
from kata.station import texts

COMMAND_VALID_S: Final = 2.0
"""A command is valid for this long after the live state that its sender saw. The page gets at least five states a second. An older state means that
the page or the command was delayed, and the apparatus may have changed."""
_CLOCK_TOLERANCE_S: Final = 0.1
"""Tolerance for rounding in a client. A state cannot have been seen before it was made, because :class:`StateClock` never jumps."""

_EXPIRED: Final = Refusal.of(
    code="expired",
    message=texts.COMMAND_OUTDATED(),
    next_step=texts.LOOK_AND_TRY_AGAIN(),
)
_IN_FUTURE: Final = Refusal.of(
    code="seen_in_future",
    message=texts.COMMAND_IN_FUTURE(),
    next_step=texts.RELOAD_AND_TRY_AGAIN(),
)


@dataclass(frozen=True, slots=True)
class Guard:
    """The fields of a guarded command."""

    stops: int
    """The stop counter of the state that the sender saw."""
    expires_ns: int
    """``time.monotonic_ns`` after which the device refuses the command."""


class StateClock:
    """Gives live states their time. It follows the monotonic clock, so setting the computer's clock does not change the age of a state."""

    def __init__(self, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Start now. ``now_ns``: the monotonic clock, real or stepped."""
        self._now_ns = now_ns
        self._began_ns = now_ns()
        self._began_at = datetime.now(UTC)

    def now(self) -> datetime:
        """Return the time for a state that is made now, UTC."""
        return self._began_at + timedelta(microseconds=(self._now_ns() - self._began_ns) / 1000)

    def guard(self, stops: int, seen_at: datetime) -> Guard | Refusal:
        """Return the guard of a command whose sender saw this counter at ``seen_at`` (a time of this clock); a refusal if it is too old.

        If the service waits, for the database or a lock, the command does not live longer: it expires some time after ``seen_at``.
        """
        seen_ns = self._began_ns + (seen_at - self._began_at) // timedelta(microseconds=1) * 1000
        now_ns = self._now_ns()
        if seen_ns > now_ns + _CLOCK_TOLERANCE_S * 1e9:
            return _IN_FUTURE
        expires_ns = seen_ns + int(COMMAND_VALID_S * 1e9)
        return _EXPIRED if now_ns > expires_ns else Guard(stops, expires_ns)
