"""The changes of the reverted fixes still apply to the package, and leave code that runs."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.campaign.reverts import DEVICE, REVERTS, ROOT, Revert


@pytest.mark.parametrize("revert", REVERTS, ids=lambda revert: f"{revert.defect}: {revert.what}")
def test_each_fix_can_be_reverted(revert: Revert, tmp_path: Path) -> None:
    assert [problem for edit in revert.edits if (problem := edit.problem(ROOT / DEVICE))] == []

    for file in {edit.file for edit in revert.edits}:
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / DEVICE / file, tmp_path / file)
    for edit in revert.edits:
        edit.make(tmp_path)
    # A name that no longer exists would end the search instead of failing an example.
    undefined = [sys.executable, "-m", "ruff", "check", "--isolated", "--no-cache", "--select", "F821", str(tmp_path)]
    checked = subprocess.run(undefined, capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout


def test_each_device_defect_has_a_revertible_fix() -> None:
    assert {revert.defect for revert in REVERTS} == set(range(1, 26))
