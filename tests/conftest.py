"""Fixtures and settings of several kinds of tests."""

import gc
import os
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from sqlalchemy import Engine, create_engine, text

from benchmarks import postgresql
from kata.database.engine import Database
from kata.database.upgrade import upgrade
from kata.motion.builtin import built_in_motions
from kata.motion.taught import Taught, read_csv
from tests.support.databases import emptied_afterwards, upgraded_file
from tests.support.motions import recorded_motions
from tests.support.paths import ROOT

# `make test` uses the same examples in every run. `make campaign` searches for new examples; those that fail become tests.
# Without deadlines, because the computer may be busy.
settings.register_profile("steady", derandomize=True, deadline=None)
settings.register_profile("exploring", derandomize=False, deadline=None, print_blob=True)
settings.load_profile("steady")

# Every change that a service acknowledges waits for the disk, some milliseconds each time. Files in memory need no such wait.
_MEMORY = Path("/dev/shm")
_ROOM_BYTES = 2 << 30
if "TMPDIR" not in os.environ and os.access(_MEMORY, os.W_OK) and shutil.disk_usage(_MEMORY).free > _ROOM_BYTES:
    os.environ["TMPDIR"] = str(_MEMORY)


_LONG_FOLDERS = ("release", "evaluation", "commissioning")
"""Folders with the longest modules. They begin first: a worker that begins one at the end leaves the other processor idle."""
_COLLECTED_AFTER = 50_000
"""Number of new objects after which garbage is collected; Python's own is 700."""

# Collecting imports thousands of modules, which the collector would scan again and again.
gc.disable()


def pytest_collection_finish() -> None:
    """Exclude the tests' own objects from garbage collection. A control loop collects garbage whenever it opens its port, which would take
    a third of a second with the objects of a thousand tests.

    Later garbage is collected more rarely than usual. Python would scan all other old objects very often, because it compares their
    number with that of new ones, and the excluded objects no longer count. A tenth of a database test's time was garbage collection.
    """
    gc.freeze()
    gc.set_threshold(_COLLECTED_AFTER, 20, 20)
    gc.enable()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out the campaign's generated requests when it does not run. Schemathesis takes 17 s to import and to generate them, in each worker."""
    left_out = "not campaign" in config.option.markexpr and collection_path.name == "test_generated_requests.py"
    return True if left_out else None


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the longest folders first, and give each test its own id: pytest-xdist silently runs only one of the tests with the same id.

    Schemathesis puts the operation into a test's name, and pytest leaves it out of the id.
    """
    items.sort(key=lambda item: item.path.parent.name not in _LONG_FOLDERS)
    for item in items:
        if not item.nodeid.endswith(f"::{item.name}"):
            assert item.parent is not None
            item._id = item.parent.id.child(item.name)
    shared = [nodeid for nodeid, count in Counter(item.nodeid for item in items).items() if count > 1]
    if shared:
        raise pytest.UsageError(f"Several tests share an id: {shared}")


@pytest.fixture(scope="session")
def browser_type_launch_args() -> dict[str, Any]:
    """Give pytest-playwright its browser: KATA_CHROMIUM, or the one that `make test` has fetched."""
    browser = Path(os.environ.get("KATA_CHROMIUM") or ROOT / ".cache/chromium/chromium")
    if not browser.exists():
        pytest.fail(f"There is no browser at {browser}: `make test` fetches one, KATA_CHROMIUM names another.")
    quiet = ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run"]
    return {
        "executable_path": str(browser),
        "args": ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", *quiet],
    }


@pytest.fixture(scope="session")
def motion() -> Taught:
    """Return the shortest recorded motion if there is one, else a built-in motion."""
    recorded = [read_csv(path) for path in recorded_motions()]
    return min(recorded or built_in_motions(), key=lambda taught: taught.duration_s)


@pytest.fixture(scope="session")
def postgresql_url() -> Iterator[str]:
    """Return the URL of a PostgreSQL server for this test run."""
    try:
        with postgresql.serving() as url:
            yield url
    except postgresql.MissingError as error:
        pytest.skip(str(error))


@pytest.fixture
def services_url(postgresql_url: str) -> Iterator[str]:
    """Return the URL of an empty database that services share."""
    with emptied_afterwards(postgresql_url) as url:
        yield url


@pytest.fixture(scope="session")
def upgraded_on_server(postgresql_url: str) -> Iterator[Engine]:
    """Return a connection to the server after creating a database of the current schema to copy."""
    server = create_engine(postgresql_url, isolation_level="AUTOCOMMIT")
    with server.connect() as connection:
        connection.execute(text("CREATE DATABASE upgraded"))
    made = Database(server.url.set(database="upgraded").render_as_string(hide_password=False))
    upgrade(made)
    made.close()
    yield server
    server.dispose()


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """Return an empty database of the current schema: SQLite, and PostgreSQL if its programs are installed."""
    if request.param == "sqlite":
        made = Database(upgraded_file(tmp_path / "kata.db"))
        yield made
        made.close()
        return
    server: Engine = request.getfixturevalue("upgraded_on_server")
    with server.connect() as connection:
        connection.execute(text("CREATE DATABASE of_a_test TEMPLATE upgraded"))
    made = Database(server.url.set(database="of_a_test").render_as_string(hide_password=False))
    yield made
    made.close()
    with server.connect() as connection:
        connection.execute(text("DROP DATABASE of_a_test WITH (FORCE)"))
