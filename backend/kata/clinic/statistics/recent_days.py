"""The last four weeks of the clinic in whole days: the period of the due patients, of adherence, and of the changes of one's patients."""

from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta, tzinfo
from typing import Final

from kata.clinic.local_time import midnight

RECENT_DAYS: Final = 28
"""A patient without a session or a new programme in so many days is no longer listed as due. The value is our choice."""


@dataclass(frozen=True)
class RecentDays:
    """The 28 days of the clinic's time zone that end with today."""

    today: date
    zone: tzinfo = UTC

    @property
    def first(self) -> date:
        """Return the first day."""
        return self.today - timedelta(days=RECENT_DAYS - 1)

    @property
    def since(self) -> datetime:
        """Return the time at which the first day begins."""
        return midnight(self.first, self.zone)

    @property
    def today_at(self) -> datetime:
        """Return the time at which today begins."""
        return midnight(self.today, self.zone)

    @property
    def until(self) -> datetime:
        """Return the time at which today ends."""
        return midnight(self.today + timedelta(days=1), self.zone)

    def days_since(self, at: datetime) -> int:
        """Return how many of the days follow the day of this time: at most 28, and 0 for today."""
        return min(RECENT_DAYS, (self.today - at.astimezone(self.zone).date()).days)


def recent_days(now: datetime, zone: tzinfo) -> RecentDays:
    """Return the days that end with the clinic's day of ``now``."""
    return RecentDays(now.astimezone(zone).date(), zone)
