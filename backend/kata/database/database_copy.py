"""Copy the whole database as it is at one moment while other programs write, and restore such a copy.

SQLite is copied through a read-only connection, because only the one writer of :mod:`kata.database.engine` may checkpoint. PostgreSQL is
copied with ``pg_dump``. The checksums are taken in the same transaction or snapshot, so they describe exactly the copied data.
"""

import os
import shutil
import sqlite3
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from time import sleep
from typing import Final, Literal
from uuid import uuid4

from sqlalchemy import Connection, inspect, text
from sqlalchemy.engine import URL
from sqlalchemy.exc import DBAPIError

from kata.database.engine import Database, DatabaseError
from kata.database.postgresql_programs import postgresql_program
from kata.database.table_checksums import TableChecksum, checksums
from kata.database.upgrade import schema_of

DatabaseKind = Literal["sqlite", "postgresql"]

_ASIDE_PREFIX: Final = "before_restore_"
_SCRATCH_PREFIX: Final = "kata_try_"
_LEFTOVER_AFTER_S: Final = 86_400
_DISCONNECTED_WITHIN_S: Final = 3.0
_ASK_AGAIN_AFTER_S: Final = 0.05
_FILE_SUFFIXES: Final = ("", "-wal", "-shm", "-journal")


def kind_of(database: Database) -> DatabaseKind:
    """Return the kind of database."""
    return "sqlite" if database.file else "postgresql"


def size_bytes(database: Database) -> int:
    """Return an upper bound of the size of a copy in bytes."""
    if database.file:
        return sum(part.stat().st_size for part in _existing_files(database.file))
    with database.reader.connect() as connection:
        size: int = connection.exec_driver_sql("SELECT pg_database_size(current_database())").scalar_one()
    return size


def copy(database: Database, file: Path) -> tuple[str, dict[str, TableChecksum]]:
    """Copy the database into ``file``. Return the revision of its schema, and the checksums of its tables.

    :raises DatabaseError: when the database cannot be read, or PostgreSQL's programs are missing.
    """
    if database.file and not database.file.exists():
        raise DatabaseError(f"there is no database {database.file} yet; the first start creates it")
    try:
        with database.reader.connect() as connection:
            if database.file:
                with connection.begin(), closing(_create_sqlite_file(file)) as target:
                    # This first read begins the transaction. The copy contains the data that the transaction sees.
                    schema = schema_of(connection)
                    raw = connection.connection.driver_connection
                    assert raw is not None
                    raw.backup(target)
                    return schema, checksums(connection)
            connection = connection.execution_options(isolation_level="REPEATABLE READ")
            with connection.begin():
                snapshot = connection.exec_driver_sql("SELECT pg_export_snapshot()").scalar_one()
                dump = ["--format=custom", "--compress=0", "--no-owner", "--no-privileges", f"--snapshot={snapshot}"]
                _run_program("pg_dump", database.url, *dump, f"--exclude-schema={_ASIDE_PREFIX}*", f"--file={file}")
                return schema_of(connection), checksums(connection)
    except DBAPIError as error:
        raise DatabaseError(f"the database {_url_text(database)} cannot be read: {error.orig}") from error


@contextmanager
def scratch(database: Database, file: Path) -> Iterator[Database]:
    """Restore a copy into a scratch database while the context lasts. ``file`` becomes the SQLite database or is read into a PostgreSQL
    database.

    :raises DatabaseError: when PostgreSQL refuses to create the database, or cannot restore everything.
    """
    if database.file:
        with closing(_open_sqlite(file)) as copied:
            yield copied
        return
    name = f"{_SCRATCH_PREFIX}{int(time.time())}_{uuid4().hex[:8]}"
    server = database.writer.execution_options(isolation_level="AUTOCOMMIT")
    try:
        with server.connect() as connection:
            for leftover in _leftover_databases(connection):
                connection.exec_driver_sql(f'DROP DATABASE IF EXISTS "{leftover}"')
            connection.exec_driver_sql(f'CREATE DATABASE "{name}" TEMPLATE template0')
    except DBAPIError as error:
        raise DatabaseError(
            f"PostgreSQL refuses to create a database for the trial restore ({error.orig}); "
            f"allow it: ALTER ROLE {database.url.username} CREATEDB"
        ) from error
    try:
        url = database.url.set(database=name)
        _run_pg_restore(url, file)
        with closing(Database(url.render_as_string(hide_password=False))) as copied:
            yield copied
    finally:
        with server.connect() as connection:
            connection.exec_driver_sql(f'DROP DATABASE IF EXISTS "{name}" WITH (FORCE)')


@contextmanager
def replaced(database: Database, file: Path, aside: Path) -> Iterator[Database]:
    """Replace the database by the copy if the block ends without an error; otherwise leave the database unchanged.

    The previous SQLite file is moved into the folder ``aside``, the previous PostgreSQL tables into a schema of the same name.

    :raises DatabaseError: when other clients are connected to PostgreSQL, or PostgreSQL cannot restore everything.
    """
    if database.file:
        with closing(_open_sqlite(file)) as copied:
            yield copied
        _replace_files(database.file, file, aside)
        return
    schema = _aside_schema(aside)
    with database.writer.begin() as connection:
        if other_clients := _remaining_clients(connection):
            raise DatabaseError(
                f"other clients are connected to {_url_text(database)} ({', '.join(other_clients)}); stop every Kata that uses it, then restore"
            )
        try:
            connection.exec_driver_sql(f'ALTER SCHEMA public RENAME TO "{schema}"')
            connection.exec_driver_sql("CREATE SCHEMA public")
        except DBAPIError as error:
            raise DatabaseError(
                f"the previous tables cannot be moved aside ({error.orig}); Kata's user must own the schema public: "
                f"ALTER SCHEMA public OWNER TO {database.url.username}"
            ) from error
    try:
        _run_pg_restore(database.url, file)
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
    """Return the schema with PostgreSQL's previous tables, or None if there were none."""
    if database.file:
        return None
    with database.reader.connect() as connection:
        schema = _aside_schema(aside)
        return schema if schema in inspect(connection).get_schema_names() else None


def found_damaged(connection: Connection) -> list[str]:
    """Return the damage that SQLite's checks find. PostgreSQL finds damage when it restores a copy."""
    if connection.dialect.name != "sqlite":
        return []
    damages = [row[0] for row in connection.exec_driver_sql("PRAGMA integrity_check(5)") if row[0] != "ok"]
    damages += [
        f"a row of {row[0]} refers to a missing row of {row[2]}"
        for row in connection.exec_driver_sql("PRAGMA foreign_key_check")
    ]
    return damages


def _aside_schema(aside: Path) -> str:
    return _ASIDE_PREFIX + "".join(letter for letter in aside.name if letter.isdigit())


def _open_sqlite(file: Path) -> Database:
    return Database(URL.create("sqlite", database=str(file)).render_as_string())


def _create_sqlite_file(file: Path) -> sqlite3.Connection:
    os.close(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    return sqlite3.connect(file)


def _existing_files(file: Path) -> list[Path]:
    return [part for ending in _FILE_SUFFIXES if (part := file.with_name(file.name + ending)).exists()]


def _replace_files(file: Path, new_file: Path, aside: Path) -> None:
    """Move all files or none: after an error, move back those that were moved."""
    file.parent.mkdir(parents=True, exist_ok=True)
    moved: list[Path] = []
    try:
        for part in _existing_files(file):
            aside.mkdir(parents=True, exist_ok=True)
            shutil.move(part, aside / part.name)
            moved.append(part)
        shutil.move(new_file, file)
    except BaseException:
        for part in moved:
            shutil.move(aside / part.name, part)
        raise


def _run_pg_restore(url: URL, file: Path) -> None:
    options = ("--exit-on-error", "--single-transaction", "--no-owner", "--no-privileges")
    _run_program("pg_restore", url, *options, str(file))


def _run_program(program: str, url: URL, *arguments: str) -> None:
    """Run one of PostgreSQL's programs. The password is passed in an environment variable, because process lists show arguments."""
    path = postgresql_program(program)
    if path is None:
        raise DatabaseError(
            f"{program} is not on this computer; on Debian and Ubuntu: sudo apt install postgresql-client"
        )
    address = url.set(drivername="postgresql", password=None).render_as_string()
    environment = os.environ | ({"PGPASSWORD": str(url.password)} if url.password else {})
    done = subprocess.run(
        [path, f"--dbname={address}", *arguments], env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise DatabaseError(f"{program} failed: {done.stderr.strip() or done.returncode}")


def _remaining_clients(connection: Connection) -> list[str]:
    """Return the other clients. The server still lists a client for a moment after it has disconnected, so ask several times."""
    limit_s = time.monotonic() + _DISCONNECTED_WITHIN_S
    while (other_clients := _other_clients(connection)) and time.monotonic() < limit_s:
        sleep(_ASK_AGAIN_AFTER_S)
        # A transaction sees the list of its first look until this call.
        connection.exec_driver_sql("SELECT pg_stat_clear_snapshot()")
    return other_clients


def _other_clients(connection: Connection) -> list[str]:
    rows = connection.exec_driver_sql(
        "SELECT DISTINCT coalesce(nullif(application_name, ''), usename::text) || ' at ' || coalesce(host(client_addr), 'this computer')"
        " FROM pg_stat_activity WHERE datname = current_database() AND pid <> pg_backend_pid()"
        " AND backend_type = 'client backend'"
    )
    return [row[0] for row in rows]


def _leftover_databases(connection: Connection) -> list[str]:
    """Return the scratch databases that killed trial restores have left."""
    query = text("SELECT datname FROM pg_database WHERE starts_with(datname, :prefix)")
    names = connection.scalars(query, {"prefix": _SCRATCH_PREFIX})
    return [name for name in names if int(name.split("_")[2]) < time.time() - _LEFTOVER_AFTER_S]


def _url_text(database: Database) -> str:
    return database.url.render_as_string()
