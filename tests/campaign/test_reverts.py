"""The changes of the reverted fixes still apply to the package."""

import pytest

from tests.campaign.reverts import DEVICE, REVERTS, ROOT, Revert


@pytest.mark.parametrize("revert", REVERTS, ids=lambda revert: f"{revert.defect}: {revert.what}")
def test_each_fix_can_be_reverted(revert: Revert) -> None:
    assert [problem for edit in revert.edits if (problem := edit.problem(ROOT / DEVICE))] == []


def test_each_device_defect_has_a_revertible_fix() -> None:
    assert {revert.defect for revert in REVERTS} == set(range(1, 10))
