"""Databases to test on: SQLite always, PostgreSQL where its programs are on the machine."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from kata.database.engine import Database
from kata.database.upgrade import upgrade


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
    folder = Path(tempfile.mkdtemp(prefix="kata-postgresql-"))
    user = "postgres" if os.geteuid() == 0 else None
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
    """Upgraded, empty."""
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
