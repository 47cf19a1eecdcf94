"""Runs ``kata bench`` and reads its report."""

import json
from pathlib import Path
from typing import Any

from tests.support.kata_command import kata_here


def bench(*arguments: str, out: Path) -> dict[str, Any]:
    """Run a benchmark in this process, which has already imported what it needs, and return its JSON report."""
    done = kata_here("bench", *arguments, "--json", out)
    assert done.returncode == 0, done.stderr
    assert "load average before" in done.stdout
    report: dict[str, Any] = json.loads(out.read_text())
    return report
