"""Two PostgreSQL servers with synchronous streaming replication: the second takes over when the first is killed."""

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

import psycopg
import pytest

from kata.bench.running_service import children
from kata.database.postgresql_programs import postgresql_program

_LIMIT_S: Final = 60.0
_USER: Final = "postgres"


class Pair:
    """Two servers: ``now`` is the primary, the other one replicates it."""

    def __init__(self, folder: Path, user: str | None) -> None:
        self._user, self._folder = user, folder
        self._hosts = [folder / "a", folder / "b"]
        for host in self._hosts:
            host.mkdir()
            if user:
                shutil.chown(host, user)
        self.now, self._other = self._hosts
        self._run("initdb", "--pgdata", self.now / "data", "--username", "kata", "--auth", "trust")
        self._start(self.now)
        self._join()

    @property
    def url(self) -> str:
        """URL with both servers; a connection goes to the writable one."""
        hosts = ",".join(map(str, self._hosts))
        return f"postgresql+psycopg://kata@/postgres?host={hosts}&port=5432,5432&target_session_attrs=read-write"

    @property
    def primary_url(self) -> str:
        """URL of the primary alone."""
        return f"postgresql+psycopg://kata@/postgres?host={self.now}"

    @property
    def replica_url(self) -> str:
        """URL of the second server alone, which accepts only queries that read."""
        return f"postgresql+psycopg://kata@/postgres?host={self._other}"

    def until_replayed(self) -> None:
        """Wait until a query of the replica sees every committed change. A commit waits only until the replica has stored it."""
        limit = time.monotonic() + _LIMIT_S
        while self._ask("SELECT replay_lsn >= pg_current_wal_lsn() FROM pg_stat_replication") != [(True,)]:
            assert time.monotonic() < limit
            time.sleep(0.01)

    def fail_over(self, without_s: float) -> None:
        """Kill the first like a power cut, wait, let the second take over, and add a new second."""
        first = int((self.now / "data/postmaster.pid").read_text().split()[0])
        for process in [*children(first), first]:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        time.sleep(without_s)
        self.now, self._other = self._other, self.now
        self._control(self.now, "promote")
        self._join()

    def end(self) -> None:
        for host in self._hosts:
            with suppress(subprocess.CalledProcessError):
                self._control(host, "--mode", "immediate", "stop")

    def _join(self) -> None:
        """Add a second server as a copy of the first. From then on both have every acknowledged write."""
        shutil.rmtree(self._other / "data", ignore_errors=True)
        self._run(
            "pg_basebackup", "--host", self.now, "--username", "kata", "--pgdata", self._other / "data",
            "--write-recovery-conf", "--checkpoint", "fast",
        )  # fmt: skip
        self._start(self._other)
        self._ask("ALTER SYSTEM SET synchronous_standby_names = '*'")
        self._ask("SELECT pg_reload_conf()")
        limit = time.monotonic() + _LIMIT_S
        while self._ask("SELECT sync_state FROM pg_stat_replication") != [("sync",)]:
            assert time.monotonic() < limit
            time.sleep(0.05)

    def _ask(self, statement: str) -> list[Any]:
        with psycopg.connect(host=str(self.now), user="kata", dbname="postgres", autocommit=True) as connection:
            found = connection.execute(statement)
            return found.fetchall() if found.description else []

    def _start(self, host: Path) -> None:
        (host / "data/postmaster.pid").unlink(missing_ok=True)
        options = f"-c listen_addresses='' -c unix_socket_directories='{host}' -c fsync=off"
        self._control(host, "--log", host / "log", "--options", options, "start")

    def _control(self, host: Path, *arguments: str | Path) -> None:
        self._run("pg_ctl", "--pgdata", host / "data", "--wait", "--silent", *arguments)

    def _run(self, program: str, *arguments: str | Path) -> None:
        found = postgresql_program(program)
        assert found is not None, program
        # Without a pipe, which the server would keep open.
        subprocess.run([found, *arguments], check=True, user=self._user, cwd=self._folder, stdout=subprocess.DEVNULL)


@contextmanager
def pair() -> Iterator[Pair]:
    """Run two servers during the block; skip the test if PostgreSQL's programs are missing."""
    user = _USER if os.geteuid() == 0 else None
    if not postgresql_program("pg_basebackup") or (user and user not in {known.pw_name for known in pwd.getpwall()}):
        pytest.skip("PostgreSQL's programs, or somebody to run them as, are not on this computer")
    # A short path, because the length of a socket's path is limited.
    folder = Path(tempfile.mkdtemp(prefix="kata-pair-"))
    if user:
        shutil.chown(folder, user)
    try:
        made = Pair(folder, user)
        try:
            yield made
        finally:
            made.end()
    finally:
        shutil.rmtree(folder)
