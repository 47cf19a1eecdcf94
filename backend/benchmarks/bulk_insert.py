"""Inserts rows into a benchmark's database as fast as possible."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

from sqlalchemy import Table
from sqlalchemy.schema import CreateIndex, DropIndex

from kata.database.engine import Database

Rows = list[dict[str, Any]]
Insert = Callable[[Table, Rows], None]
"""Function that inserts rows with the same columns. Each value has SQLite's storage form, which PostgreSQL accepts too."""

_SETTINGS: Final = {
    # The data need not survive a power cut. References need no check, because the caller inserts every referenced row.
    "sqlite": (
        "PRAGMA foreign_keys = OFF",
        "PRAGMA synchronous = OFF",
        "PRAGMA cache_size = -262144",
        # Write without a journal; the next connection switches to WAL again.
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
    """Insert rows during the block in one transaction. Indexes are created at its end, and references are not checked."""
    dialect = database.writer.dialect
    indexes = [index for table in tables for index in sorted(table.indexes, key=lambda index: str(index.name))]
    connection = database.writer.raw_connection()
    try:
        cursor = connection.cursor()
        for statement in _SETTINGS[dialect.name]:
            cursor.execute(statement)
        connection.commit()
        cursor.execute("BEGIN")
        for index in indexes:
            cursor.execute(str(DropIndex(index).compile(dialect=dialect)))

        def insert(table: Table, rows: Rows) -> None:
            if rows:
                _insert(cursor, dialect.name, table.name, list(rows[0]), rows)

        yield insert
        for index in indexes:
            cursor.execute(str(CreateIndex(index).compile(dialect=dialect)))
        connection.commit()
    finally:
        # Close the connection, because its settings are only for the insertion.
        connection.invalidate()


def _insert(cursor: Any, dialect: str, table: str, names: Sequence[str], rows: Rows) -> None:
    """Insert rows without SQLAlchemy, which would take time for each row."""
    columns = ", ".join(names)
    values = (tuple(row.values()) for row in rows)
    if dialect == "sqlite":
        marks = ", ".join("?" * len(names))
        cursor.executemany(f"INSERT INTO {table} ({columns}) VALUES ({marks})", values)  # noqa: S608 - names of our own tables
    else:
        with cursor.copy(f"COPY {table} ({columns}) FROM STDIN") as copy:
            for row in values:
                copy.write_row(row)
