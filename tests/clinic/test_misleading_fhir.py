"""FHIR statements about unusual playbacks, each of which once misled a reader."""

from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from kata.clinic.sessions.tables import RunRow
from kata.database.engine import Database
from kata.interop.codes import local_codes
from tests.support.fhir_bundle import Json, exported, judged, of_kind
from tests.support.fhir_patient import treated

sqlite_only = pytest.mark.parametrize("database", ["sqlite"], indirect=True)


def _playbacks(database: Database, file: Path, **columns: Any) -> list[Json]:
    """Return the Observations of playbacks that have these values."""
    patient_id = treated(database, sessions=1)
    with database.write() as session:
        for row in session.scalars(select(RunRow)):
            for name, value in columns.items():
                setattr(row, name, value)
    bundle = exported(database, patient_id, file)
    assert judged({"bundle": bundle}) == {"bundle": []}
    return [
        found
        for found in of_kind(bundle, "Observation")
        if found["code"].get("coding", [{}])[0].get("code") == "run-tracking"
    ]


@sqlite_only
def test_playback_states_its_share_of_the_taught_range(database: Database, tmp_path: Path) -> None:
    """Without it, the highest angle of a playback with half of the range reads as the most that the shoulder allows."""
    given = {"range_percent": 60.0, "least_range_percent": 50.0, "repetitions_done": 0}
    for playback in _playbacks(database, tmp_path / "bundle.json", **given):
        parts = {part["code"]["coding"][0]["code"]: part for part in playback["component"]}
        assert parts["run-range"]["valueQuantity"] | {"value": 0} == parts["run-least-range"]["valueQuantity"] | {
            "value": 0
        }
        assert (parts["run-range"]["valueQuantity"]["value"], parts["run-range"]["valueQuantity"]["unit"]) == (60, "%")
        assert parts["run-least-range"]["valueQuantity"]["value"] == 50
        assert (parts["run-repetitions"]["valueInteger"], parts["run-repetitions-done"]["valueInteger"]) == (10, 0)
        for end in ("lowest", "highest"):
            assert "the arm can slip in its cuff" in parts[f"motion-4-{end}"]["code"]["coding"][0]["display"]


def test_every_apparatus_angle_code_has_the_slip_caveat() -> None:
    """Each code states an apparatus angle, except those of estimates of the patient's angle."""
    stated = {code: display for code, display in local_codes().items() if "apparatus angle" in display.lower()}
    assert {"end-feel", "end-feel-onset", "apparatus-angle", "motion-4-highest"} <= set(stated)
    of_patient = {code for code in stated if code.startswith("patient-angle") or code == "goniometer-estimate"}
    assert [code for code in stated if code not in of_patient and "can slip in its cuff" not in stated[code]] == []


@sqlite_only
def test_running_playback_is_not_called_not_performed(database: Database, tmp_path: Path) -> None:
    running = {"ended_at": None, "outcome": "loaded", "worst_rmse_deg": None, "worst_peak_deg": None}
    found = _playbacks(database, tmp_path / "bundle.json", **running)
    assert {playback["status"] for playback in found} == {"preliminary"}
    assert {playback["dataAbsentReason"]["coding"][0]["code"] for playback in found} == {"temp-unknown"}
