"""The page computes the apparatus' pose with its own equations; both implementations must pass one file of cases."""

import json
from typing import Any

import numpy as np
import pytest

from kata.motion.linkage import motor_angles_deg
from kata.motion.shoulder import humerus_direction
from tests.support.paths import ROOT

CASES = json.loads((ROOT / "frontend/src/features/digital-twin/cases.json").read_text())


@pytest.mark.parametrize("case", CASES, ids=[f"{case['side']} {case['pose_deg']}" for case in CASES])
def test_page_cases_match_the_real_linkage_and_shoulder(case: dict[str, Any]) -> None:
    assert motor_angles_deg(case["pose_deg"], case["side"]) == pytest.approx(np.array(case["motors_deg"]), abs=1e-8)
    assert humerus_direction(case["pose_deg"], case["side"]) == pytest.approx(np.array(case["upper_arm"]), abs=1e-8)


def test_the_cases_are_of_both_shoulders() -> None:
    assert {case["side"] for case in CASES} == {"left", "right"}
