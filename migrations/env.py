"""Alembic's way in: the program hands it a connection; on the command line, KATA_DATABASE_URL names one."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

from alembic import context
from sqlalchemy import Connection

import kata.clinic.tables  # noqa: F401
from kata.database.base import Base
from kata.database.engine import Database


@contextmanager
def foreign_keys_off(connection: Connection) -> Iterator[None]:
    """SQLite: no table that others refer to can be put in place of itself otherwise, and within a transaction it is too late."""
    if connection.dialect.name != "sqlite":
        yield
        return
    raw = connection.connection.cursor()
    raw.execute("PRAGMA foreign_keys = OFF")
    try:
        yield
    finally:
        connection.rollback()
        raw.execute("PRAGMA foreign_keys = ON")
        raw.close()


def migrate(connection: Connection) -> None:
    # SQLite changes tables by copying them; batches do that, and do nothing special elsewhere.
    context.configure(connection=connection, target_metadata=Base.metadata, render_as_batch=True)
    with foreign_keys_off(connection), context.begin_transaction():
        context.run_migrations()


if given := context.config.attributes.get("connection"):
    migrate(given)
else:
    with Database(os.environ["KATA_DATABASE_URL"]).writer.connect() as opened:
        migrate(opened)
