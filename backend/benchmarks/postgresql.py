"""Runs a temporary PostgreSQL server with this computer's programs, on a socket in a temporary folder."""

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
from typing import Final

from sqlalchemy.engine import make_url

from kata.bench.running_service import BenchError, children, cpu_s
from kata.database.postgresql_programs import postgresql_program

_USER: Final = "postgres"


class MissingError(BenchError):
    """PostgreSQL is not available. The exception's message states the reason."""


@contextmanager
def serving(data_folder: Path | None = None, max_connections: int = 100) -> Iterator[str]:
    """Run a server during the block. Yield SQLAlchemy's URL of its empty database. Root runs the server as the user ``postgres``.

    ``data_folder``: a folder in which the database is kept; it must be empty only at first use. Its writes are as safe as a clinic's.
    ``max_connections``: PostgreSQL's own default is 100.

    :raises MissingError: when the programs or the user ``postgres`` are missing.
    """
    initdb = postgresql_program("initdb")
    if initdb is None:
        raise MissingError("PostgreSQL's programs are not on this computer.")
    user = _USER if os.geteuid() == 0 else None
    if user and user not in {known.pw_name for known in pwd.getpwall()}:
        raise MissingError("PostgreSQL does not run as root, and there is no user postgres.")
    folder = Path(tempfile.mkdtemp(prefix="kata-postgresql-"))
    data = data_folder or folder / "data"
    data.mkdir(parents=True, exist_ok=True)
    if user:
        shutil.chown(folder, user)
        shutil.chown(data, user)
    try:
        if not (data / "PG_VERSION").exists():
            made = subprocess.run(
                [initdb, "--pgdata", data, "--username", "kata", "--auth", "trust"],
                capture_output=True, text=True, user=user, cwd=folder,
            )  # fmt: skip
            if made.returncode:
                raise MissingError(f"PostgreSQL cannot create its files in {data}: {made.stderr.strip()}.")
        # Disable automatic vacuuming, which could disturb a measurement or the dropping of a schema.
        options = f"-c listen_addresses='' -c unix_socket_directories='{folder}' -c autovacuum=off -c max_wal_size=4GB"
        options += f" -c max_connections={max_connections}"
        if not data_folder:
            options += " -c fsync=off"
        control: list[str | Path] = [initdb.with_name("pg_ctl"), "--pgdata", data, "--wait", "--silent"]
        control += ["--log", folder / "log"]
        started = subprocess.run([*control, "--options", options, "start"], user=user, cwd=folder)
        if started.returncode:
            raise MissingError(f"PostgreSQL does not start in {data}: perhaps another server uses it.")
        try:
            yield f"postgresql+psycopg://kata@/postgres?host={folder}"
        finally:
            subprocess.run(
                [*control, "--mode", "fast" if data_folder else "immediate", "stop"], check=True, user=user, cwd=folder
            )
    finally:
        shutil.rmtree(folder)


def _cpu_s_if_running(pid: int) -> float:
    try:
        return cpu_s(pid)
    except OSError:
        return 0.0  # It has ended since it was listed, and its time counts as that of an ended child.


class Server:
    """Controls the server of :func:`serving` with this URL: suspends, kills and restarts it while services use it."""

    def __init__(self, url: str) -> None:
        self.url = url
        self._folder = Path(str(make_url(url).query["host"]))
        self._options = (self._folder / "data/postmaster.opts").read_text()

    def _processes(self) -> list[int]:
        """Return the server's process ids, children first."""
        first = int((self._folder / "data/postmaster.pid").read_text().split()[0])
        return [*children(first), first]

    def cpu_s(self) -> float:
        """Return the processor time of the server's processes in seconds, also of those that have ended."""
        *others, first = self._processes()
        return cpu_s(first, with_ended_children=True) + sum(map(_cpu_s_if_running, others))

    def _signal(self, which: signal.Signals) -> None:
        for process in self._processes():
            with suppress(ProcessLookupError):
                os.kill(process, which)

    @contextmanager
    def hanging(self) -> Iterator[None]:
        """Suspend the server during the block. All connections stay open."""
        self._signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._signal(signal.SIGCONT)

    @contextmanager
    def killed(self) -> Iterator[None]:
        """Kill the server as in a power cut. Restart it at the end of the block."""
        processes = self._processes()
        for process in processes:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        while any(Path(f"/proc/{process}").exists() for process in processes):
            time.sleep(0.01)
        try:
            yield
        finally:
            self.start()

    def start(self) -> None:
        """Start the server again with the same options."""
        initdb = postgresql_program("initdb")
        assert initdb is not None
        user = "postgres" if os.geteuid() == 0 else None
        options = self._options.split(" ", 1)[1].replace('"', "'").strip()
        subprocess.run(
            [initdb.with_name("pg_ctl"), "--pgdata", self._folder / "data", "--wait", "--silent", "--log",
             self._folder / "log", "--options", options, "start"],
            check=True, user=user, cwd=self._folder,
        )  # fmt: skip
