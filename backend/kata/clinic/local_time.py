"""Days of the clinic's time zone. Its offset from UTC changes when summer time begins and ends.

A clinic without a time zone has these days instead (``zone`` is None, or the zone that ``clinic/profile/zone.py`` makes):

- In reports, exports, texts of checks and the schedule of backups: the days of the service's computer.
- On the page and in the routes whose weeks and days it shows: the days of the browser, by one offset from UTC, so that a day across a change
  of summer time begins an hour early or late.

Set the clinic's time zone, so that all of them are the same.
"""

from collections.abc import Iterator
from datetime import UTC, date, datetime, time, timedelta, tzinfo
from typing import Final

_STEP: Final = timedelta(days=7)
_EXACT: Final = timedelta(seconds=1)


def midnight(day: date, zone: tzinfo | None) -> datetime:
    """Return the time in UTC at which a day begins. ``zone``: None for this computer's."""
    local = datetime.combine(day, time())
    return (local.replace(tzinfo=zone) if zone else local).astimezone(UTC)


def offset_minutes(at: datetime, zone: tzinfo | None) -> int:
    """Return the offset of a time zone from UTC at a time."""
    offset = at.astimezone(zone).utcoffset()
    return round(offset.total_seconds() / 60) if offset else 0


def offset_changes(since: datetime, until: datetime, zone: tzinfo | None) -> Iterator[tuple[datetime, int]]:
    """Yield each time within a span, both in UTC, at which the offset changes, with the offset in minutes before it.

    Two changes within a week that cancel each other are not found.
    """
    begin = since
    while begin < until:
        end = min(begin + _STEP, until)
        before = offset_minutes(begin, zone)
        if offset_minutes(end, zone) != before:
            yield _change(begin, end, before, zone), before
        begin = end


def _change(begin: datetime, end: datetime, before: int, zone: tzinfo | None) -> datetime:
    """Return the first second with another offset, by bisection."""
    while end - begin > _EXACT:
        middle = (begin + (end - begin) / 2).replace(microsecond=0)
        middle = middle if middle > begin else begin + _EXACT
        if middle >= end:
            break
        if offset_minutes(middle, zone) == before:
            begin = middle
        else:
            end = middle
    return end.replace(microsecond=0)
