"""Bringing the database to this program's schema at start.

A file is copied first: what an upgrade does to it can be taken back by putting the copy in its place. Each step is one transaction,
so that a start that was killed leaves a whole version behind, from which the next one goes on.
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
"""That of the last upgrade, and of the one before: who notices late has one still."""
_LOCK: Final = 0x6B617462
"""Of PostgreSQL's advisory locks: upgrading."""
_ROOM: Final = 3
"""Times its size: the copy, what is written anew, and both versions of that until it is done."""


def migrations() -> Path:
    """The folder of migrations: inside an installed package, at the top of a checkout."""
    return _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY


class SchemaRow(Base):
    """A revision that the database has come to, as its own migration has noted it: programs that do not know it ask here."""

    __tablename__ = "schemas"

    revision: Mapped[str] = mapped_column(String(32), primary_key=True)
    oldest: Mapped[str] = mapped_column(String(32))
    """The oldest revision whose program still goes on with this one: it was only added to since."""


def upgrade(database: Database) -> None:
    """Apply what is missing. One that is newer, and says that it serves this program too, stays as it is.

    :raises DatabaseError: when the database cannot be opened, has no room to be upgraded, or is a newer program's alone.
    """
    config = Config()
    config.set_main_option("script_location", str(migrations()))
    script = ScriptDirectory.from_config(config)
    try:
        if database.file:
            database.file.parent.mkdir(parents=True, exist_ok=True)
        with database.writer.connect() as connection, _alone(connection):
            present = MigrationContext.configure(connection).get_current_revision()
            connection.rollback()
            if present == script.get_current_head():
                return
            if present and _serves(connection, present, script):
                log.warning(
                    "the database is newer (%s) than this program, and serves it: upgrade this station too", present
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
def _alone(connection: Connection) -> Iterator[None]:
    """Services that start at the same time on one server upgrade it one after another."""
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
    """Whether a revision that this program does not know says that it serves this program."""
    known = [one.revision for one in script.walk_revisions()]
    if present in known:
        return False
    try:
        oldest = connection.scalar(select(SchemaRow.oldest).where(SchemaRow.revision == present))
    except SQLAlchemyError:
        oldest = None
    connection.rollback()
    return oldest in known


def _copy(file: Path, version: str) -> None:
    """Beside it, under the version that it has; whole, or not there under that name."""
    size = sum(part.stat().st_size for part in (file, _beside(file, "-wal")) if part.exists())
    free = shutil.disk_usage(file.parent).free
    if free < _ROOM * size:
        raise DatabaseError(
            f"the database {file} cannot be upgraded: that takes {_ROOM * size / 1e6:.0f} MB on its disk, and "
            f"{free / 1e6:.0f} MB are free; make room, then start again"
        )
    part = _beside(file, ".part")
    part.unlink(missing_ok=True)
    with closing(sqlite3.connect(file)) as source, closing(sqlite3.connect(part)) as target:
        source.backup(target)
    copy = part.rename(_beside(file, f".version-{version}"))
    log.info("the database is upgraded from %s; as it was it is kept in %s", version, copy)
    copies = sorted(file.parent.glob(f"{file.name}.version-*"), key=lambda one: one.stat().st_mtime_ns)
    for old in copies[:-_COPIES]:
        old.unlink()


def _beside(file: Path, ending: str) -> Path:
    return file.with_name(file.name + ending)
