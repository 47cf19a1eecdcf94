"""Independent validators of the FHIR and Parquet output."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.paths import ROOT


def judge(script: str, *arguments: str, given: str | None = None) -> Any:
    """Run a script of tests/fhir_validators on our output and return the JSON that it prints."""
    folder = ROOT / "tests/fhir_validators"
    node = Path(sys.executable).with_name("node")
    if not (folder / "node_modules").is_dir() or not node.exists():
        pytest.fail(
            "The judges are not there: `make test` fetches them (npm ci --ignore-scripts in tests/fhir_validators)."
        )
    done = subprocess.run(
        [node, folder / script, *arguments], input=given, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
