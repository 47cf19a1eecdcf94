"""Limits on the messages of a WebSocket, and the memory of users who exceed them."""

import time
from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final
from uuid import UUID

MESSAGES_PER_S: Final = 10.0
"""Mean rate of messages of one WebSocket. A page sends only Stops, one for each press."""
MESSAGES_AT_ONCE: Final = 40
"""Messages that may come faster than the mean rate allows."""
OFFENCES: Final = 3
"""After this many closed WebSockets within :data:`REFUSED_S`, further ones of the same user at the same address are refused."""
REFUSED_S: Final = 60.0

Offender = tuple[UUID, str]
"""Account and address: the same user at another computer is not affected."""


@dataclass
class Offences:
    """Remembers users whose WebSockets were closed because of too many messages. A Stop by HTTP stays open to them."""

    clock: Callable[[], float] = time.monotonic
    _at_s: dict[Offender, deque[float]] = field(default_factory=lambda: defaultdict(lambda: deque(maxlen=OFFENCES)))

    def add(self, offender: Offender) -> None:
        """Note a closed WebSocket."""
        self._at_s[offender].append(self.clock())

    def is_refused(self, offender: Offender) -> bool:
        """Return True if the user's WebSockets are refused for now."""
        since_s = self.clock() - REFUSED_S
        for known in [known for known, at_s in self._at_s.items() if at_s[-1] < since_s]:
            del self._at_s[known]
        at_s = self._at_s.get(offender, deque())
        return len(at_s) == OFFENCES and at_s[0] >= since_s


@dataclass
class Allowance:
    """The messages that one WebSocket may still send: a token bucket."""

    left: float = MESSAGES_AT_ONCE
    at_s: float = field(default_factory=time.monotonic)

    def take(self) -> bool:
        """Return False if a message came too soon."""
        now_s = time.monotonic()
        self.left = min(MESSAGES_AT_ONCE, self.left + (now_s - self.at_s) * MESSAGES_PER_S) - 1
        self.at_s = now_s
        return self.left >= 0
