"""Two validators accept the FHIR export of every patient of `kata seed`, in both languages. It takes minutes.

`--log-cli-level info` logs the number of sessions and resources of each patient, and their sums.
"""

import json
import logging
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import pytest
from sqlalchemy import select

from kata.cli.seed import fill
from kata.cli.seed_people import MOST, Language
from kata.clinic.patients.tables import PatientRow
from kata.database.engine import Database
from kata.interop import bundle
from kata.interop.codes import ExportSettings
from tests.support.databases import upgraded_file
from tests.support.fhir_bundle import judged

NOW: Final = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)
SESSIONS: Final = 800
"""All seeded patients together have so many sessions or more. A patient with 50 is in tests/clinic/test_fhir.py."""

log = logging.getLogger(__name__)


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("language", ["en", "ja"])
def test_every_seeded_patient_is_valid_fhir(tmp_path: Path, language: Language) -> None:
    database = Database(upgraded_file(tmp_path / "kata.db"))
    assert fill(database, 1, NOW, MOST, language) == MOST
    verdicts: dict[str, list[str]] = {}
    kinds: Counter[str] = Counter()
    with database.read() as session:
        for patient in session.scalars(select(PatientRow).order_by(PatientRow.clinic_number)):
            bundle.write(session, patient, tmp_path / "bundle.json", ExportSettings())
            document = json.loads((tmp_path / "bundle.json").read_text(encoding="utf-8"))
            # One patient at a time, because the validators hold the whole request in memory.
            verdicts |= judged({patient.clinic_number: document})
            of_patient = Counter(entry["resource"]["resourceType"] for entry in document["entry"])
            kinds += of_patient
            log.info(
                "%s %s: %d sessions, %d resources, %d errors",
                language,
                patient.clinic_number,
                of_patient["Procedure"],
                of_patient.total(),
                len(verdicts[patient.clinic_number]),
            )
    database.close()
    log.info("%s: %d patients; resources %s", language, len(verdicts), dict(kinds))
    assert len(verdicts) == MOST
    assert kinds["Procedure"] >= SESSIONS
    assert {number: errors for number, errors in verdicts.items() if errors} == {}
