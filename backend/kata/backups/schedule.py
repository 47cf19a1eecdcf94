"""The times of daily backups, and the lock that lets one service of a database make them."""

from contextlib import ExitStack
from datetime import datetime, time, timedelta, tzinfo
from typing import Final

from sqlalchemy import func, select

from kata.database.engine import Database

RETRY_AFTER: Final = timedelta(hours=1)
"""Time between a failed backup and the next attempt."""
_DAILY_LOCK_KEY: Final = 0x6B_61_74_61_62_6B_75_70
"""Key of the advisory lock that a service holds during the daily backup. The number is arbitrary."""


def daily_backup_lock(database: Database) -> ExitStack | None:
    """Take the lock of the daily backup; the caller closes it after the backup. Return None if another service on this database has the
    lock.

    PostgreSQL releases the lock when a service is killed. A SQLite database has only one service, which needs no lock.
    """
    with ExitStack() as stack:
        if not database.file:
            # The lock belongs to a session of the server, which a pooler would give to another client.
            connection = stack.enter_context(database.direct.connect())
            # The lock ends with its connection, so the connection must leave the pool.
            connection.detach()
            if not connection.execute(select(func.pg_try_advisory_lock(_DAILY_LOCK_KEY))).scalar_one():
                return None
            connection.commit()
        return stack.pop_all()
    return None


def is_due(now: datetime, at: str, zone: tzinfo, made_at: datetime | None, tried_at: datetime | None) -> bool:
    """Return whether a backup is due: the newest usable backup is older than the last time of day ``at``, and there was no recent attempt.

    :param zone: time zone of the clinic.
    """
    if at == "never" or (tried_at is not None and tried_at > now - RETRY_AFTER):
        return False
    return made_at is None or made_at < _times_around(now, at, zone)[0]


def next_at(now: datetime, at: str, zone: tzinfo) -> datetime | None:
    """Return the next time at the time of day ``at``, or None if ``at`` is ``never``."""
    return None if at == "never" else _times_around(now, at, zone)[1]


def _times_around(now: datetime, at: str, zone: tzinfo) -> tuple[datetime, datetime]:
    """Return the last and the next time at the time of day ``at`` in the clinic's time zone."""
    local = now.astimezone(zone)
    days = [local.date() + timedelta(days=days) for days in (-1, 0, 1)]
    moments = [datetime.combine(day, time.fromisoformat(at), tzinfo=zone).astimezone(now.tzinfo) for day in days]
    return max(moment for moment in moments if moment <= now), min(moment for moment in moments if moment > now)
