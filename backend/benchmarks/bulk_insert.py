"""Rows into a database of a benchmark's own, as quickly as it takes them in."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

from sqlalchemy import Table
from sqlalchemy.schema import CreateIndex, DropIndex

from kata.database.engine import Database

Rows = list[dict[str, Any]]
Insert = Callable[[Table, Rows], None]
"""Called with rows that have the same columns all, each value as SQLite keeps it; PostgreSQL understands the same."""

_UNCHECKED: Final = {
    # Nobody keeps what a power cut would take; what is referred to is loaded by the same hand.
    "sqlite": (
        "PRAGMA foreign_keys = OFF",
        "PRAGMA synchronous = OFF",
        "PRAGMA cache_size = -262144",
        # Written once, and not by way of the log; whoever opens it next puts the log back.
        "PRAGMA journal_mode = OFF",
    ),
    "postgresql": (
        "SET timezone = 'UTC'",
        "SET session_replication_role = 'replica'",
        "SET maintenance_work_mem = '256MB'",
        "SET max_parallel_maintenance_workers = 0",
    ),
}


@contextmanager
def bulk_insert(database: Database, tables: Sequence[Table]) -> Iterator[Insert]:
    """All of the block in one transaction. Only after it the tables get their indexes, and nobody samples whether references hold."""
    dialect = database.writer.dialect
    indexes = [index for table in tables for index in sorted(table.indexes, key=lambda one: str(one.name))]
    connection = database.writer.raw_connection()
    try:
        cursor = connection.cursor()
        for statement in _UNCHECKED[dialect.name]:
            cursor.execute(statement)
        connection.commit()
        cursor.execute("BEGIN")
        for index in indexes:
            cursor.execute(str(DropIndex(index).compile(dialect=dialect)))

        def load(table: Table, rows: Rows) -> None:
            if rows:
                _load(cursor, dialect.name, table.name, list(rows[0]), rows)

        yield load
        for index in indexes:
            cursor.execute(str(CreateIndex(index).compile(dialect=dialect)))
        connection.commit()
    finally:
        # What was set is for this alone: the connection goes.
        connection.invalidate()


def _load(cursor: Any, dialect: str, table: str, names: Sequence[str], rows: Rows) -> None:
    """None of SQLAlchemy's own work for each row."""
    columns = ", ".join(names)
    values = (tuple(row.values()) for row in rows)
    if dialect == "sqlite":
        marks = ", ".join("?" * len(names))
        cursor.executemany(f"INSERT INTO {table} ({columns}) VALUES ({marks})", values)  # noqa: S608 - names of our own tables
    else:
        with cursor.copy(f"COPY {table} ({columns}) FROM STDIN") as copy:
            for row in values:
                copy.write_row(row)
