"""Poll backoff: drives that do not answer are polled last and rarely, so that they do not delay the others.

On a bus where each drive answers after the drive before it, a silent drive silences all drives after it, and waiting for its
answer costs time in every cycle. Other libraries lose 35 to 104 ms a cycle this way.
"""

import math
from collections.abc import Collection, Iterable
from typing import Final

from kata.device.config import StationConfig

_BACKOFF_CYCLES: Final = 10
"""Cycles between two polls of a silent drive."""


class PollBackoff:
    """Counts the consecutive misses of each address; one answer resets the count."""

    def __init__(self, addresses: Iterable[int], config: StationConfig) -> None:
        self._misses = dict.fromkeys(addresses, 0)
        # A rarely polled drive looks silent. The backoff therefore begins only after the supervisor can have reported the fault.
        silent_ms = max(config.silence_ms, config.inputs.max_age_cycles * 1000 / config.cycle_hz)
        self._misses_before_backoff = math.ceil(silent_ms / 1000 * config.cycle_hz) + 1
        """Consecutive misses after which a drive is polled rarely."""
        self._cycle = 0

    def begin_cycle(self) -> None:
        """Begin a new cycle."""
        self._cycle += 1

    def should_poll(self, address: int) -> bool:
        """Return True if the drive is not in backoff, or if a poll of silent drives is due in this cycle."""
        return self._misses[address] < self._misses_before_backoff or self._cycle % _BACKOFF_CYCLES == 0

    def missed(self, address: int) -> bool:
        """Return True if the drive did not answer its last poll."""
        return self._misses[address] > 0

    @property
    def one_answers(self) -> bool:
        """True if at least one drive answered its last poll."""
        return not all(self._misses.values())

    def poll_order(self) -> list[int]:
        """Return the addresses for a common request: first those that answer, then at most one silent address, in rotation. If
        no drive answers, the cause may be common to all: return all addresses, starting with a different one each time.
        """
        good = [address for address, misses in self._misses.items() if not misses]
        bad = [address for address, misses in self._misses.items() if misses]
        if not bad:
            return good
        place = (self._cycle // _BACKOFF_CYCLES if self._cycle % _BACKOFF_CYCLES == 0 else self._cycle) % len(bad)
        if not self.should_poll(bad[place]):
            return good
        return [*good, bad[place]] if good else bad[place:] + bad[:place]

    def answered(self, asked: list[int], answers: Collection[int]) -> None:
        """Record which of the addresses, polled one after another, have answered."""
        for n, address in enumerate(asked):
            if address in answers:
                self._misses[address] = 0
                continue
            self._misses[address] += 1
            if not any(later in answers for later in asked[n + 1 :]):
                # The addresses after a silent one had no chance to answer.
                return
