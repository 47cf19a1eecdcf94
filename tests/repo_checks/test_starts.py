"""Processes start without heavy imports, each of which would take up to some seconds."""

import re
import subprocess
import sys
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Final

import pytest

import kata

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
    ],
)
def test_module_starts_without_the_heavy_import(module: str, without: str) -> None:
    assert without not in imported_by(module)


@pytest.mark.parametrize(
    ("module", "without"),
    [
        ("kata.cli.serve", {"scipy", "plotly", "alembic", "mako", "pygments", "authlib", "joserfc", "requests", "segno", "mujoco"}),
        ("kata.cli.serve", {"jinja2", "plutoprint", "pylopdf_fonts_cjk", "cryptography.x509", "arro3"}),
        ("kata.device.process", {"scipy", "plotly", "sqlalchemy", "pydantic", "fastapi", "rich", "multiprocessing", "cryptography"}),
        ("kata.device.process", {"kata.settings", "kata.simulator", "kata.motion.tracking", "kata.motion.identify"}),
        ("kata.device.process", {"importlib.metadata", "email"}),
        ("kata.device.reference_builder", {"numpy", "scipy", "kata.device.references"}),
        ("kata.simulator.process", {"scipy", "sqlalchemy", "pydantic", "fastapi", "kata.settings"}),
        ("kata.plotting.figures", {"scipy", "plotly", "fastapi", "alembic", "kata.api"}),
        ("kata.clinic.sessions.run_results", {"scipy", "sqlalchemy", "pydantic", "fastapi", "plotly"}),
    ],
)  # fmt: skip
def test_processes_start_without_libraries_of_rare_work(module: str, without: set[str]) -> None:
    """Each of these libraries would cost every start time, and every such process memory."""
    assert imported_by(module) & without == set()


_DAILY_WORK: Final = ("motion", "clinic", "plotting", "device")
_RARE: Final = {"identify.py", "identify_load.py", "intervals.py"}
"""Modules for commissioning, and the one for an administrator's statistics."""


def test_daily_work_imports_only_scipys_linear_algebra() -> None:
    """Its other parts take 4 to 20 MB in each process that imports them."""
    files = [file for package in _DAILY_WORK for file in (Path(kata.__file__).parent / package).rglob("*.py")]
    found = {
        (file.name, part)
        for file in files
        for part in re.findall(r"^\s*(?:from|import) (scipy[.\w]*)", file.read_text(), re.MULTILINE)
    }
    assert {part for name, part in found if name not in _RARE} == {"scipy.linalg"}
    assert {name for name, _ in found} >= _RARE


@cache
def imported_by(module: str) -> set[str]:
    """Return the modules in a new process that has imported this one."""
    started = f"import {module}, sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", started], capture_output=True, text=True, timeout=60, check=True)
    return set(done.stdout.split())
