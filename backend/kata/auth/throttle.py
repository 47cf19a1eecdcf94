"""Back-off: who fails again and again has to wait, longer each time."""

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
    """How many tries in a row are free, and what the next ones cost: the wait doubles each time."""

    free: int
    first_s: float
    longest_s: float


OF_A_NAME: Final = BackoffPolicy(free=5, first_s=30.0, longest_s=900.0)
"""For a user name, whether there is such an account or not; and for a locked screen."""
OF_AN_ADDRESS: Final = BackoffPolicy(free=30, first_s=10.0, longest_s=300.0)
"""For a browser's address, which a whole clinic may share behind a proxy."""


class Throttle:
    """Counts tries that failed, in memory: a restart forgets them, and nobody outside can cause one.

    A try counts as failed from its beginning, until :meth:`succeeded` says otherwise, so that many at once gain nothing.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """``clock``: seconds."""
        self._clock = clock
        self._tries: OrderedDict[str, _Tries] = OrderedDict()
        self._lock = Lock()

    def begin(self, *keys: tuple[str, BackoffPolicy]) -> None:
        """One more try by all of these.

        :raises ProblemError: 429 with the time to wait, when one of them has failed too often; the try counts for none then.
        """
        with self._lock:
            now_s = self._clock()
            left_s = max((self._left_s(key, now_s) for key, _ in keys), default=0.0)
            if left_s > 0.0:
                raise _too_many(ceil(left_s))
            for key, patience in keys:
                self._count(key, patience, now_s)

    def succeeded(self, key: str) -> None:
        """Who this is has been shown: everything before is forgotten."""
        with self._lock:
            self._tries.pop(key, None)

    def was_no_failure(self, key: str) -> None:
        """The last try does not count."""
        with self._lock:
            tries = self._tries.get(key)
            if tries:
                tries.failed -= 1
                tries.until_s = 0.0

    def _left_s(self, key: str, now_s: float) -> float:
        tries = self._tries.get(key)
        return tries.until_s - now_s if tries else 0.0

    def _count(self, key: str, patience: BackoffPolicy, now_s: float) -> None:
        tries = self._tries.get(key)
        if tries is None or now_s - tries.last_s > _FORGOTTEN_S:
            tries = _Tries(0, now_s, 0.0)
        tries.failed += 1
        tries.last_s = now_s
        if tries.failed >= patience.free:
            # The exponent is bounded, or a year of tries would overflow a float.
            doubled = 2.0 ** min(tries.failed - patience.free, 20)
            tries.until_s = now_s + min(patience.first_s * doubled, patience.longest_s)
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
