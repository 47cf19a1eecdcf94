"""The parts of hours (UTC) for which the figures of the stations are summed.

A part never contains midnight of a time zone inside, so that the days of every clinic are sums of whole parts. Most parts are hours. In time
zones whose offset from UTC is not a whole number of hours, midnight divides an hour: 18:30 UTC in India.
"""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Final

LONGEST: Final = timedelta(hours=1)
DIVIDED_AT: Final[Mapping[int, tuple[int, ...]]] = {
    2: (30,), 3: (30,), 9: (30,), 10: (15,), 11: (15,), 13: (30,), 14: (30,), 15: (15,), 17: (30,), 18: (15, 30), 19: (30,), 20: (30,),
}  # fmt: skip
"""Minutes at which an hour is divided: every midnight of a time zone since 2024, before which Kata had no sessions. Quarters of all hours would
be four times as many rows, and as slow. After a change, a migration must fill the table again.
"""


def begin_of(at: datetime) -> datetime:
    """Return the beginning of the part that contains a time."""
    utc = at.astimezone(UTC)
    minute = max(minute for minute in (0, *DIVIDED_AT.get(utc.hour, ())) if minute <= utc.minute)
    return utc.replace(minute=minute, second=0, microsecond=0)


def end_of(begin: datetime) -> datetime:
    """Return the end of the part that begins at this time."""
    minute = min((minute for minute in DIVIDED_AT.get(begin.hour, ()) if minute > begin.minute), default=60)
    return begin + timedelta(minutes=minute - begin.minute)
