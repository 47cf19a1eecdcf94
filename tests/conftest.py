"""What several kinds of tests need."""

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from kata.database.engine import Database
from kata.database.upgrade import upgrade
from kata.motion.builtin import built_in_motions
from kata.motion.taught import Taught, read_csv

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="session")
def browser_type_launch_args() -> dict[str, Any]:
    """Tell pytest-playwright which browser: KATA_CHROMIUM, or the one that `make test` has fetched."""
    browser = Path(os.environ.get("KATA_CHROMIUM") or ROOT / ".cache/chromium/chromium")
    if not browser.exists():
        pytest.fail(f"There is no browser at {browser}: `make test` fetches one, KATA_CHROMIUM names another.")
    quiet = ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run"]
    return {
        "executable_path": str(browser),
        "args": ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", *quiet],
    }


def free_port() -> int:
    """A port that nobody listens on just now."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port: int = free.getsockname()[1]
    return port


def recorded_motions() -> list[Path]:
    """The CSV files of the folder KATA_TAUGHT; none without it."""
    folder = os.environ.get("KATA_TAUGHT")
    return sorted(Path(folder).glob("*.csv")) if folder else []


@pytest.fixture(scope="session")
def motion() -> Taught:
    """A real motion where there is one (the shortest), a built-in one otherwise."""
    recorded = [read_csv(path) for path in recorded_motions()]
    return min(recorded or built_in_motions(), key=lambda one: one.duration_s)


def _postgresql_programs() -> Path | None:
    found = shutil.which("initdb")
    candidates = [Path(found).parent] if found else sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    return next((folder for folder in candidates if (folder / "initdb").exists()), None)


@pytest.fixture(scope="session")
def postgresql_url() -> Iterator[str]:
    """A server of our own on a socket; it refuses to run as root, so then it runs as `postgres`."""
    programs = _postgresql_programs()
    if programs is None:
        pytest.skip("PostgreSQL's programs are not on this machine")
    user = "postgres" if os.geteuid() == 0 else None
    if user and user not in {known.pw_name for known in pwd.getpwall()}:
        pytest.skip("PostgreSQL does not run as root, and there is no user postgres")
    folder = Path(tempfile.mkdtemp(prefix="kata-postgresql-"))
    if user:
        shutil.chown(folder, user)
    try:
        subprocess.run(
            [programs / "initdb", "--pgdata", folder / "data", "--username", "kata", "--auth", "trust"],
            check=True, capture_output=True, user=user, cwd=folder,
        )  # fmt: skip
        options = f"-c listen_addresses='' -c unix_socket_directories='{folder}'"
        control: list[str | Path] = [
            programs / "pg_ctl",
            "--pgdata",
            folder / "data",
            "--wait",
            "--silent",
            "--log",
            folder / "log",
        ]
        subprocess.run([*control, "--options", options, "start"], check=True, user=user, cwd=folder)
        yield f"postgresql+psycopg://kata@/postgres?host={folder}"
        subprocess.run([*control, "--mode", "immediate", "stop"], check=True, user=user, cwd=folder)
    finally:
        shutil.rmtree(folder)


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """On SQLite and, where its programs are on the machine, on PostgreSQL; upgraded, empty."""
    if request.param == "sqlite":
        url = f"sqlite:///{tmp_path / 'kata.db'}"
    else:
        url = request.getfixturevalue("postgresql_url")
    made = Database(url)
    upgrade(made)
    yield made
    if request.param == "postgresql":
        with made.writer.begin() as connection:
            connection.exec_driver_sql("DROP SCHEMA public CASCADE")
            connection.exec_driver_sql("CREATE SCHEMA public")
    made.close()
