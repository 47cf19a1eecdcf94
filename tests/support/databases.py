"""Empty databases of the current schema, copied from one upgraded file. Migrations have their own tests."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import pytest

from kata.database.engine import Database
from kata.database.upgrade import migrations, upgrade
from tests.support.paths import ROOT

SQLITE_FIRST: Final = pytest.mark.parametrize(
    "database", ["sqlite", pytest.param("postgresql", marks=pytest.mark.campaign)], indirect=True
)
"""Runs a test on SQLite in every run, and on PostgreSQL in the campaign. Other tests send each of its SQL statements to PostgreSQL."""


def upgraded_file(file: Path) -> str:
    """Create an empty database at this path and return its URL."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(_upgraded())
    return f"sqlite:///{file}"


@contextmanager
def emptied_afterwards(url: str) -> Iterator[str]:
    """Lend a database on a server to services, which upgrade it. Empty it afterwards."""
    yield url
    database = Database(url)
    with database.writer.begin() as connection:
        connection.exec_driver_sql("DROP SCHEMA public CASCADE")
        connection.exec_driver_sql("CREATE SCHEMA public")
    database.close()


@cache
def _upgraded() -> bytes:
    """Return an empty database of the current schema. Workers with the same sources and packages share it: an upgrade takes a second."""
    sources = [ROOT / "requirements-dev.txt", *migrations().rglob("*.py"), *(ROOT / "backend/kata").rglob("*.py")]
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in sorted(sources))).hexdigest()
    stored = ROOT / f".cache/upgraded/{digest}.db"
    if stored.exists():
        return stored.read_bytes()
    with TemporaryDirectory() as folder:
        file = Path(folder) / "kata.db"
        made = Database(f"sqlite:///{file}")
        upgrade(made)
        made.close()
        content = file.read_bytes()
    stored.parent.mkdir(parents=True, exist_ok=True)
    for former in stored.parent.glob("*.db"):
        former.unlink(missing_ok=True)
    part = stored.with_suffix(f".{os.getpid()}")
    part.write_bytes(content)
    part.replace(stored)
    return content
