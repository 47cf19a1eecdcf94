"""A PostgreSQL server of our own that is stopped, killed and started again while others use it."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sqlalchemy.engine import make_url

from kata.database.programs import postgresql_program

LIMIT_S = 30.0


class Server:
    """The one that listens at this URL, which :func:`kata.bench.postgresql.serving` has given."""

    def __init__(self, url: str) -> None:
        self.url = url
        self._folder = Path(str(make_url(url).query["host"]))
        self._options = (self._folder / "data/postmaster.opts").read_text()

    def _processes(self) -> list[int]:
        """The server's, children first."""
        first = int((self._folder / "data/postmaster.pid").read_text().split()[0])
        told = subprocess.run(["pgrep", "-P", str(first)], capture_output=True, text=True, check=False).stdout
        return [*(int(one) for one in told.split()), first]

    def _signal(self, which: signal.Signals) -> None:
        for process in self._processes():
            with suppress(ProcessLookupError):
                os.kill(process, which)

    @contextmanager
    def hanging(self) -> Iterator[None]:
        """While the block lasts, nothing of it moves; nobody's connection is closed."""
        self._signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._signal(signal.SIGCONT)

    @contextmanager
    def killed(self) -> Iterator[None]:
        """As by a power cut, and started again at the end of the block."""
        processes = self._processes()
        for process in processes:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        limit = time.monotonic() + LIMIT_S
        while any(Path(f"/proc/{process}").exists() for process in processes):
            assert time.monotonic() < limit
            time.sleep(0.01)
        try:
            yield
        finally:
            self.start()

    def start(self) -> None:
        """Again, with the options that it had."""
        initdb = postgresql_program("initdb")
        assert initdb is not None
        user = "postgres" if os.geteuid() == 0 else None
        options = self._options.split(" ", 1)[1].replace('"', "'").strip()
        subprocess.run(
            [initdb.with_name("pg_ctl"), "--pgdata", self._folder / "data", "--wait", "--silent", "--log",
             self._folder / "log", "--options", options, "start"],
            check=True, user=user, cwd=self._folder,
        )  # fmt: skip
