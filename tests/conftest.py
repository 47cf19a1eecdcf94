"""What several kinds of tests need."""

import os
from pathlib import Path
from typing import Any

import pytest

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


def recorded_motions() -> list[Path]:
    """The CSV files of the folder KATA_TAUGHT; none without it."""
    folder = os.environ.get("KATA_TAUGHT")
    return sorted(Path(folder).glob("*.csv")) if folder else []


@pytest.fixture(scope="session")
def motion() -> Taught:
    """A real motion where there is one (the shortest), a built-in one otherwise."""
    recorded = [read_csv(path) for path in recorded_motions()]
    return min(recorded or built_in_motions(), key=lambda one: one.duration_s)
