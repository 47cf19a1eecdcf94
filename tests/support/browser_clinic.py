"""A whole clinic as `make run` starts it, for tests in a real browser."""

import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from kata.cli.seed import fill
from kata.database.base import utc_now
from kata.database.engine import Database
from tests.support.databases import upgraded_file
from tests.support.login import signed_in_at
from tests.support.ports import free_port

START_LIMIT_S: Final = 60.0
LONG_MS: Final = 60_000
"""Time-out for a busy computer; not a requirement."""


class Clinic:
    """``kata serve --simulate`` in its own process."""

    def __init__(self, folder: Path, *, database_url: str = "") -> None:
        """Without ``database_url``, the database is a file in ``folder``."""
        self.cookie = signed_in_at(folder, database_url=database_url)
        self._environment = os.environ | ({"KATA_DATABASE_URL": database_url} if database_url else {})
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._folder = folder
        self._log = folder / "service.log"
        self.start()

    def start(self) -> None:
        """Start the service and wait until it answers; also after a kill, on the same folder and port."""
        folder = str(self._folder)
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "kata", "serve", "--simulate", "--data", folder, "--port", str(self.port)],
                stderr=log,
                env=self._environment,
                start_new_session=True,
            )
        self._wait()

    def kill(self) -> None:
        """Kill the service, like a power failure."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def _wait(self) -> None:
        limit = time.monotonic() + START_LIMIT_S
        while True:
            try:
                with urllib.request.urlopen(f"{self.url}/health/live", timeout=2):
                    return
            except (urllib.error.URLError, OSError):
                log = self._log.read_text(errors="replace")
                assert self.process.poll() is None, log
                assert time.monotonic() < limit, log
                time.sleep(0.1)

    def close(self) -> None:
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


@contextmanager
def clinic_in(folder: Path) -> Iterator[Clinic]:
    """Run a clinic on this folder."""
    clinic = Clinic(folder)
    try:
        yield clinic
    finally:
        clinic.close()


@contextmanager
def invented_clinic(folder: Path) -> Iterator[Clinic]:
    """Run a clinic with two invented patients and their history."""
    database = Database(upgraded_file(folder / "kata.db"))
    fill(database, 1, utc_now(), patients=2)
    database.close()
    with clinic_in(folder) as clinic:
        yield clinic
