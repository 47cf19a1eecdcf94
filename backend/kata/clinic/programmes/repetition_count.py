"""Count the repetitions of a run once, when its journal is imported, so that no later request loads samples to count them."""

from collections.abc import Callable
from typing import Final

import numpy as np

from kata.device.journal import PHASE_PLAYING, PHASE_REDUCED_RANGE, PHASE_REVERSING, Journal
from kata.motion.edit import Motion, PlaybackSettings
from kata.motion.repetitions import repetition_times_of

_FORWARD: Final = (PHASE_PLAYING, PHASE_REDUCED_RANGE)
"""Phases in which a repetition advances. A repetition with reduced range also counts."""
_ON_THE_PATH: Final = (*_FORWARD, PHASE_REVERSING)


def count_repetitions(
    journal: Journal, outcome: str, settings: PlaybackSettings, motions: Callable[[], tuple[Motion, Motion]]
) -> tuple[int, float]:
    """Return how many repetitions a finished run completed, and how many seconds it spent on the path.

    ``motions`` returns the motion of the recording and that of the run. It is called only if they are needed.
    """
    played_s = float(np.isin(journal.phase, _ON_THE_PATH).sum()) / journal.rate_hz
    reached_s = journal.path_s[np.isin(journal.phase, _FORWARD)]
    if outcome == "completed":
        return settings.repetitions, played_s
    if len(reached_s) == 0:
        return 0, played_s
    times = repetition_times_of(*motions(), settings)
    # The last sample of a repetition can be one sample before its end, with some jitter.
    return times.done(float(reached_s.max()) + 1.5 / journal.rate_hz), played_s
