"""Trying a backup, and bringing the clinic back from one.

Trying restores it where it harms nobody and compares what is then there with what was counted when it was made. A restore does
the same first, and only then puts it in place; what was there is put aside, never written over. Nobody stays signed in over it:
what has ended since the backup would be open again.
"""

import shutil
from collections.abc import Callable
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Final

from alembic.config import Config
from alembic.script import ScriptDirectory
from pyrage.x25519 import Identity
from sqlalchemy import update

from kata.access.backups.book import Note, leave_note
from kata.access.backups.folder import (
    aside_folder,
    one_at_a_time,
    others_files,
    replacing,
    without_service,
    work_folder,
)
from kata.access.backups.key import BackupError, adopt_key, identities
from kata.access.backups.sealed import DATA, DATABASE, Contents, unseal
from kata.access.tables import AccountRow, SignInRow
from kata.database.base import utc_now
from kata.database.copies import found_damaged, kind_of, replaced, schema_aside, schema_of, scratch
from kata.database.engine import Database
from kata.database.tally import differences, tallies
from kata.database.upgrade import migrations, upgrade
from kata.settings import Settings

_ROOM: Final = 3
"""Times the file's size: what is in it is compressed."""


def try_backup(settings: Settings, database: Database, file: Path, keys: list[Identity]) -> Contents:
    """Restore it into a scratch database and compare.

    :raises BackupError: when it cannot be opened, or is not equal to what was backed up.
    :raises DatabaseError: when there is no scratch database to be had.
    """
    with work_folder(settings) as folder:
        contents = unseal(file, keys, folder, _check(database))
        with scratch(database, folder / DATABASE) as made:
            _compare(made, contents, file)
    return contents


def try_and_note(settings: Settings, file: Path, key: Path) -> Contents:
    """As above, for somebody who asks; the service shows it with the backup.

    :raises BackupError: as above.
    """
    database = Database(settings.effective_database_url)
    try:
        with one_at_a_time(settings):
            contents = try_backup(settings, database, file, identities(key))
    finally:
        database.close()
    return contents


def restore(settings: Settings, file: Path, key: Path) -> tuple[Contents, str]:
    """Put the clinic back as it was at the backup: what was in it, and where that is which was there before.

    :raises BackupError: when it cannot be opened, is not equal to what was backed up, is of a newer version or another
        kind of database, or when the service runs. Then everything is as it was.
    :raises DatabaseError: when the database refuses.
    """
    keys = identities(key)
    database = Database(settings.effective_database_url)
    now = utc_now()
    aside = aside_folder(settings, f"{now:%Y%m%d-%H%M%S}")
    try:
        with without_service(settings), work_folder(settings) as folder:
            contents = unseal(file, keys, folder, _check(database))
            with replacing(settings):
                with replaced(database, folder / DATABASE, aside) as made:
                    _compare(made, contents, file)
                    upgrade(made)
                    _settle(made, now)
                _exchange(settings, database, folder / DATA, aside)
            adopt_key(settings, key)
    finally:
        database.close()
    return contents, _where(database, aside)
