"""Provides the geometry of apparatus and arm for the page's drawing, from the numbers of the MuJoCo model. It does not import MuJoCo."""

from typing import Any

from kata.motion.linkage import LINKAGE
from kata.simulator.independent.parameters import independent_parameters


def page_geometry() -> dict[str, Any]:
    """Return the content of ``frontend/src/features/digital-twin/geometry.json``: millimetres and degrees, right side."""
    values = independent_parameters()
    forward, left, up = (round(1000 * part, 6) for part in values.shoulder_m)
    return {
        "shoulder_mm": {"forward": forward, "left": left, "up": up},
        "upper_arm_mm": round(1000 * values.upper_arm_m, 6),
        "forearm_mm": round(1000 * values.forearm_m, 6),
        "elbow_flexion_deg": values.elbow_flexion_deg,
        "legs": [
            {
                "oq_mm": LINKAGE.oq1_mm,
                "w_deg": LINKAGE.w1_deg,
                "op_mm": LINKAGE.o1p1_mm,
                "qp_mm": LINKAGE.q1p1_mm,
                "oo_mm": list(LINKAGE.oo1_mm),
            },
            {
                "oq_mm": LINKAGE.oq2_mm,
                "w_deg": LINKAGE.w2_deg,
                "op_mm": LINKAGE.o2p2_mm,
                "qp_mm": LINKAGE.q2p2_mm,
                "oo_mm": list(LINKAGE.oo2_mm),
            },
        ],
    }
