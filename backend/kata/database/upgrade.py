"""Upgrade the database to this program's schema at start.

A SQLite file is copied before the upgrade; the copy can replace it later. Each migration is one transaction, so a killed start leaves a
complete version, from which the next start continues.
"""

import logging
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection, String, select, text
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Mapped, mapped_column

from kata.database.base import Base
from kata.database.engine import Database, DatabaseError

log = logging.getLogger(__name__)

_IN_PACKAGE: Final = Path(__file__).parent / "migrations"
_IN_REPOSITORY: Final = Path(__file__).parents[3] / "migrations"
_COPIES: Final = 2
"""The copies of the last two upgrades are kept."""
_LOCK: Final = 0x6B617462
"""Key of PostgreSQL's advisory lock for upgrades."""
_ROOM: Final = 3
"""Required disk space as a multiple of the database: the copy, and old and new versions of rewritten tables."""


def migrations() -> Path:
    """Return the folder of migrations: in the installed package, or at the top of a checkout."""
    return _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY


class SchemaRow(Base):
    """A revision that the database has reached. Its migration adds the row, and older programs read it."""

    __tablename__ = "schemas"

    revision: Mapped[str] = mapped_column(String(32), primary_key=True)
    oldest: Mapped[str] = mapped_column(String(32))
    """The oldest revision whose program can use this schema, because later migrations only add to it."""


def upgrade(database: Database) -> None:
    """Apply the missing migrations. A newer database that this program can use is not changed.

    :raises DatabaseError: when the database cannot be opened, the disk has too little space, or only a newer program can use the database.
    """
    config = Config()
    config.set_main_option("script_location", str(migrations()))
    script = ScriptDirectory.from_config(config)
    try:
        if database.file:
            database.file.parent.mkdir(parents=True, exist_ok=True)
        with database.writer.connect() as connection, _one_at_a_time(connection):
            present = MigrationContext.configure(connection).get_current_revision()
            connection.rollback()
            if present == script.get_current_head():
                return
            if present and _serves(connection, present, script):
                log.warning(
                    "the database is newer (%s) than this program, which can use it: upgrade this station too", present
                )
                return
            if present:
                script.get_revision(present)
                if database.file:
                    _copy(database.file, present)
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
            log.info("the database was upgraded from %s to %s", present or "nothing", script.get_current_head())
    except CommandError as error:
        raise DatabaseError(
            f"the database {database.url.render_as_string()} was written by a newer version of Kata ({error}); "
            "start that version, or restore a backup"
        ) from error
    except (SQLAlchemyError, sqlite3.Error, OSError) as error:
        cause = getattr(error, "orig", None) or error
        raise DatabaseError(f"the database {database.url.render_as_string()} cannot be opened: {cause}") from error


@contextmanager
def _one_at_a_time(connection: Connection) -> Iterator[None]:
    """Let services that start at the same time on one server upgrade one after another."""
    on_server = connection.dialect.name == "postgresql"
    if on_server:
        connection.execute(text("SELECT pg_advisory_lock(:key)"), {"key": _LOCK})
        connection.commit()
    try:
        yield
    finally:
        if on_server and not connection.invalidated:
            connection.rollback()
            connection.execute(text("SELECT pg_advisory_unlock(:key)"), {"key": _LOCK})
            connection.commit()


def _serves(connection: Connection, present: str, script: ScriptDirectory) -> bool:
    """Return whether this program can use a database of a newer revision."""
    known = [revision.revision for revision in script.walk_revisions()]
    if present in known:
        return False
    try:
        oldest = connection.scalar(select(SchemaRow.oldest).where(SchemaRow.revision == present))
    except SQLAlchemyError:
        oldest = None
    connection.rollback()
    return oldest in known


def _copy(file: Path, version: str) -> None:
    """Copy the file beside itself, named by its version. The copy gets its name when it is complete."""
    size = sum(part.stat().st_size for part in (file, _beside(file, "-wal")) if part.exists())
    free = shutil.disk_usage(file.parent).free
    if free < _ROOM * size:
        raise DatabaseError(
            f"the database {file} cannot be upgraded: the upgrade needs {_ROOM * size / 1e6:.0f} MB on its disk, and "
            f"{free / 1e6:.0f} MB are free; free up space, then start again"
        )
    part = _beside(file, ".part")
    part.unlink(missing_ok=True)
    with closing(sqlite3.connect(file)) as source, closing(sqlite3.connect(part)) as target:
        source.backup(target)
    copy = part.rename(_beside(file, f".version-{version}"))
    log.info("the database of version %s was copied to %s before the upgrade", version, copy)
    copies = sorted(file.parent.glob(f"{file.name}.version-*"), key=lambda path: path.stat().st_mtime_ns)
    for old in copies[:-_COPIES]:
        old.unlink()


def _beside(file: Path, ending: str) -> Path:
    return file.with_name(file.name + ending)
