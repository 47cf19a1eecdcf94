"""Who does not answer: asked last, and then seldom, so that nobody else has to wait for it.

On a bus where each drive answers after the one before it, one that is silent silences all behind it, and a wait for
its answer costs every cycle. Other libraries lose 35 to 104 ms a cycle to it.
"""

import math
from collections.abc import Collection, Iterable
from typing import Final

from kata.device.config import StationConfig

_BACKOFF_CYCLES: Final = 10
"""Cycles between two tries."""


class PollBackoff:
    """Counts what each address failed to answer in a row; one answer clears it."""

    def __init__(self, addresses: Iterable[int], config: StationConfig) -> None:
        self._misses = dict.fromkeys(addresses, 0)
        # Whoever is asked seldom is as good as silent: not before the supervisor has had to call it so.
        silent_ms = max(config.silence_ms, config.inputs.max_age_cycles * 1000 / config.cycle_hz)
        self._misses_before_backoff = math.ceil(silent_ms / 1000 * config.cycle_hz) + 1
        """Misses in a row until a drive is asked only now and then."""
        self._cycle = 0

    def begin_cycle(self) -> None:
        """A new cycle begins."""
        self._cycle += 1

    def should_poll(self, address: int) -> bool:
        """Whether it answers, or it is time to see whether it does again."""
        return self._misses[address] < self._misses_before_backoff or self._cycle % _BACKOFF_CYCLES == 0

    def poll_order(self) -> list[int]:
        """Those to ask together: who answers first; at most one who does not, in turn, and last."""
        good = [address for address, misses in self._misses.items() if not misses]
        bad = [address for address, misses in self._misses.items() if misses]
        if not bad:
            return good
        turn = bad[(self._cycle // _BACKOFF_CYCLES if self._cycle % _BACKOFF_CYCLES == 0 else self._cycle) % len(bad)]
        return [*good, turn] if self.should_poll(turn) else good

    def answered(self, asked: list[int], answers: Collection[int]) -> None:
        """Take in who of those asked one after another did answer."""
        for n, address in enumerate(asked):
            if address in answers:
                self._misses[address] = 0
                continue
            self._misses[address] += 1
            if not any(later in answers for later in asked[n + 1 :]):
                # Who stands behind it had no chance to answer.
                return
