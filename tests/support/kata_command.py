"""The ``kata`` command."""

import logging
import os
import signal
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

from typer.testing import CliRunner

from kata.cli.main import app


def kata(*arguments: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the command in its own process, which takes a second to start."""
    environment = os.environ | {"COLUMNS": "200"}
    command = [sys.executable, "-m", "kata", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment, timeout=120)


def kata_here(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the command in this process, whose priority, signals and log it does not change. It takes some milliseconds to start."""
    with patch.object(os, "nice"), patch.object(signal, "signal"), patch.object(logging, "basicConfig"):
        result = CliRunner(env={"COLUMNS": "200"}).invoke(app, list(map(str, arguments)))
    return subprocess.CompletedProcess(arguments, result.exit_code, result.stdout, result.stderr)
