"""Throttle failed attempts: after several failures, the wait before the next attempt grows."""

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from threading import Lock
from typing import Final

from kata.auth import texts
from kata.errors import ProblemError

_MAX_KEYS: Final = 10_000
_FORGET_AFTER_S: Final = 3600.0


@dataclass(slots=True)
class _Attempts:
    failed: int
    last_s: float
    until_s: float


@dataclass(frozen=True, slots=True)
class BackoffPolicy:
    """Failed attempts before the first wait, the first wait and the longest wait. Each further failure doubles the wait."""

    attempts_before_wait: int
    first_s: float
    longest_s: float


MOST_ATTEMPTS_BY_NAME: Final = 5
FIRST_WAIT_BY_NAME_S: Final = 30.0
LONGEST_WAIT_BY_NAME_S: Final = 900.0
MOST_ATTEMPTS_BY_ADDRESS: Final = 30
FIRST_WAIT_BY_ADDRESS_S: Final = 10.0
LONGEST_WAIT_BY_ADDRESS_S: Final = 300.0
USERNAME_POLICY: Final = BackoffPolicy(MOST_ATTEMPTS_BY_NAME, FIRST_WAIT_BY_NAME_S, LONGEST_WAIT_BY_NAME_S)
"""Policy for a user name, which need not exist, and for a locked screen."""
ADDRESS_POLICY: Final = BackoffPolicy(MOST_ATTEMPTS_BY_ADDRESS, FIRST_WAIT_BY_ADDRESS_S, LONGEST_WAIT_BY_ADDRESS_S)
"""Policy for a browser's address. A whole clinic behind a proxy may share one address."""


class Throttle:
    """Counts failed attempts in memory. A restart clears them; an attacker cannot cause a restart.

    An attempt counts as failed until :meth:`succeeded`, so simultaneous attempts have no advantage.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """``clock``: seconds."""
        self._clock = clock
        self._attempts: OrderedDict[str, _Attempts] = OrderedDict()
        self._lock = Lock()

    def begin(self, *keys: tuple[str, BackoffPolicy]) -> None:
        """Count an attempt for all keys.

        :raises ProblemError: 429 with the time to wait, when one of the keys must wait. The attempt is then not counted.
        """
        with self._lock:
            now_s = self._clock()
            self._check(now_s, *(key for key, _ in keys))
            for key, policy in keys:
                self._count(key, policy, now_s)

    def check(self, key: str) -> None:
        """Check a key without counting an attempt.

        :raises ProblemError: 429 with the time to wait.
        """
        with self._lock:
            self._check(self._clock(), key)

    def succeeded(self, key: str) -> None:
        """Forget all failures of a key after a successful authentication."""
        with self._lock:
            self._attempts.pop(key, None)

    def undo_attempt(self, key: str) -> None:
        """Remove the last attempt of a key from the count."""
        with self._lock:
            attempts = self._attempts.get(key)
            if attempts:
                attempts.failed -= 1
                attempts.until_s = 0.0

    def _check(self, now_s: float, *keys: str) -> None:
        left_s = max((self._left_s(key, now_s) for key in keys), default=0.0)
        if left_s > 0.0:
            raise _too_many(ceil(left_s))

    def _left_s(self, key: str, now_s: float) -> float:
        attempts = self._attempts.get(key)
        return attempts.until_s - now_s if attempts else 0.0

    def _count(self, key: str, policy: BackoffPolicy, now_s: float) -> None:
        attempts = self._attempts.get(key)
        if attempts is None or now_s - attempts.last_s > _FORGET_AFTER_S:
            attempts = _Attempts(0, now_s, 0.0)
        attempts.failed += 1
        attempts.last_s = now_s
        if attempts.failed >= policy.attempts_before_wait:
            # The exponent is bounded, because a year of attempts would otherwise overflow a float.
            factor = 2.0 ** min(attempts.failed - policy.attempts_before_wait, 20)
            attempts.until_s = now_s + min(policy.first_s * factor, policy.longest_s)
        self._attempts[key] = attempts
        self._attempts.move_to_end(key)
        while len(self._attempts) > _MAX_KEYS:
            self._attempts.popitem(last=False)


def _too_many(left_s: int) -> ProblemError:
    return ProblemError(
        429,
        "too_many_tries",
        texts.TOO_MANY_TRIES(),
        texts.TRY_AGAIN_IN_SECONDS(seconds=left_s),
        headers={"Retry-After": str(left_s)},
    )
