"""The changes of all measures in an episode as one blob, because reading a row for each measure takes longer than computing the figures."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any, Final

import numpy as np

from kata.clinic.statistics.measures import MEASURES, improvement

_WEEK: Final = timedelta(weeks=1)
_CHANGE: Final = np.dtype(
    [
        # Unix times in seconds. NaN, like all others, for a measure without an assessment.
        ("first_at", "<f8"), ("last_at", "<f8"),
        ("first", "<f8"), ("last", "<f8"),
        # By how much the value fell, as shown.
        ("improvement", "<f8"),
        # Weeks until the first assessment whose change from the first value was important. NaN if there was none, or no limit is known.
        ("weeks", "<f8"),
    ]
)  # fmt: skip
"""From the first to the last assessment of one measure. After a change, a migration must fill ``episode_outcomes`` again."""


def pack(values: Mapping[str, Sequence[tuple[datetime, float]]]) -> bytes:
    """Return the changes in the order of the measures. ``values``: time and value of each assessment of a measure, in order."""
    changes = np.full(len(MEASURES), np.nan, _CHANGE)
    for place, measure in enumerate(MEASURES):
        if of := values.get(measure):
            (first_at, first), (last_at, last) = of[0], of[-1]
            limit = MEASURES[measure].important
            weeks = (
                (at - first_at) / _WEEK for at, value in of if limit is not None and improvement(first, value) >= limit
            )
            times = first_at.timestamp(), last_at.timestamp()
            changes[place] = (*times, first, last, improvement(first, last), next(weeks, np.nan))
    return changes.tobytes()


def ends(values: Mapping[str, Sequence[tuple[datetime, float]]]) -> tuple[datetime, datetime]:
    """Return the earliest and the latest time of the measures' last assessments. ``values``: as for :func:`pack`, not empty."""
    last = [of[-1][0] for of in values.values()]
    return min(last), max(last)


def unpack(blobs: Iterable[bytes]) -> Any:
    """Return an array with a row for each episode and a column for each measure."""
    return np.frombuffer(b"".join(blobs), _CHANGE).reshape(-1, len(MEASURES))
