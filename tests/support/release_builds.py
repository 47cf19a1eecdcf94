"""Copies of the checkout, and builds of them."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

from tests.support.archives import unpack
from tests.support.paths import ROOT

_MADE_BY_BUILDS: Final = ("frontend/node_modules", "frontend/dist", "docs/_build")


def copied_checkout(folder: Path) -> Path:
    """Copy the files of the checkout that git tracks or would track, and return the folder."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    for name in filter(None, listed.stdout.split("\0")):
        source, target = ROOT / name, folder / name
        if source.is_file() and not source.is_symlink() and not name.startswith(_MADE_BY_BUILDS):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    return folder


def unpacked(sdist: Path, folder: Path) -> Path:
    """Unpack an sdist and return the folder of its project."""
    unpack(sdist, folder)
    (project,) = folder.iterdir()
    return project


def built(project: Path, target: str, folder: Path, **environment: str) -> Path:
    """Build ``sdist`` or ``wheel`` of a project with the packages of this environment, and return the file."""
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)],
        cwd=project, env=_environment() | environment, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    (file,) = folder.iterdir()
    return file


def set_times(folder: Path, at: float) -> None:
    """Give every file of a folder the same time."""
    for path in [folder, *folder.rglob("*")]:
        os.utime(path, (at, at), follow_symlinks=False)


def _environment() -> dict[str, str]:
    """Return the environment without what the tests set for themselves."""
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "SOURCE_DATE_EPOCH")}
