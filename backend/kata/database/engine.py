"""Database connections: many readers and, on SQLite, exactly one writer.

SQLite before 3.51.3 can corrupt a write-ahead log when two connections write and checkpoint at the same time. Here only one connection
writes and checkpoints. Readers are opened read-only, so that they do not checkpoint even if they are the last to close.
"""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from datetime import datetime
from pathlib import Path
from typing import Any, Final, Literal, Protocol
from urllib.parse import quote

from sqlalchemy import Connection, Engine, create_engine, event, func, select
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError
from sqlalchemy.orm import Session
from sqlalchemy.pool import QueuePool

from kata.database.availability import AvailabilityMonitor

_BUSY_TIMEOUT_MS: Final = 5000
_WRITERS_CACHE_KIB: Final = 512
"""Size of the writer's page cache in SQLite. The writer rarely reads data that it has written; the default cache would hold 2 MB."""
_CACHED_STATEMENTS: Final = 32
"""Number of prepared statements that a SQLite connection caches. Each length of a list of ids is another statement, which takes some ten
kilobytes; preparing one takes a fraction of a millisecond.
"""
_CONNECT_TIMEOUT_S: Final = 2
"""The shortest timeout that PostgreSQL's client accepts. It applies to each host in the URL."""
SERVICE_ANSWER_S: Final = 4.0
"""Seconds that a request waits for the database. After that, the page shows the database as unavailable."""
_SERVICE_PARAMETERS: Final = {
    # Ends the transaction of a service that hangs, to release its locks.
    "idle_in_transaction_session_timeout": "60s",
    # Detects a service whose computer or network has failed.
    "tcp_keepalives_idle": "10",
    "tcp_keepalives_interval": "5",
    "tcp_keepalives_count": "3",
    # Queries return a page of rows. Starting parallel workers or compiling a query would take longer than the answer.
    "max_parallel_workers_per_gather": "0",
    "jit": "off",
}
_OF_A_CONNECTION: Final = ("tcp_keepalives_idle", "tcp_keepalives_interval", "tcp_keepalives_count")
"""Parameters of one network connection. Behind a pooler they would describe the pooler's connection, which it configures itself."""
_DIRECT_CONNECTIONS: Final = 1
"""Number of direct connections that stay open beside a pooler."""
_SERVER_TIMEOUT_SHARE: Final = 0.8
"""Share of the answer time after which the server itself ends a slow statement."""


class DatabaseError(Exception):
    """The database cannot be used. The message says why and what to do."""


class SessionHook(Protocol):
    """Methods that the database calls around every writing session. They may add rows to the session's transaction."""

    def began(self, session: Session) -> None:
        """Prepare for the session, before its first statement."""

    def about_to_commit(self, session: Session) -> None:
        """Add rows after the session's last statement. An exception rolls the transaction back."""

    def committed(self, session: Session) -> None:
        """Finish after the commit. The method must neither fail nor wait."""


class Database:
    """The clinic's database. It opens short sessions to read or to write."""

    def __init__(self, url: str, *, answer_s: float | None = None, pooler_url: str = "") -> None:
        """``url``: SQLAlchemy's database URL; nothing is opened yet. ``answer_s``: time limit of one answer, including the connection;
        None: no limit, for command-line tools. ``pooler_url``: URL of the same PostgreSQL database through a transaction pooler, which
        then carries every session of :meth:`read` and :meth:`write`.

        :raises DatabaseError: when the URL is invalid or its driver is not installed.
        """
        self.session_hook: SessionHook | None = None
        """Adds the audit trail's rows to every write. :class:`kata.audit.audit_log.AuditHook` registers itself here."""
        self.derived_hook: SessionHook | None = None
        """Refreshes derived rows in every write. :class:`kata.clinic.statistics.derived_tables.DerivedTablesHook` registers itself here."""
        self.monitor: AvailabilityMonitor | None = None
        """Knows whether the database answers. Only a service has a monitor; without one every failure reaches the caller."""
        self.on_waited: Callable[[float], None] = lambda waited_s: None
        """Called from any thread with the seconds that each writing session has waited for its turn. It must not fail."""
        try:
            self.url = make_url(url)
            if self.url.get_backend_name() == "sqlite":
                self.writer = _create_sqlite_engine(self.url, writes=True, answer_s=answer_s)
                self.reader = _create_sqlite_engine(self.url, writes=False, answer_s=answer_s)
                self.direct = self.writer
            elif pooler_url:
                self.writer = self.reader = _create_server_engine(make_url(pooler_url), answer_s, pooled=True)
                self.direct = _create_server_engine(self.url, answer_s, pool_size=_DIRECT_CONNECTIONS)
            else:
                self.writer = self.reader = self.direct = _create_server_engine(self.url, answer_s)
        except ArgumentError as error:
            raise DatabaseError(f"KATA_DATABASE_URL is not a database URL that Kata supports: {error}") from error
        except ModuleNotFoundError as error:
            raise DatabaseError(
                f"the database's driver is not installed ({error}); for PostgreSQL: pip install psycopg[binary], "
                "and a URL that begins with postgresql+psycopg://"
            ) from error

    @property
    def file(self) -> Path | None:
        """Return the SQLite file, or None for PostgreSQL."""
        is_file = self.url.get_backend_name() == "sqlite" and self.url.database
        return Path(str(self.url.database)) if is_file else None

    @property
    def kind(self) -> Literal["sqlite", "postgresql"]:
        """Return the kind of database."""
        return "sqlite" if self.url.get_backend_name() == "sqlite" else "postgresql"

    def size_bytes(self) -> int:
        """Return the size of the database in bytes. For SQLite, it includes the write-ahead log."""
        if self.file:
            parts = (self.file, self.file.with_name(f"{self.file.name}-wal"))
            return sum(part.stat().st_size for part in parts if part.exists())
        with self.read() as session:
            return int(session.scalars(select(func.pg_database_size(func.current_database()))).one())

    @property
    def unavailable_since(self) -> datetime | None:
        """Return the time (UTC) since which the database cannot be written to, or None if no such outage is known."""
        return self.monitor.since if self.monitor else None

    @contextmanager
    def read(self) -> Iterator[Session]:
        """Open a session that only reads.

        :raises DatabaseUnavailableError: when there is a monitor and the database does not answer. If the outage is already known, at once.
        """
        with self.monitor.asking(self.reader) if self.monitor else nullcontext(), Session(self.reader) as session:
            yield session

    @contextmanager
    def read_columns(self) -> Iterator[Connection]:
        """Open a connection that only reads columns, without ORM objects. It takes half of a session's processor time.

        :raises DatabaseUnavailableError: as in :meth:`read`.
        """
        with self.monitor.asking(self.reader) if self.monitor else nullcontext(), self.reader.connect() as connection:
            yield connection

    @contextmanager
    def write(self) -> Iterator[Session]:
        """Open a session that is committed when its block ends, and rolled back when the block raises.

        The clinic's figures and the audit trail are written here. In a service, ``derived_hook`` is
        :class:`kata.clinic.statistics.derived_tables.DerivedTablesHook`, and ``session_hook`` is :class:`kata.audit.audit_log.AuditHook`.
        Each hook collects the session's changes and adds its rows just before the commit, in the same transaction. The audit trail comes
        last. Rows stay readable after the commit.

        :raises DatabaseUnavailableError: as in :meth:`read`. If the connection is lost during the commit, the commit may have succeeded.
        """
        # The hooks are DerivedTablesHook and AuditHook.
        hooks = [hook for hook in (self.derived_hook, self.session_hook) if hook]
        asked_s = time.monotonic()
        asking = self.monitor.asking(self.writer) if self.monitor else nullcontext()
        with asking, Session(self.writer, expire_on_commit=False) as session:
            with session.begin():
                # This waits for the single writer, a pooled connection or a slow server.
                session.connection()
                self.on_waited(time.monotonic() - asked_s)
                for hook in hooks:
                    hook.began(session)
                yield session
                for hook in hooks:
                    session.flush()
                    # Each hook adds its rows to this transaction.
                    hook.about_to_commit(session)
            for hook in hooks:
                hook.committed(session)

    def close(self) -> None:
        """Close every connection."""
        if self.monitor:
            self.monitor.close()
        self.reader.dispose()
        self.writer.dispose()
        self.direct.dispose()


def _create_server_engine(url: URL, answer_s: float | None, *, pooled: bool = False, pool_size: int = 5) -> Engine:
    """``pooled``: a transaction pooler is between this process and the server. Each transaction can then have another server connection."""
    if url.drivername != "postgresql+psycopg":
        return create_engine(url, pool_pre_ping=True, hide_parameters=True)
    arguments: dict[str, Any] = {"connect_timeout": _CONNECT_TIMEOUT_S}
    if answer_s:
        arguments["tcp_user_timeout"] = int(answer_s * 1000)
    if pooled:
        # A statement that one server connection has prepared does not exist on the next one.
        arguments["prepare_threshold"] = None
    engine = create_engine(
        url,
        pool_pre_ping=True,
        hide_parameters=True,
        connect_args=arguments,
        pool_size=pool_size,
        pool_timeout=answer_s or 30.0,
    )
    if answer_s:
        _limit_answer_time(engine, answer_s, pooled=pooled)
    return engine


def _limit_answer_time(engine: Engine, answer_s: float, *, pooled: bool) -> None:
    """Limit the time of statements on the server, and also in this process, because a stopped server does not end a statement."""
    import psycopg
    from psycopg.abc import PQGen

    class Limited(psycopg.Connection[Any]):
        def wait(self, gen: PQGen[Any], interval: float = 0.1, timeout: float | None = None) -> Any:
            try:
                return super().wait(gen, interval, timeout or answer_s)
            except psycopg.OperationalError as error:
                if error.sqlstate is None:
                    # Close the connection, because a late answer would belong to the abandoned statement.
                    self.pgconn.finish()
                raise

    def connect(_: Any, __: Any, arguments: list[Any], keyword_arguments: dict[str, Any]) -> Any:
        return Limited.connect(*arguments, **keyword_arguments)

    set_limits = _set_limits(answer_s, of_transaction=pooled)

    def connected(connection: Any, _: Any) -> None:
        connection.execute(set_limits)
        connection.commit()

    def begun(connection: Any) -> None:
        connection.exec_driver_sql(set_limits)

    event.listen(engine, "do_connect", connect)
    if pooled:
        # A limit of the session would stay on the pooler's connection, which other programs use too.
        event.listen(engine, "begin", begun)
    else:
        event.listen(engine, "connect", connected)


def _set_limits(answer_s: float, *, of_transaction: bool) -> str:
    """Return the statement that sets the service's limits, for the session or only for the present transaction."""
    server_ms = int(answer_s * _SERVER_TIMEOUT_SHARE * 1000)
    limits = _SERVICE_PARAMETERS | {"statement_timeout": str(server_ms), "lock_timeout": str(server_ms)}
    is_local = str(of_transaction).lower()
    calls = [
        f"set_config('{name}', '{value}', {is_local})"
        for name, value in limits.items()
        if not (of_transaction and name in _OF_A_CONNECTION)
    ]
    return "SELECT " + ", ".join(calls)


def _create_sqlite_engine(url: URL, *, writes: bool, answer_s: float | None) -> Engine:
    if not writes:
        # `query_only` would not be enough, because such a connection checkpoints when it is the last one to close.
        file = Path(str(url.database)).absolute()
        url = url.set(database=f"file:{quote(str(file))}", query={"mode": "ro", "uri": "true"})
    # Hiding the parameters keeps patients' data and password hashes out of error messages and logs.
    engine = create_engine(
        url,
        poolclass=QueuePool,
        pool_size=1 if writes else 5,
        max_overflow=0 if writes else 10,
        pool_timeout=answer_s or 30.0,
        # The connection that was used last is used next, so that few page caches of 2 MB are filled.
        pool_use_lifo=True,
        hide_parameters=True,
        connect_args={"cached_statements": _CACHED_STATEMENTS},
    )

    def connected(connection: sqlite3.Connection, record: Any) -> None:
        # sqlite3's own transaction handling begins transactions too late, so `begun` begins them.
        connection.isolation_level = None
        of_writer = ("journal_mode = WAL", "wal_autocheckpoint = 1000", f"cache_size = -{_WRITERS_CACHE_KIB}")
        for pragma in (
            *(of_writer if writes else ("wal_autocheckpoint = 0",)),
            "synchronous = FULL",
            "foreign_keys = ON",
            f"busy_timeout = {_BUSY_TIMEOUT_MS}",
        ):
            connection.execute(f"PRAGMA {pragma}")

    def begun(connection: Any) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    event.listen(engine, "connect", connected)
    event.listen(engine, "begin", begun)
    return engine
