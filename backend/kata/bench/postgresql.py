"""A PostgreSQL server of our own, from this computer's programs: on a socket, in a folder that goes with it."""

import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from kata.database.programs import postgresql_program

_USER: Final = "postgres"


class MissingError(Exception):
    """There is none to be had; the message says why."""


@contextmanager
def serving() -> Iterator[str]:
    """SQLAlchemy's URL of an empty database, while the block lasts. It refuses to run as root, so then it runs as ``postgres``.

    :raises MissingError: when its programs are not there, or nobody whom they would run as.
    """
    initdb = postgresql_program("initdb")
    if initdb is None:
        raise MissingError("PostgreSQL's programs are not on this computer.")
    user = _USER if os.geteuid() == 0 else None
    if user and user not in {known.pw_name for known in pwd.getpwall()}:
        raise MissingError("PostgreSQL does not run as root, and there is no user postgres.")
    folder = Path(tempfile.mkdtemp(prefix="kata-postgresql-"))
    if user:
        shutil.chown(folder, user)
    try:
        subprocess.run(
            [initdb, "--pgdata", folder / "data", "--username", "kata", "--auth", "trust"],
            check=True, capture_output=True, user=user, cwd=folder,
        )  # fmt: skip
        # Nothing of it is kept, and its own vacuuming shall not meet a schema that is being dropped.
        options = f"-c listen_addresses='' -c unix_socket_directories='{folder}' -c autovacuum=off -c fsync=off"
        control: list[str | Path] = [initdb.with_name("pg_ctl"), "--pgdata", folder / "data", "--wait", "--silent"]
        control += ["--log", folder / "log"]
        subprocess.run([*control, "--options", options, "start"], check=True, user=user, cwd=folder)
        try:
            yield f"postgresql+psycopg://kata@/postgres?host={folder}"
        finally:
            subprocess.run([*control, "--mode", "immediate", "stop"], check=True, user=user, cwd=folder)
    finally:
        shutil.rmtree(folder)
