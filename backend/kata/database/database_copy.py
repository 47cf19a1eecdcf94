"""A whole copy of the database as it is at one moment, taken while others write; and how one is put back.

SQLite's is taken through a connection that only reads (:mod:`kata.database.engine`: another one writes, and alone checkpoints), in
the transaction that counts, too; PostgreSQL's by ``pg_dump`` in the snapshot that counts. So what was counted is what was copied.
"""

import os
import shutil
import sqlite3
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final, Literal
from uuid import uuid4

from alembic.migration import MigrationContext
from sqlalchemy import Connection, inspect, text
from sqlalchemy.engine import URL
from sqlalchemy.exc import DBAPIError

from kata.database.engine import Database, DatabaseError
from kata.database.programs import postgresql_program
from kata.database.table_checksums import Tally, tallies

DatabaseKind = Literal["sqlite", "postgresql"]

_ASIDE: Final = "before_restore_"
_SCRATCH: Final = "kata_try_"
_FORGOTTEN_S: Final = 86_400
_PARTS: Final = ("", "-wal", "-shm", "-journal")


def kind_of(database: Database) -> DatabaseKind:
    """Which of the two it is."""
    return "sqlite" if database.file else "postgresql"


def schema_of(connection: Connection) -> str:
    """The revision of its tables; empty when it has none."""
    return MigrationContext.configure(connection).get_current_revision() or ""


def size_bytes(database: Database) -> int:
    """What a copy takes at most."""
    if database.file:
        return sum(part.stat().st_size for part in _parts(database.file))
    with database.reader.connect() as connection:
        size: int = connection.exec_driver_sql("SELECT pg_database_size(current_database())").scalar_one()
    return size


def copy(database: Database, file: Path) -> tuple[str, dict[str, Tally]]:
    """Copy it into ``file``: its schema, and what was in it at the moment of the copy.

    :raises DatabaseError: when it cannot be read, or PostgreSQL's programs are missing.
    """
    if database.file and not database.file.exists():
        raise DatabaseError(f"there is no database {database.file} yet; the first start makes it")
    try:
        with database.reader.connect() as connection:
            if database.file:
                with connection.begin(), closing(_new_sqlite(file)) as target:
                    # The transaction begins with what it reads first, and the copy is of what that transaction sees.
                    schema = schema_of(connection)
                    raw = connection.connection.driver_connection
                    assert raw is not None
                    raw.backup(target)
                    return schema, tallies(connection)
            connection = connection.execution_options(isolation_level="REPEATABLE READ")
            with connection.begin():
                snapshot = connection.exec_driver_sql("SELECT pg_export_snapshot()").scalar_one()
                dump = ["--format=custom", "--compress=0", "--no-owner", "--no-privileges", f"--snapshot={snapshot}"]
                _run("pg_dump", database.url, *dump, f"--exclude-schema={_ASIDE}*", f"--file={file}")
                return schema_of(connection), tallies(connection)
    except DBAPIError as error:
        raise DatabaseError(f"the database {_shown(database)} cannot be read: {error.orig}") from error


@contextmanager
def scratch(database: Database, file: Path) -> Iterator[Database]:
    """A copy, put back where it harms nobody, while the block lasts. ``file`` itself is used up.

    :raises DatabaseError: when PostgreSQL refuses to make a database for it, or takes back less than all.
    """
    if database.file:
        with closing(_at(file)) as made:
            yield made
        return
    name = f"{_SCRATCH}{int(time.time())}_{uuid4().hex[:8]}"
    server = database.writer.execution_options(isolation_level="AUTOCOMMIT")
    try:
        with server.connect() as connection:
            for forgotten in _forgotten(connection):
                connection.exec_driver_sql(f'DROP DATABASE IF EXISTS "{forgotten}"')
            connection.exec_driver_sql(f'CREATE DATABASE "{name}" TEMPLATE template0')
    except DBAPIError as error:
        raise DatabaseError(
            f"PostgreSQL makes no database to try the backup in ({error.orig}); "
            f"let its user do so: ALTER ROLE {database.url.username} CREATEDB"
        ) from error
    try:
        url = database.url.set(database=name)
        _put_back(url, file)
        with closing(Database(url.render_as_string(hide_password=False))) as made:
            yield made
    finally:
        with server.connect() as connection:
            connection.exec_driver_sql(f'DROP DATABASE IF EXISTS "{name}" WITH (FORCE)')


@contextmanager
def replaced(database: Database, file: Path, aside: Path) -> Iterator[Database]:
    """The copy in place of the database, once the block has ended well; what was there stays as it was otherwise.

    SQLite's old file goes into the folder ``aside``, PostgreSQL's old tables into a schema of the same name.

    :raises DatabaseError: when somebody else is connected to PostgreSQL, or it takes back less than all.
    """
    if database.file:
        with closing(_at(file)) as made:
            yield made
        _swap(database.file, file, aside)
        return
    schema = _schema(aside)
    with database.writer.begin() as connection:
        if others := _others(connection):
            raise DatabaseError(
                f"others are connected to {_shown(database)} ({', '.join(others)}); stop every Kata that uses it, then restore"
            )
        try:
            connection.exec_driver_sql(f'ALTER SCHEMA public RENAME TO "{schema}"')
            connection.exec_driver_sql("CREATE SCHEMA public")
        except DBAPIError as error:
            raise DatabaseError(
                f"the old tables cannot be put aside ({error.orig}); the schema public has to belong to Kata's user: "
                f"ALTER SCHEMA public OWNER TO {database.url.username}"
            ) from error
    try:
        _put_back(database.url, file)
        yield database
    except BaseException:
        with database.writer.begin() as connection:
            connection.exec_driver_sql("DROP SCHEMA public CASCADE")
            connection.exec_driver_sql(f'ALTER SCHEMA "{schema}" RENAME TO public')
        raise
    with database.writer.begin() as connection:
        if not inspect(connection).get_table_names(schema):
            connection.exec_driver_sql(f'DROP SCHEMA "{schema}" CASCADE')


def schema_aside(database: Database, aside: Path) -> str | None:
    """Under which name PostgreSQL's old tables have stayed, where there were any."""
    if database.file:
        return None
    with database.reader.connect() as connection:
        schema = _schema(aside)
        return schema if schema in inspect(connection).get_schema_names() else None


def found_damaged(connection: Connection) -> list[str]:
    """What the database says of itself, where it is not whole. PostgreSQL finds that when it is put back."""
    if connection.dialect.name != "sqlite":
        return []
    told = [row[0] for row in connection.exec_driver_sql("PRAGMA integrity_check(5)") if row[0] != "ok"]
    told += [
        f"a row of {row[0]} refers to none of {row[2]}"
        for row in connection.exec_driver_sql("PRAGMA foreign_key_check")
    ]
    return told


def _schema(aside: Path) -> str:
    return _ASIDE + "".join(letter for letter in aside.name if letter.isdigit())


def _at(file: Path) -> Database:
    return Database(URL.create("sqlite", database=str(file)).render_as_string())


def _new_sqlite(file: Path) -> sqlite3.Connection:
    os.close(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    return sqlite3.connect(file)


def _parts(file: Path) -> list[Path]:
    return [part for ending in _PARTS if (part := file.with_name(file.name + ending)).exists()]


def _swap(file: Path, made: Path, aside: Path) -> None:
    """All of it, or nothing: what is moved is moved back when the next thing cannot be."""
    file.parent.mkdir(parents=True, exist_ok=True)
    moved: list[Path] = []
    try:
        for part in _parts(file):
            aside.mkdir(parents=True, exist_ok=True)
            shutil.move(part, aside / part.name)
            moved.append(part)
        shutil.move(made, file)
    except BaseException:
        for part in moved:
            shutil.move(aside / part.name, part)
        raise


def _put_back(url: URL, file: Path) -> None:
    options = ("--exit-on-error", "--single-transaction", "--no-owner", "--no-privileges")
    _run("pg_restore", url, *options, str(file))


def _run(program: str, url: URL, *arguments: str) -> None:
    """One of PostgreSQL's programs; the password goes where the list of processes does not show it."""
    path = postgresql_program(program)
    if path is None:
        raise DatabaseError(
            f"{program} is not on this computer; on Debian and Ubuntu: sudo apt install postgresql-client"
        )
    told = url.set(drivername="postgresql", password=None).render_as_string()
    given = os.environ | ({"PGPASSWORD": str(url.password)} if url.password else {})
    done = subprocess.run(
        [path, f"--dbname={told}", *arguments], env=given, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise DatabaseError(f"{program} did not do it: {done.stderr.strip() or done.returncode}")


def _others(connection: Connection) -> list[str]:
    told = connection.exec_driver_sql(
        "SELECT DISTINCT coalesce(nullif(application_name, ''), usename::text) || ' at ' || coalesce(host(client_addr), 'this computer')"
        " FROM pg_stat_activity WHERE datname = current_database() AND pid <> pg_backend_pid()"
        " AND backend_type = 'client backend'"
    )
    return [row[0] for row in told]


def _forgotten(connection: Connection) -> list[str]:
    """What a try that was killed has left."""
    query = text("SELECT datname FROM pg_database WHERE starts_with(datname, :prefix)")
    names = connection.scalars(query, {"prefix": _SCRATCH})
    return [name for name in names if int(name.split("_")[2]) < time.time() - _FORGOTTEN_S]


def _shown(database: Database) -> str:
    return database.url.render_as_string()
