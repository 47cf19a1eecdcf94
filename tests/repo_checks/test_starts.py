"""Processes start without heavy imports, each of which would take up to some seconds."""

import subprocess
import sys
from importlib.metadata import entry_points

import pytest

(COMMAND,) = entry_points(group="console_scripts", name="kata")
MAIN = COMMAND.value.partition(":")[0]
"""The module that a spawned worker imports again."""


@pytest.mark.parametrize(
    ("module", "without"),
    [
        (MAIN, "kata.cli.main"),
        ("kata.cli.main", "kata.api"),
        ("kata.cli.main", "fastapi"),
        ("kata.cli.main", "numpy"),
        ("kata.backups.create", "scipy"),
        ("kata.simulator.process", "scipy"),
        ("kata.api.app", "scipy.signal"),
    ],
)
def test_module_starts_without_the_heavy_import(module: str, without: str) -> None:
    started = f"import {module}, sys; print({without!r} in sys.modules)"
    done = subprocess.run([sys.executable, "-c", started], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "False"
