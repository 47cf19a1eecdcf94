"""Days of the clinic's time zone. Its offset from UTC changes when summer time begins and ends.

Every day, week and time of day uses this zone, and never that of the service's computer or of the browser (decision 0033).
"""

from collections.abc import Iterator
from datetime import UTC, date, datetime, time, timedelta, tzinfo
from typing import Final
from zoneinfo import ZoneInfo

_STEP: Final = timedelta(days=7)
_EXACT: Final = timedelta(seconds=1)


def zone_of(name: str) -> tzinfo:
    """Return the time zone with this IANA name. Empty: UTC."""
    return ZoneInfo(name) if name else UTC


def midnight(day: date, zone: tzinfo) -> datetime:
    """Return the time in UTC at which a day begins."""
    return datetime.combine(day, time(), tzinfo=zone).astimezone(UTC)


def offset_minutes(at: datetime, zone: tzinfo) -> int:
    """Return the offset of a time zone from UTC at a time."""
    offset = at.astimezone(zone).utcoffset()
    return round(offset.total_seconds() / 60) if offset else 0


def offset_changes(since: datetime, until: datetime, zone: tzinfo) -> Iterator[tuple[datetime, int]]:
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


def _change(begin: datetime, end: datetime, before: int, zone: tzinfo) -> datetime:
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
