"""Independent validators of the FHIR and Parquet output."""

import atexit
import json
import subprocess
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.support.paths import ROOT

_FOLDER = ROOT / "tests/fhir_validators"


def judge_fhir(cases: Mapping[str, Any]) -> Any:
    """Return what the two validators report of each resource or bundle. One process judges all of this process, because it starts slowly."""
    validators = _fhir_validators()
    assert validators.stdin and validators.stdout
    validators.stdin.write(json.dumps(cases) + "\n")
    validators.stdin.flush()
    answer = validators.stdout.readline()
    assert answer, "the validators have ended: their error is above"
    return json.loads(answer)


def calculate_scores(cases: list[dict[str, Any]]) -> Any:
    """Return what an independent FHIRPath calculates for the read-only items of each ``questionnaire`` from its ``response``."""
    done = subprocess.run(
        _command("calculate.mjs"), input=json.dumps(cases), capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def judge_parquet(file: Path) -> Any:
    """Return what an independent reader finds in a Parquet file."""
    done = subprocess.run(_command("parquet.mjs", str(file)), capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@cache
def _fhir_validators() -> subprocess.Popen[str]:
    started = subprocess.Popen(
        _command("validate.mjs"), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
    )
    atexit.register(started.communicate)
    return started


def _command(script: str, *arguments: str) -> list[str | Path]:
    node = Path(sys.executable).with_name("node")
    if not (_FOLDER / "node_modules").is_dir() or not node.exists():
        pytest.fail(
            "The judges are not there: `make test` fetches them (npm ci --ignore-scripts in tests/fhir_validators)."
        )
    return [node, _FOLDER / script, *arguments]
