"""Upgrade the database to this program's schema when the service starts.

A SQLite file is copied before the upgrade, so that the copy can replace it later. Each migration is one transaction, so a killed start
leaves a complete version, from which the next start continues.
"""

import logging
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from sqlalchemy import Connection, String, inspect, select, text
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base
from kata.database.engine import Database, DatabaseError

log = logging.getLogger(__name__)

_IN_PACKAGE: Final = Path(__file__).parent / "migrations"
_IN_REPOSITORY: Final = Path(__file__).parents[3] / "migrations"
_REVISION_TABLE: Final = "alembic_version"
_COPIES_KEPT: Final = 2
"""Number of upgrades whose copies are kept."""
_LOCK_KEY: Final = 0x6B617462
"""Key of PostgreSQL's advisory lock for upgrades."""
_DISK_SPACE_FACTOR: Final = 3
"""Required disk space as a multiple of the database size: the copy, and old and new versions of rewritten tables."""


def migrations() -> Path:
    """Return the folder of migrations, which is in the installed package or at the top of a checkout."""
    return _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY


class SchemaRow(Base):
    """A schema revision that the database has reached. Its migration adds the row, and older programs read it."""

    __tablename__ = "schemas"

    revision: Mapped[str] = mapped_column(String(32), primary_key=True)
    oldest: Mapped[str] = mapped_column(String(32))
    """The oldest revision whose program can use this schema, because later migrations only add to it."""


def newest_revision() -> str:
    """Return the schema revision of this program. The names of the migration files begin with their revisions, in order."""
    return max(file.stem.partition("_")[0] for file in (migrations() / "versions").glob("*.py"))


def schema_of(connection: Connection) -> str:
    """Return the schema revision, or an empty text if there is none."""
    if not inspect(connection).has_table(_REVISION_TABLE):
        return ""
    return connection.scalar(text(f"SELECT version_num FROM {_REVISION_TABLE}")) or ""  # noqa: S608 - a constant


def upgrade(database: Database) -> None:
    """Apply the missing migrations. A newer database that this program can use stays unchanged.

    :raises DatabaseError: when the database cannot be opened, the disk has too little space, or only a newer version of Kata can use the
        database.
    """
    try:
        if database.file:
            database.file.parent.mkdir(parents=True, exist_ok=True)
        with database.direct.connect() as connection, _upgrade_lock(connection):
            present = schema_of(connection)
            connection.rollback()
            if present != newest_revision():
                _migrate(database, connection, present)
    except (SQLAlchemyError, sqlite3.Error, OSError) as error:
        cause = getattr(error, "orig", None) or error
        raise DatabaseError(f"the database {database.url.render_as_string()} cannot be opened: {cause}") from error


def _migrate(database: Database, connection: Connection, present: str) -> None:
    """Apply the migrations after ``present``, unless a newer program has applied its own."""
    # Imported here, because most starts need no migration, and Alembic would delay them by a fifth of a second.
    from alembic import command
    from alembic.config import Config
    from alembic.script import ScriptDirectory
    from alembic.util import CommandError

    config = Config()
    config.set_main_option("script_location", str(migrations()))
    script = ScriptDirectory.from_config(config)
    try:
        if present and _is_usable(
            connection, present, [script_revision.revision for script_revision in script.walk_revisions()]
        ):
            log.warning(
                "the database is newer (%s) than this program; this program can use it, but upgrade this station too",
                present,
            )
            return
        if present:
            script.get_revision(present)
            if database.file:
                _copy_before_upgrade(database.file, present)
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
        log.info("the database was upgraded from %s to %s", present or "nothing", script.get_current_head())
    except CommandError as error:
        raise DatabaseError(
            f"the database {database.url.render_as_string()} was written by a newer version of Kata ({error}); "
            "start that version, or restore a backup"
        ) from error


@contextmanager
def _upgrade_lock(connection: Connection) -> Iterator[None]:
    """Make services that start at the same time on one server upgrade one after another."""
    on_server = connection.dialect.name == "postgresql"
    if on_server:
        connection.execute(text("SELECT pg_advisory_lock(:key)"), {"key": _LOCK_KEY})
        connection.commit()
    try:
        yield
    finally:
        if on_server and not connection.invalidated:
            connection.rollback()
            connection.execute(text("SELECT pg_advisory_unlock(:key)"), {"key": _LOCK_KEY})
            connection.commit()


def _is_usable(connection: Connection, present: str, known_revisions: list[str]) -> bool:
    """Return whether this program, which knows the revisions ``known_revisions``, can use the database of a newer program."""
    if present in known_revisions:
        return False
    try:
        oldest = connection.scalar(select(SchemaRow.oldest).where(SchemaRow.revision == present))
    except SQLAlchemyError:
        oldest = None
    connection.rollback()
    return oldest in known_revisions


def _copy_before_upgrade(file: Path, version: str) -> None:
    """Copy the file into the same folder, with the version in its name. The copy gets its final name when it is complete."""
    size = sum(part.stat().st_size for part in (file, _with_suffix(file, "-wal")) if part.exists())
    free = shutil.disk_usage(file.parent).free
    if free < _DISK_SPACE_FACTOR * size:
        raise DatabaseError(
            f"the database {file} cannot be upgraded: the upgrade needs {_DISK_SPACE_FACTOR * size / 1e6:.0f} MB on its disk, and "
            f"{free / 1e6:.0f} MB are free; free up space, then start again"
        )
    part = _with_suffix(file, ".part")
    part.unlink(missing_ok=True)
    copy_sqlite_file(file, part)
    copy = part.rename(_with_suffix(file, f".version-{version}"))
    log.info("the database of version %s was copied to %s before the upgrade", version, copy)
    copies = sorted(file.parent.glob(f"{file.name}.version-*"), key=lambda path: path.stat().st_mtime_ns)
    for old in copies[:-_COPIES_KEPT]:
        old.unlink()


def copy_sqlite_file(source: Path, target: Path) -> None:
    """Copy a SQLite database into a new file, including the changes in its write-ahead log.

    :raises sqlite3.Error: when a file cannot be read or written.
    """
    with closing(sqlite3.connect(source)) as opened, closing(sqlite3.connect(target)) as copy:
        opened.backup(copy)


def _with_suffix(file: Path, ending: str) -> Path:
    return file.with_name(file.name + ending)
