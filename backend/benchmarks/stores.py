"""Builds databases with ten years of a clinic, for one measurement or for repeated use."""

import hashlib
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from datetime import date
from pathlib import Path
from typing import Final

from pydantic import TypeAdapter

from benchmarks import bulk_insert, postgresql, synthetic, synthetic_figures
from benchmarks.synthetic import History, fill
from kata.database.base import utc_now
from kata.database.engine import SERVICE_ANSWER_S, Database
from kata.database.upgrade import migrations, upgrade

BACKENDS: Final = ("sqlite", "postgresql")
_HISTORY: Final = TypeAdapter(History)


@contextmanager
def store(
    backend: str, patients: int, visits: int, hour_s: float, store_folder: Path | None
) -> Iterator[tuple[Database, Path, History]]:
    """Yield a filled database with the service's connections, a folder for the service, and the history's ids.

    ``store_folder``: folder in which the database is kept. An existing database is rebuilt if the schema, the generated content or the day
    has changed, because the history ends with the work of the present day.

    :raises MissingError: when no PostgreSQL is available.
    """
    folder = (
        store_folder / f"{backend}-{patients}-{visits}"
        if store_folder
        else Path(tempfile.mkdtemp(prefix="kata-history-"))
    )
    today = utc_now().date()
    history_file = folder / f"{_content_hash(hour_s, today)}.json"
    try:
        if not history_file.exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            # PostgreSQL's user must be able to enter the folder.
            folder.chmod(0o755)
            with _database(backend, folder, None) as database:
                upgrade(database)
                history = fill(database, patients, visits, hour_s, today)
            # Write this file last, because a database without it counts as incomplete.
            history_file.write_bytes(_HISTORY.dump_json(history))
        with _database(backend, folder, SERVICE_ANSWER_S) as database:
            yield database, folder, _HISTORY.validate_json(history_file.read_bytes())
    finally:
        if not store_folder:
            shutil.rmtree(folder)


@contextmanager
def _database(backend: str, folder: Path, answer_s: float | None) -> Iterator[Database]:
    if backend == "sqlite":
        with closing(Database(f"sqlite:///{folder / 'kata.db'}", answer_s=answer_s)) as database:
            yield database
    else:
        # The length of a socket's path is limited, so the socket is in another folder.
        with (
            postgresql.serving(folder.absolute() / "postgresql") as url,
            closing(Database(url, answer_s=answer_s)) as database,
        ):
            yield database


def _content_hash(hour_s: float, today: date) -> str:
    """Return a hash of the schema, the generated content, the length of the hour and the last day."""
    content = [Path(str(module.__file__)) for module in (synthetic, synthetic_figures, bulk_insert)]
    sources = [*sorted((migrations() / "versions").glob("*.py")), *content]
    digest = hashlib.sha256(f"{hour_s} {today}".encode())
    for source in sources:
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
