"""Connections: many readers and, on SQLite, exactly one writer.

SQLite before 3.51.3 can corrupt a write-ahead log when two connections write and checkpoint at the same time. Here only
one connection ever writes, and it alone checkpoints: readers are opened read-only, so that they do not even when they
are the last to close.
"""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from datetime import datetime
from pathlib import Path
from typing import Any, Final, Protocol
from urllib.parse import quote

from sqlalchemy import Engine, create_engine, event
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError
from sqlalchemy.orm import Session
from sqlalchemy.pool import QueuePool

from kata.database.availability import AvailabilityMonitor

_BUSY_MS: Final = 5000
_WRITERS_CACHE_KIB: Final = 512
"""Of pages, on SQLite: it hardly reads what it has written, and would keep the last 2 MB of it."""
_STATEMENTS: Final = 32
"""So many a connection keeps prepared, on SQLite. A list of ids is another statement for each length of it, of some ten kilobytes; to
prepare one takes a fraction of a millisecond."""
_CONNECT_S: Final = 2
"""As short as PostgreSQL's client lets it be, for each host that the URL names."""
SERVICE_ANSWER_S: Final = 4.0
"""So long a request to the service waits for an answer of the database; then the page says that it is away."""
_OF_A_SERVICE: Final = {
    # Of a transaction whose service hangs, so that it keeps no lock from the others for ever.
    "idle_in_transaction_session_timeout": "60s",
    # Of one whose computer or network is gone.
    "tcp_keepalives_idle": "10",
    "tcp_keepalives_interval": "5",
    "tcp_keepalives_count": "3",
    # What is asked for is a page of something: to start processes that help, or to compile the query, takes longer than the answer.
    "max_parallel_workers_per_gather": "0",
    "jit": "off",
}
_SERVERS_SHARE: Final = 0.8
"""Of the time that an answer may take: a server that is only slow says so itself, and what was asked of it is ended there."""


class DatabaseError(Exception):
    """The database cannot be used; the message says why and what to do."""


class SessionHook(Protocol):
    """Sees every writing session, and may add to it what has to be committed with it, or not at all."""

    def began(self, session: Session) -> None:
        """Nothing has been done in it yet."""

    def about_to_commit(self, session: Session) -> None:
        """All has been done and sent to the database; what is raised here takes all of it back."""

    def committed(self, session: Session) -> None:
        """It stands. Does not fail, and waits for nothing."""


class Database:
    """The clinic's database. Ask it for a session to read or a session to write; both are short."""

    def __init__(self, url: str, *, answer_s: float | None = None) -> None:
        """``url`` is SQLAlchemy's; nothing is opened yet. ``answer_s``: so long one answer may take, a connection included; a tool
        waits for as long as it takes.

        :raises DatabaseError: when it is none, or its driver is not installed.
        """
        self.session_hook: SessionHook | None = None
        self.monitor: AvailabilityMonitor | None = None
        """Of a service: whether it answers. Without one, every failure is the caller's."""
        self.on_waited: Callable[[float], None] = lambda waited_s: None
        """Called with the seconds that each writing session has waited for its turn; from any thread, never to fail."""
        try:
            self.url = make_url(url)
            if self.url.get_backend_name() == "sqlite":
                self.writer = _sqlite(self.url, writes=True, answer_s=answer_s)
                self.reader = _sqlite(self.url, writes=False, answer_s=answer_s)
            else:
                self.writer = self.reader = _server(self.url, answer_s)
        except ArgumentError as error:
            raise DatabaseError(f"KATA_DATABASE_URL names no database that Kata knows: {error}") from error
        except ModuleNotFoundError as error:
            raise DatabaseError(
                f"the database's driver is not installed ({error}); for PostgreSQL: pip install psycopg[binary], "
                "and a URL that begins with postgresql+psycopg://"
            ) from error

    @property
    def file(self) -> Path | None:
        """The SQLite file; None on a server."""
        is_file = self.url.get_backend_name() == "sqlite" and self.url.database
        return Path(str(self.url.database)) if is_file else None

    @property
    def unavailable_since(self) -> datetime | None:
        """Since when it cannot be written to, UTC; None: it can, as far as is known."""
        return self.monitor.since if self.monitor else None

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session that only reads.

        :raises DatabaseUnavailableError: where there is a watch, and it does not answer; at once when that is known.
        """
        with self.monitor.asking(self.reader) if self.monitor else nullcontext(), Session(self.reader) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """A session that is committed when its block ends well, and rolled back when it does not.

        Rows stay readable after the commit.

        :raises DatabaseUnavailableError: as :meth:`read`. Where that shows in the commit itself, it may stand all the same.
        """
        witness = self.session_hook
        asked_s = time.monotonic()
        asking = self.monitor.asking(self.writer) if self.monitor else nullcontext()
        with asking, Session(self.writer, expire_on_commit=False) as session:
            with session.begin():
                # Here one waits for the one writer, for a connection of the pool, for a server that is slow.
                session.connection()
                self.on_waited(time.monotonic() - asked_s)
                if witness:
                    witness.began(session)
                yield session
                if witness:
                    session.flush()
                    witness.about_to_commit(session)
            if witness:
                witness.committed(session)

    def close(self) -> None:
        """Close every connection."""
        if self.monitor:
            self.monitor.close()
        self.reader.dispose()
        self.writer.dispose()


def _server(url: URL, answer_s: float | None) -> Engine:
    if url.drivername != "postgresql+psycopg":
        return create_engine(url, pool_pre_ping=True, hide_parameters=True)
    limited: dict[str, Any] = {"connect_timeout": _CONNECT_S}
    if answer_s:
        limited["tcp_user_timeout"] = int(answer_s * 1000)
    engine = create_engine(
        url, pool_pre_ping=True, hide_parameters=True, connect_args=limited, pool_timeout=answer_s or 30.0
    )
    if answer_s:
        _limit(engine, answer_s)
    return engine


def _limit(engine: Engine, answer_s: float) -> None:
    """A server that is stopped ends nothing by itself: what says that it has gone on for too long has to be on this side, too."""
    import psycopg
    from psycopg.abc import PQGen

    class Limited(psycopg.Connection[Any]):
        def wait(self, gen: PQGen[Any], interval: float = 0.1, timeout: float | None = None) -> Any:
            try:
                return super().wait(gen, interval, timeout or answer_s)
            except psycopg.OperationalError as error:
                if error.sqlstate is None:
                    # Whatever it may still answer is the answer to a question that nobody asks any more.
                    self.pgconn.finish()
                raise

    server_ms = int(answer_s * _SERVERS_SHARE * 1000)
    limits = _OF_A_SERVICE | {"statement_timeout": str(server_ms), "lock_timeout": str(server_ms)}
    set_limits = "SELECT " + ", ".join(f"set_config('{name}', '{value}', false)" for name, value in limits.items())

    def connect(_: Any, __: Any, arguments: list[Any], named: dict[str, Any]) -> Any:
        return Limited.connect(*arguments, **named)

    def connected(connection: Any, _: Any) -> None:
        connection.execute(set_limits)
        connection.commit()

    event.listen(engine, "do_connect", connect)
    event.listen(engine, "connect", connected)


def _sqlite(url: URL, *, writes: bool, answer_s: float | None) -> Engine:
    if not writes:
        # `query_only` would not do: such a connection checkpoints when it is the last one to close.
        file = Path(str(url.database)).absolute()
        url = url.set(database=f"file:{quote(str(file))}", query={"mode": "ro", "uri": "true"})
    # What is written about a patient, or hashed of a password, is in no error message and so in no log.
    engine = create_engine(
        url,
        poolclass=QueuePool,
        pool_size=1 if writes else 5,
        max_overflow=0 if writes else 10,
        pool_timeout=answer_s or 30.0,
        hide_parameters=True,
        connect_args={"cached_statements": _STATEMENTS},
    )

    def connected(connection: sqlite3.Connection, record: Any) -> None:
        # sqlite3's own transaction handling begins too late for us: see `begun`.
        connection.isolation_level = None
        of_writer = ("journal_mode = WAL", "wal_autocheckpoint = 1000", f"cache_size = -{_WRITERS_CACHE_KIB}")
        for pragma in (
            *(of_writer if writes else ("wal_autocheckpoint = 0",)),
            "synchronous = FULL",
            "foreign_keys = ON",
            f"busy_timeout = {_BUSY_MS}",
        ):
            connection.execute(f"PRAGMA {pragma}")

    def begun(connection: Any) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    event.listen(engine, "connect", connected)
    event.listen(engine, "begin", begun)
    return engine
