"""Runs PgBouncer in front of a PostgreSQL server of the tests: each transaction gets any of a few server connections."""

import os
import pwd
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest
from sqlalchemy.engine import make_url

SERVER_CONNECTIONS: Final = 4
_LIMIT_S: Final = 20.0
_PORT: Final = 6432
_USER: Final = "postgres"


@contextmanager
def transaction_pooler(server_url: str) -> Iterator[str]:
    """Run PgBouncer during the block. Yield the URL of the server's database through it. Skip the test if the program is missing."""
    program = shutil.which("pgbouncer", path=f"{os.environ['PATH']}:/usr/sbin")
    user = _USER if os.geteuid() == 0 else None
    if not program or (user and user not in {known.pw_name for known in pwd.getpwall()}):
        pytest.skip("PgBouncer, or a user who may run it, is not on this computer")
    server = make_url(server_url)
    # A short path, because the length of a socket's path is limited.
    folder = Path(tempfile.mkdtemp(prefix="kata-pooler-"))
    (folder / "users.txt").write_text(f'"{server.username}" ""\n')
    (folder / "pgbouncer.ini").write_text(_configuration(folder, str(server.query["host"]), str(server.database)))
    if user:
        for path in (folder, *folder.iterdir()):
            shutil.chown(path, user)
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen([program, folder / "pgbouncer.ini"], user=user, cwd=folder, stdout=log, stderr=log)
    try:
        limit_s = time.monotonic() + _LIMIT_S
        while not (folder / f".s.PGSQL.{_PORT}").exists():
            assert process.poll() is None and time.monotonic() < limit_s, (folder / "log").read_text()
            time.sleep(0.02)
        yield f"postgresql+psycopg://{server.username}@/{server.database}?host={folder}&port={_PORT}"
    finally:
        process.terminate()
        process.wait(_LIMIT_S)
        shutil.rmtree(folder)


def _configuration(folder: Path, server_folder: str, database: str) -> str:
    return f"""[databases]
{database} = host={server_folder} dbname={database}

[pgbouncer]
listen_addr =
listen_port = {_PORT}
unix_socket_dir = {folder}
auth_type = trust
auth_file = {folder}/users.txt
pool_mode = transaction
default_pool_size = {SERVER_CONNECTIONS}
max_client_conn = 500
server_round_robin = 1
"""
