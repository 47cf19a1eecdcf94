"""A whole clinic as `make run` starts it, for tests in a real browser."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Final, TypeVar

import pytest

from kata.auth.login_session import COOKIE
from kata.cli.seed import fill, write_station
from kata.cli.seed_people import Language
from kata.database.base import utc_now
from kata.database.engine import Database
from tests.support.databases import upgraded_file
from tests.support.invented_clinic import invented_file
from tests.support.login import signed_in_at
from tests.support.paths import ROOT
from tests.support.ports import free_port
from tests.support.slow_station import slow_station_file

SignedIn = TypeVar("SignedIn")

_WITHOUT_APPARATUS: Final = """
from unittest.mock import patch

from kata.__main__ import main
from tests.support.silent_device import Disconnected

with patch("kata.station.station.DeviceProcess", Disconnected):
    main()
"""
START_LIMIT_S: Final = 60.0
LONG_MS: Final = 60_000
"""Time-out for a busy computer; not a requirement."""


class Clinic:
    """``kata serve`` in its own process."""

    def __init__(
        self,
        folder: Path,
        *,
        database_url: str = "",
        program: tuple[str, str] = ("-m", "kata"),
        full_rate: bool = False,
        simulate: bool = True,
        station: Path | None = None,
    ) -> None:
        """Without ``database_url``, the database is a file in ``folder``. ``program``: what Python runs. ``station``: the station's file.

        ``full_rate``: the apparatus has the default configuration. Without ``simulate``, the station's apparatus is not connected. The
        device process and the simulator of a simulated one take two seconds of processor time to start.
        """
        self._program = program if simulate else ("-c", _WITHOUT_APPARATUS)
        self._options = ["--simulate"] if simulate else ["--station", str(folder / "station.toml")]
        self.cookie = signed_in_at(folder, database_url=database_url)
        # A named zone, so that the page has no note about a missing one.
        zone = {"KATA_CLINIC_TIME_ZONE": "UTC"}
        if simulate and not full_rate:
            station = slow_station_file(folder)
        own = {"KATA_STATION": str(station)} if station else {}
        self._environment = zone | os.environ | own | ({"KATA_DATABASE_URL": database_url} if database_url else {})
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._folder = folder
        self._log = folder / "service.log"
        if not simulate:
            (folder / "station.toml").write_text('port = "/dev/ttyNONE"\n')
        self.start()

    def start(self) -> None:
        """Start the service and wait until it answers; also after a kill, on the same folder and port."""
        folder = str(self._folder)
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, *self._program, "serve", *self._options, "--data", folder, "--port", str(self.port)],
                cwd=ROOT,
                stdout=log,
                stderr=subprocess.STDOUT,
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

    def is_free(self) -> bool:
        """True if the service answers and its apparatus is idle."""
        asked = urllib.request.Request(f"{self.url}/api/station", headers={"Cookie": f"{COOKIE}={self.cookie}"})
        try:
            with urllib.request.urlopen(asked, timeout=10) as answer:
                return bool(json.load(answer)["live"]["mode"] == "idle")
        except OSError:
            return False

    def close(self) -> None:
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


@contextmanager
def clinic_in(folder: Path, *, full_rate: bool = False, station: Path | None = None) -> Iterator[Clinic]:
    """Run a clinic on this folder. ``full_rate``: its apparatus has the default configuration, or that of the file ``station``."""
    clinic = Clinic(folder, full_rate=full_rate, station=station)
    try:
        yield clinic
    finally:
        clinic.close()


@contextmanager
def seeded_clinic(
    folder: Path, sign_in: Callable[[], SignedIn], language: Language = "en"
) -> Iterator[tuple[Clinic, SignedIn]]:
    """Run the demonstration clinic of ``kata seed``. Yield it and what ``sign_in`` returned before it began."""
    database = Database(upgraded_file(folder / "kata.db"))
    fill(database, 1, utc_now(), language=language)
    database.close()
    signed_in = sign_in()
    # Pictures show the default rate.
    with clinic_in(folder, full_rate=True, station=write_station(folder, language)) as clinic:
        yield clinic, signed_in


@contextmanager
def invented_clinic(folder: Path) -> Iterator[Clinic]:
    """Run a clinic with two invented patients and their history."""
    invented_file(folder / "kata.db")
    with clinic_in(folder) as clinic:
        yield clinic


class SharedClinics:
    """Lends one clinic of each kind to all tests that can share it, and runs one clinic at a time."""

    KINDS: Final[dict[str, Callable[[Path], AbstractContextManager[Clinic]]]] = {
        "full rate": partial(clinic_in, full_rate=True),
        "empty": clinic_in,
        "invented": invented_clinic,
    }
    """In the order in which the tests run. The first two are empty. ``full rate``: the apparatus has the default configuration."""

    def __init__(self, folders: pytest.TempPathFactory) -> None:
        self._folders = folders
        self._kind = ""
        self._running = ExitStack()
        self._clinic: Clinic | None = None

    def lend(self, kind: str) -> Clinic:
        """Return the running clinic of this kind, or start it instead of the other."""
        if self._clinic is None or kind != self._kind:
            self.close()
            self._clinic = self._running.enter_context(self.KINDS[kind](self._folders.mktemp(kind)))
            self._kind = kind
        return self._clinic

    def take_back(self) -> None:
        """Close the clinic if a test has left its apparatus stopped or in use, so that the next test gets another one."""
        if self._clinic and not self._clinic.is_free():
            self.close()

    def close(self) -> None:
        self._running.close()
        self._clinic = None
