"""Throttle failed attempts: after some failures, each further attempt must wait longer."""

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from threading import Lock
from typing import Final

from kata.auth import texts
from kata.errors import ProblemError

_KEPT: Final = 10_000
_FORGOTTEN_S: Final = 3600.0


@dataclass(slots=True)
class _Tries:
    failed: int
    last_s: float
    until_s: float


@dataclass(frozen=True, slots=True)
class BackoffPolicy:
    """The number of attempts without a wait, and the first and longest wait. The wait doubles with each failure."""

    free: int
    first_s: float
    longest_s: float


OF_A_NAME: Final = BackoffPolicy(free=5, first_s=30.0, longest_s=900.0)
"""For a user name, existing or not, and for a locked screen."""
OF_AN_ADDRESS: Final = BackoffPolicy(free=30, first_s=10.0, longest_s=300.0)
"""For a browser's address. A whole clinic may share it behind a proxy."""


class Throttle:
    """Counts failed attempts in memory. A restart clears them; an attacker cannot cause a restart.

    An attempt counts as failed until :meth:`succeeded`, so simultaneous attempts gain nothing.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """``clock``: seconds."""
        self._clock = clock
        self._tries: OrderedDict[str, _Tries] = OrderedDict()
        self._lock = Lock()

    def begin(self, *keys: tuple[str, BackoffPolicy]) -> None:
        """Count an attempt for all keys.

        :raises ProblemError: 429 with the time to wait, when one key must wait. The attempt is then not counted.
        """
        with self._lock:
            now_s = self._clock()
            left_s = max((self._left_s(key, now_s) for key, _ in keys), default=0.0)
            if left_s > 0.0:
                raise _too_many(ceil(left_s))
            for key, policy in keys:
                self._count(key, policy, now_s)

    def succeeded(self, key: str) -> None:
        """Forget all failures of a key after a successful authentication."""
        with self._lock:
            self._tries.pop(key, None)

    def was_no_failure(self, key: str) -> None:
        """Do not count the last attempt."""
        with self._lock:
            tries = self._tries.get(key)
            if tries:
                tries.failed -= 1
                tries.until_s = 0.0

    def _left_s(self, key: str, now_s: float) -> float:
        tries = self._tries.get(key)
        return tries.until_s - now_s if tries else 0.0

    def _count(self, key: str, policy: BackoffPolicy, now_s: float) -> None:
        tries = self._tries.get(key)
        if tries is None or now_s - tries.last_s > _FORGOTTEN_S:
            tries = _Tries(0, now_s, 0.0)
        tries.failed += 1
        tries.last_s = now_s
        if tries.failed >= policy.free:
            # The exponent is bounded: a year of attempts would overflow a float.
            factor = 2.0 ** min(tries.failed - policy.free, 20)
            tries.until_s = now_s + min(policy.first_s * factor, policy.longest_s)
        self._tries[key] = tries
        self._tries.move_to_end(key)
        while len(self._tries) > _KEPT:
            self._tries.popitem(last=False)


def _too_many(left_s: int) -> ProblemError:
    return ProblemError(
        429,
        "too_many_tries",
        texts.TOO_MANY_TRIES(),
        texts.TRY_AGAIN_IN_SECONDS(seconds=left_s),
        headers={"Retry-After": str(left_s)},
    )
