"""Assessments as request bodies."""

from typing import Any

FLEXION: dict[str, Any] = {"side": "left", "motion": "flexion", "kind": "active", "angle_deg": 95}


def found(**given: Any) -> dict[str, Any]:
    return {"assessed_at": "2026-03-02T09:30:00Z", "assessed_by": "Kimura Jun", "rom": [FLEXION]} | given
