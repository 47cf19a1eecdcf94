"""A whole clinic as `make run` starts it, for a real browser."""

import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from kata.access.sign_in import COOKIE
from tests.conftest import ROOT, free_port
from tests.signed_in import signed_in_at

START_LIMIT_S = 60.0
LONG_MS = 60_000
"""For what takes its time on a busy computer; never how long it should take."""


class Clinic:
    """``kata serve --simulate`` in a process of its own."""

    def __init__(self, folder: Path, *, database_url: str = "") -> None:
        """``database_url``: of its database, unless that is a file in ``folder``."""
        self.cookie = signed_in_at(folder, database_url=database_url)
        self._environment = os.environ | ({"KATA_DATABASE_URL": database_url} if database_url else {})
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._folder = folder
        self._log = folder / "service.log"
        self.start()

    def start(self) -> None:
        """Returns once it answers; also after it was killed, on the same folder and port."""
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
        """As when the power fails: nothing is said to anybody."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def _wait(self) -> None:
        limit = time.monotonic() + START_LIMIT_S
        while True:
            try:
                with urllib.request.urlopen(f"{self.url}/health/live", timeout=2):
                    return
            except (urllib.error.URLError, OSError):
                told = self._log.read_text(errors="replace")
                assert self.process.poll() is None, told
                assert time.monotonic() < limit, told
                time.sleep(0.1)

    def close(self) -> None:
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


@pytest.fixture
def clinic(tmp_path: Path) -> Iterator[Clinic]:
    started = Clinic(tmp_path)
    yield started
    started.close()


@pytest.fixture
def demonstration(tmp_path: Path) -> Iterator[Clinic]:
    """A dozen invented patients with months of history."""
    told = [sys.executable, "-m", "kata", "seed", "--data", str(tmp_path)]
    subprocess.run(told, check=True, capture_output=True)
    started = Clinic(tmp_path)
    yield started
    started.close()


@pytest.fixture(scope="session")
def browser_context_args(browser_context_args: dict[str, Any]) -> dict[str, Any]:
    return {**browser_context_args, "viewport": {"width": 1280, "height": 900}, "locale": "en-GB"}


@pytest.fixture
def page(page: Page, clinic: Clinic) -> Page:
    """On the station page, signed in as administrator, the apparatus idle."""
    page.context.add_cookies([{"name": COOKIE, "value": clinic.cookie, "url": clinic.url}])
    page.goto(clinic.url)
    expect(page.get_by_test_id("mode")).to_have_text("Idle, torque off", timeout=START_LIMIT_S * 1000)
    return page


@pytest.fixture
def artefacts() -> Path:
    """Where screenshots are kept."""
    folder = ROOT / "artefacts"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture
def taught_name() -> str:
    """The motion to choose in the simulator's panel: a recorded one where there are any."""
    folder = os.environ.get("KATA_TAUGHT")
    recorded = sorted(Path(folder).glob("*.csv"), key=lambda file: file.stat().st_size) if folder else []
    return recorded[0].stem if recorded else "1 Abduction / adduction of the scapula"
