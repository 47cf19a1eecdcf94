"""Fixtures of the clinic tests."""

from collections.abc import Iterator

import pytest

from kata.database.engine import Database
from tests.support.databases import upgraded_file


@pytest.fixture(scope="module")
def sqlite(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    """Return a SQLite database with the newest schema. The tests of a module share it."""
    made = Database(upgraded_file(tmp_path_factory.mktemp("clinic") / "kata.db"))
    yield made
    made.close()
