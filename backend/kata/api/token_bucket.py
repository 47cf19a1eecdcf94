"""Token bucket that limits how much a client may send or open."""

import time
from dataclasses import dataclass, field


@dataclass
class TokenBucket:
    """A token bucket: ``per_s`` tokens a second on average, and at most ``at_once`` tokens without a pause."""

    per_s: float
    at_once: float
    left: float = field(init=False)
    at_s: float = field(init=False)

    def __post_init__(self) -> None:
        """Begin with a full bucket."""
        self.left = self.at_once
        self.at_s = time.monotonic()

    def take(self) -> bool:
        """Take one token and return True. Return False and take nothing if less than one is left."""
        self._refill()
        if self.left < 1:
            return False
        self.left -= 1
        return True

    def take_some(self, amount: int) -> int:
        """Take ``amount`` tokens, or as many as are left. Return the number taken."""
        self._refill()
        amount_taken = min(amount, int(self.left))
        self.left -= amount_taken
        return amount_taken

    @property
    def is_full(self) -> bool:
        """True if the bucket is full: nothing was taken, or it has refilled since."""
        self._refill()
        return self.left == self.at_once

    def _refill(self) -> None:
        now_s = time.monotonic()
        self.left = min(self.at_once, self.left + (now_s - self.at_s) * self.per_s)
        self.at_s = now_s
