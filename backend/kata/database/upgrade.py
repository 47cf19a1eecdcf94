"""Bringing the database to this program's schema at start.

A file is copied first: what an upgrade does to it can be taken back by putting the copy in its place. Each step is one transaction,
so that a start that was killed leaves a whole version behind, from which the next one goes on.
"""

import logging
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Final

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy.exc import SQLAlchemyError

from kata.database.engine import Database, DatabaseError

log = logging.getLogger(__name__)

_IN_PACKAGE: Final = Path(__file__).parent / "migrations"
_IN_REPOSITORY: Final = Path(__file__).parents[3] / "migrations"
_COPIES: Final = 2
"""That of the last upgrade, and of the one before: who notices late has one still."""
_ROOM: Final = 3
"""Times its size: the copy, what is written anew, and both versions of that until it is done."""


def migrations() -> Path:
    """The folder of migrations: inside an installed package, at the top of a checkout."""
    return _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY


def upgrade(database: Database) -> None:
    """Apply what is missing.

    :raises DatabaseError: when the database cannot be opened, has no room to be upgraded, or was written by a newer program.
    """
    config = Config()
    config.set_main_option("script_location", str(migrations()))
    script = ScriptDirectory.from_config(config)
    try:
        if database.file:
            database.file.parent.mkdir(parents=True, exist_ok=True)
        with database.writer.connect() as connection:
            present = MigrationContext.configure(connection).get_current_revision()
            connection.rollback()
            if present == script.get_current_head():
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
