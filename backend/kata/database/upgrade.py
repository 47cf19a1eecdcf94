"""Bringing the database to this program's schema at start."""

import logging
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


def migrations() -> Path:
    """The folder of migrations: inside an installed package, at the top of a checkout."""
    return _IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY


def upgrade(database: Database) -> None:
    """Apply what is missing.

    :raises DatabaseError: when the database cannot be opened, or was written by a newer program.
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
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
            log.info("the database was upgraded from %s to %s", present or "nothing", script.get_current_head())
    except CommandError as error:
        raise DatabaseError(
            f"the database {database.url.render_as_string()} was written by a newer version of Kata ({error}); "
            "start that version, or restore a backup"
        ) from error
    except (SQLAlchemyError, OSError) as error:
        cause = getattr(error, "orig", None) or error
        raise DatabaseError(f"the database {database.url.render_as_string()} cannot be opened: {cause}") from error
