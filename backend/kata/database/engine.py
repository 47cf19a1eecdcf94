"""Connections: many readers and, on SQLite, exactly one writer.

SQLite before 3.51.3 can corrupt a write-ahead log when two connections write and checkpoint at the same time. Here only
one connection ever writes, and it alone checkpoints: readers are opened read-only, so that they do not even when they
are the last to close.
"""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Protocol
from urllib.parse import quote

from sqlalchemy import Engine, create_engine, event
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError
from sqlalchemy.orm import Session
from sqlalchemy.pool import QueuePool

_BUSY_MS: Final = 5000


class DatabaseError(Exception):
    """The database cannot be used; the message says why and what to do."""


class Witness(Protocol):
    """Sees every writing session, and may add to it what has to be committed with it, or not at all."""

    def began(self, session: Session) -> None:
        """Nothing has been done in it yet."""

    def about_to_commit(self, session: Session) -> None:
        """All has been done and sent to the database; what is raised here takes all of it back."""

    def committed(self, session: Session) -> None:
        """It stands. Does not fail, and waits for nothing."""


class Database:
    """The clinic's database. Ask it for a session to read or a session to write; both are short."""

    def __init__(self, url: str) -> None:
        """``url`` is SQLAlchemy's; nothing is opened yet.

        :raises DatabaseError: when it is none, or its driver is not installed.
        """
        self.witness: Witness | None = None
        self.on_waited: Callable[[float], None] = lambda waited_s: None
        """Called with the seconds that each writing session has waited for its turn; from any thread, never to fail."""
        try:
            self.url = make_url(url)
            if self.url.get_backend_name() == "sqlite":
                self.writer = _sqlite(self.url, writes=True)
                self.reader = _sqlite(self.url, writes=False)
            else:
                self.writer = self.reader = create_engine(self.url, pool_pre_ping=True, hide_parameters=True)
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

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session that only reads."""
        with Session(self.reader) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """A session that is committed when its block ends well, and rolled back when it does not.

        Rows stay readable after the commit.
        """
        witness = self.witness
        asked_s = time.monotonic()
        with Session(self.writer, expire_on_commit=False) as session:
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
        self.reader.dispose()
        self.writer.dispose()


def _sqlite(url: URL, *, writes: bool) -> Engine:
    if not writes:
        # `query_only` would not do: such a connection checkpoints when it is the last one to close.
        file = Path(str(url.database)).absolute()
        url = url.set(database=f"file:{quote(str(file))}", query={"mode": "ro", "uri": "true"})
    # What is written about a patient, or hashed of a password, is in no error message and so in no log.
    engine = create_engine(
        url, poolclass=QueuePool, pool_size=1 if writes else 5, max_overflow=0 if writes else 10, hide_parameters=True
    )

    def connected(connection: sqlite3.Connection, record: Any) -> None:
        # sqlite3's own transaction handling begins too late for us: see `begun`.
        connection.isolation_level = None
        of_writer = ("journal_mode = WAL", "wal_autocheckpoint = 1000")
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
