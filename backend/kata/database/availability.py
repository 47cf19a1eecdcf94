"""Monitor whether the database answers. While it does not, every access fails at once, and one thread retries.

Only the first requests of an outage therefore wait, no thread of the service is blocked, and the returning database is not overloaded.
"""

import logging
import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from typing import Final

from sqlalchemy import Engine, text
from sqlalchemy.exc import DBAPIError, SQLAlchemyError
from sqlalchemy.exc import TimeoutError as NoConnectionError

from kata.database.base import utc_now

log = logging.getLogger(__name__)

_RETRY_S: Final = 1.0
_SQLITE_LOST_CODES: Final = frozenset(
    {
        sqlite3.SQLITE_BUSY,
        sqlite3.SQLITE_LOCKED,
        sqlite3.SQLITE_READONLY,
        sqlite3.SQLITE_IOERR,
        sqlite3.SQLITE_FULL,
        sqlite3.SQLITE_CANTOPEN,
    }
)
_FAILED_ACCESS_CODES: Final = frozenset({"55P03", "57014", "40P01", "40001"})
"""PostgreSQL's error codes of a slow lock or statement, a deadlock or a conflict. The server answers, but this access failed."""
_LOST_CODE_PREFIXES: Final = ("08", "53", "57P", "58")
"""Prefixes of PostgreSQL's error codes while it shuts down, starts up, or lacks memory, connections or disk space."""
_READ_ONLY_CODE: Final = "25006"
"""PostgreSQL's error code of a server that is read-only because another server has become the primary."""


DATABASE_UNAVAILABLE: Final = "database_away"
"""Error code of every refusal while the database does not answer."""


class DatabaseUnavailableError(SQLAlchemyError):
    """The database does not answer or cannot be written to, since ``since`` (UTC). No change is confirmed."""

    def __init__(self, since: datetime) -> None:
        super().__init__(f"the database does not answer since {since:%Y-%m-%d %H:%M:%S} UTC")
        self.since = since


class AvailabilityMonitor:
    """Knows for each engine since when it is unavailable. A SQLite file may be readable but not writable."""

    def __init__(
        self, writer: Engine, *, retry_s: float = _RETRY_S, on_back: Callable[[datetime], None] = lambda since: None
    ) -> None:
        """``retry_s``: pause between retries. ``on_back``: called from a thread, with the start of the outage, when an outage has ended."""
        self._writer = writer
        self._retry_s = retry_s
        self.on_back = on_back
        self._lost: dict[Engine, datetime] = {}
        self._changed = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="database", daemon=True)
        self._thread.start()

    @property
    def since(self) -> datetime | None:
        """Return the time (UTC) since which the database cannot be written to, or None if no such outage is known."""
        return self._lost.get(self._writer)

    @contextmanager
    def asking(self, engine: Engine) -> Iterator[None]:
        """Access the database within this context.

        :raises DatabaseUnavailableError: at once while the engine is unavailable, or when the access fails for that reason.
        """
        if since := self._lost.get(engine):
            raise DatabaseUnavailableError(since)
        try:
            yield
        except (DBAPIError, NoConnectionError) as error:
            if _is_lost(error):
                raise DatabaseUnavailableError(self._mark_lost(engine, error)) from error
            if isinstance(error, NoConnectionError) or _sqlstate(error) in _FAILED_ACCESS_CODES:
                raise DatabaseUnavailableError(utc_now()) from error
            raise

    def until_back(self, limit_s: float) -> bool:
        """Wait at most ``limit_s`` seconds. Return whether the database can then be written to."""
        with self._changed:
            return self._changed.wait_for(lambda: self._closing or self._writer not in self._lost, limit_s)

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(self._retry_s)

    def _mark_lost(self, engine: Engine, error: SQLAlchemyError) -> datetime:
        with self._changed:
            if engine not in self._lost:
                log.error("the database does not answer: %s", getattr(error, "orig", None) or error)
                self._lost[engine] = utc_now()
                self._changed.notify_all()
            since = self._lost[engine]
        if _sqlstate(error) == _READ_ONLY_CODE:
            # The open connections lead to the wrong server.
            engine.dispose()
        return since

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._lost)
                if self._changed.wait_for(lambda: self._closing, self._retry_s):
                    return
                outages = dict(self._lost)
            for engine, since in outages.items():
                if self._is_answering(engine):
                    with self._changed:
                        del self._lost[engine]
                        self._changed.notify_all()
                    log.warning(
                        "the database answers again; it had been unavailable since %s",
                        since.isoformat(timespec="seconds"),
                    )
                    if engine is self._writer:
                        self.on_back(since)

    def _is_answering(self, engine: Engine) -> bool:
        try:
            with engine.begin() as connection:
                connection.execute(text("SELECT 1"))
                if engine is self._writer:
                    # This must be a write, because a database on a full disk can still be read.
                    connection.execute(text("UPDATE alembic_version SET version_num = version_num"))
        except SQLAlchemyError:
            return False
        return True


def _is_lost(error: SQLAlchemyError) -> bool:
    if not isinstance(error, DBAPIError):
        return False
    if isinstance(error.orig, sqlite3.OperationalError):
        return (getattr(error.orig, "sqlite_errorcode", 0) & 0xFF) in _SQLITE_LOST_CODES
    code = _sqlstate(error)
    # An error without a code comes from the client: there was no connection, or it was abandoned.
    no_word = code is None and type(error).__name__ in ("OperationalError", "InterfaceError")
    return (
        error.connection_invalidated
        or no_word
        or code == _READ_ONLY_CODE
        or (code or "").startswith(_LOST_CODE_PREFIXES)
    )


def _sqlstate(error: SQLAlchemyError) -> str | None:
    """Return PostgreSQL's error code, or None."""
    code: str | None = getattr(getattr(error, "orig", None), "sqlstate", None)
    return code
