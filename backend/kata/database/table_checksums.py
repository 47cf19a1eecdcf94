"""What is in a database, in a line a table: how many rows, and a checksum over all that stands in them.

Two copies of one database have the same tallies; SQLite and PostgreSQL do not, as they store the same things differently.
"""

from hashlib import sha256
from typing import Any, Final

import msgspec
from sqlalchemy import ColumnClause, Connection, column, inspect, select, table

_AT_ONCE: Final = 1000


class Tally(msgspec.Struct, frozen=True):
    """Of one table."""

    rows: int
    checksum: str
    """SHA-256 over its rows in the order of the primary key, in hex."""


def tallies(connection: Connection) -> dict[str, Tally]:
    """Of every table there is, by name. Reads all of it: seconds for each gigabyte."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql("SET LOCAL TIME ZONE 'UTC'")
    return {name: _tally(connection, name) for name in sorted(inspect(connection).get_table_names())}


def differences(expected: dict[str, Tally], found: dict[str, Tally]) -> list[str]:
    """What is not the same, in words; empty when all of it is."""
    told = [f"the table {name} is missing" for name in expected.keys() - found.keys()]
    told += [f"the table {name} is too many" for name in found.keys() - expected.keys()]
    for name in expected.keys() & found.keys():
        wanted, there = expected[name], found[name]
        if wanted.rows != there.rows:
            told.append(f"{name} has {there.rows} rows in place of {wanted.rows}")
        elif wanted != there:
            told.append(f"what stands in {name} is not the same")
    return sorted(told)


def _tally(connection: Connection, name: str) -> Tally:
    found = inspect(connection)
    # Without their types, as the driver hands them over: what a type of SQLAlchemy's makes of a value may hide a difference.
    columns: list[ColumnClause[Any]] = [column(one["name"]) for one in found.get_columns(name)]
    keys = found.get_pk_constraint(name)["constrained_columns"]
    query = select(*columns).select_from(table(name, *columns)).order_by(*([column(key) for key in keys] or columns))
    rows, checksum = 0, sha256()
    for row in connection.execute(query.execution_options(stream_results=True, yield_per=_AT_ONCE)):
        rows += 1
        checksum.update(repr([_short(value) for value in row]).encode())
    return Tally(rows, checksum.hexdigest())


def _short(value: Any) -> Any:
    """Samples are long, and slow to write out."""
    return sha256(value).digest() if isinstance(value, bytes | memoryview) else value
