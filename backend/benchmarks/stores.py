"""The databases of a clinic of ten years: built for one measurement, or kept for the next one, too."""

import hashlib
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from pydantic import TypeAdapter

from benchmarks import bulk_insert, postgresql, synthetic
from benchmarks.synthetic import History, fill
from kata.database.engine import SERVICE_ANSWER_S, Database
from kata.database.upgrade import migrations, upgrade

BACKENDS: Final = ("sqlite", "postgresql")
_TOLD: Final = TypeAdapter(History)


@contextmanager
def store(
    backend: str, patients: int, visits: int, hour_s: float, kept: Path | None
) -> Iterator[tuple[Database, Path, History]]:
    """One of them with its connections as the service has them, a folder for the service, and whom to ask for.

    ``kept``: a folder where it stays. One that is there is built anew where the schema or what is written down is another by now.

    :raises MissingError: when there is no PostgreSQL to be had.
    """
    folder = kept / f"{backend}-{patients}-{visits}" if kept else Path(tempfile.mkdtemp(prefix="kata-history-"))
    whom = folder / f"{_made_of(hour_s)}.json"
    try:
        if not whom.exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            # PostgreSQL's user passes through it, too.
            folder.chmod(0o755)
            with _database(backend, folder, None) as database:
                upgrade(database)
                told = fill(database, patients, visits, hour_s)
            # Last: what has none was not finished.
            whom.write_bytes(_TOLD.dump_json(told))
        with _database(backend, folder, SERVICE_ANSWER_S) as database:
            yield database, folder, _TOLD.validate_json(whom.read_bytes())
    finally:
        if not kept:
            shutil.rmtree(folder)


@contextmanager
def _database(backend: str, folder: Path, answer_s: float | None) -> Iterator[Database]:
    if backend == "sqlite":
        with closing(Database(f"sqlite:///{folder / 'kata.db'}", answer_s=answer_s)) as database:
            yield database
    else:
        # A socket's path may not be long: it is elsewhere.
        with (
            postgresql.serving(folder.absolute() / "postgresql") as url,
            closing(Database(url, answer_s=answer_s)) as database,
        ):
            yield database


def _made_of(hour_s: float) -> str:
    """Another one for every schema, for everything else that is written down, and for another length of the hour."""
    sources = [*sorted((migrations() / "versions").glob("*.py")), Path(synthetic.__file__), Path(bulk_insert.__file__)]
    made = hashlib.sha256(f"{hour_s}".encode())
    for source in sources:
        made.update(source.read_bytes())
    return made.hexdigest()[:16]
