"""A patient's exported bundle, and its parts."""

import json
from pathlib import Path
from typing import Any
from uuid import UUID

from kata.database.engine import Database
from kata.interop import bundle
from kata.interop.codes import ExportSettings
from tests.support.validators import judge_fhir

Json = dict[str, Any]
NAMES = ExportSettings()


def exported(database: Database, patient_id: UUID, path: Path, clinic: ExportSettings = NAMES) -> Json:
    bundle.export(database, patient_id, path, clinic)
    document: Json = json.loads(path.read_text())
    return document


def of_kind(document: Json, kind: str) -> list[Json]:
    return [entry["resource"] for entry in document["entry"] if entry["resource"]["resourceType"] == kind]


def everything(part: Any) -> list[Json]:
    """Every object in it, however deep."""
    if isinstance(part, list):
        return [element for item in part for element in everything(item)]
    if isinstance(part, dict):
        return [part, *(element for item in part.values() for element in everything(item))]
    return []


def judged(cases: dict[str, Json]) -> dict[str, list[str]]:
    """Return each validator's verdict on each resource."""
    verdicts = judge_fhir(cases)
    return {name: [*said["medplum"], *said["lantana"]] for name, said in verdicts.items()}
