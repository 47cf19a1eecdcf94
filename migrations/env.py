"""Alembic's environment. The program passes a connection; on the command line, KATA_DATABASE_URL names the database."""

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
    """Switch foreign keys off on SQLite, so that a table to which others refer can be replaced. This is impossible within a transaction."""
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
    # On SQLite a batch changes a table by copying it. On other databases it uses ALTER TABLE.
    context.configure(connection=connection, target_metadata=Base.metadata, render_as_batch=True)
    with foreign_keys_off(connection), context.begin_transaction():
        context.run_migrations()


if given := context.config.attributes.get("connection"):
    migrate(given)
else:
    with Database(os.environ["KATA_DATABASE_URL"]).writer.connect() as opened:
        migrate(opened)
