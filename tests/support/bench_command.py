"""Runs ``kata bench`` and reads its report."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any


def bench(*arguments: str, out: Path) -> dict[str, Any]:
    """Run a benchmark and return its JSON report."""
    command = [sys.executable, "-m", "kata", "bench", *arguments, "--json", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=150, env=os.environ | {"COLUMNS": "200"})
    assert done.returncode == 0, done.stderr
    assert "load average before" in done.stdout
    report: dict[str, Any] = json.loads(out.read_text())
    return report
