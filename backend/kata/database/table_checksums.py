"""Row count and checksum of every table, for comparing two copies of a database.

SQLite and PostgreSQL store the same data differently, so their checksums differ.
"""

from hashlib import sha256
from typing import Any, Final

import msgspec
from sqlalchemy import ColumnClause, Connection, column, inspect, select, table

_BATCH_ROWS: Final = 1000


class TableChecksum(msgspec.Struct, frozen=True):
    """Row count and checksum of one table."""

    rows: int
    checksum: str
    """SHA-256 of the rows in the order of the primary key, in hexadecimal."""


def checksums(connection: Connection) -> dict[str, TableChecksum]:
    """Return the checksum of every table by name. This reads the whole database, which takes seconds for each gigabyte."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql("SET LOCAL TIME ZONE 'UTC'")
    return {name: _checksum_table(connection, name) for name in sorted(inspect(connection).get_table_names())}


def differences(expected: dict[str, TableChecksum], actual: dict[str, TableChecksum]) -> list[str]:
    """Return one sentence for each difference; empty if there is none."""
    sentences = [f"missing table {name}" for name in expected.keys() - actual.keys()]
    sentences += [f"unexpected table {name}" for name in actual.keys() - expected.keys()]
    for name in expected.keys() & actual.keys():
        before, after = expected[name], actual[name]
        if before.rows != after.rows:
            sentences.append(f"{name} has {after.rows} rows instead of {before.rows}")
        elif before != after:
            sentences.append(f"the contents of {name} differ")
    return sorted(sentences)


def _checksum_table(connection: Connection, name: str) -> TableChecksum:
    inspector = inspect(connection)
    # The driver's own values are used, because SQLAlchemy's column types could hide a difference.
    columns: list[ColumnClause[Any]] = [column(described["name"]) for described in inspector.get_columns(name)]
    keys = inspector.get_pk_constraint(name)["constrained_columns"]
    query = select(*columns).select_from(table(name, *columns)).order_by(*([column(key) for key in keys] or columns))
    rows, checksum = 0, sha256()
    for row in connection.execute(query.execution_options(stream_results=True, yield_per=_BATCH_ROWS)):
        rows += 1
        checksum.update(repr([_hash_if_binary(value) for value in row]).encode())
    return TableChecksum(rows, checksum.hexdigest())


def _hash_if_binary(value: Any) -> Any:
    """Return the hash of a binary value, because its text form would be long and slow. Return other values unchanged."""
    return sha256(value).digest() if isinstance(value, bytes | memoryview) else value
