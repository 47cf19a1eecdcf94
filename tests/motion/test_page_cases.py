"""The page computes the apparatus' pose with its own equations; both implementations must pass one file of cases."""

import json
from typing import Any

import numpy as np
import pytest

from docs.generate import GEOMETRY
from kata.motion.linkage import motor_angles_deg
from kata.motion.shoulder import humerus_direction
from kata.simulator.independent.model import linkage_geometry
from kata.simulator.independent.page_geometry import page_geometry
from tests.support.paths import ROOT

CASES = json.loads((ROOT / "frontend/src/features/digital-twin/cases.json").read_text())


@pytest.mark.parametrize("case", CASES, ids=[f"{case['side']} {case['pose_deg']}" for case in CASES])
def test_page_cases_match_the_real_linkage_and_shoulder(case: dict[str, Any]) -> None:
    assert motor_angles_deg(case["pose_deg"], case["side"]) == pytest.approx(np.array(case["motors_deg"]), abs=1e-8)
    assert humerus_direction(case["pose_deg"], case["side"]) == pytest.approx(np.array(case["upper_arm"]), abs=1e-8)


def test_page_draws_the_geometry_of_the_mujoco_model() -> None:
    assert json.loads(GEOMETRY.read_text()) == page_geometry()
    legs = linkage_geometry()
    for leg, drawn in zip(legs, page_geometry()["legs"], strict=True):
        crank = np.subtract(leg.crank_end, leg.pivot)
        assert 1000 * np.linalg.norm(crank) == pytest.approx(drawn["op_mm"])
        assert 1000 * np.linalg.norm(leg.board_end) == pytest.approx(drawn["oq_mm"])
        assert 1000 * np.linalg.norm(np.subtract(leg.board_end, leg.crank_end)) == pytest.approx(drawn["qp_mm"])


def test_the_cases_are_of_both_shoulders() -> None:
    assert {case["side"] for case in CASES} == {"left", "right"}
