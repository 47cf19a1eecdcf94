"""REST for progress."""

from typing import Any
from uuid import uuid4

import pytest
from fastapi.testclient import TestClient

from kata.clinic.progress.schemas import Progress
from tests.support.assessments import FLEXION, found
from tests.support.responses import problem

pytestmark = pytest.mark.no_apparatus

CHARTS = ("rom", "pain", "spadi", "questionnaires", "tracking", "correction", "adherence", "end_feel", "end_range")


@pytest.mark.parametrize("chart", CHARTS)
def test_every_chart_comes_with_its_numbers(client: TestClient, patient: dict[str, Any], chart: str) -> None:
    url = f"/api/episodes/{patient['episode_id']}"
    body = found(rom=[FLEXION | {"side": patient["affected_side"]}], pain_rest=3, spadi=[4] * 13)
    assert client.post(f"{url}/assessments", json=body).status_code == 201
    answer = client.get(f"{url}/progress/{chart}")
    assert answer.status_code == 200
    progress = Progress.model_validate_json(answer.content)
    assert bool(progress.table.rows) == (chart in ("rom", "pain", "spadi"))
    # A chart that shows which changes matter has notes with their sources.
    sources = [note.source.partition(" ")[0] for note in progress.notes.lines]
    assert sources == (["Roy,", "Tveita"] if chart == "spadi" else [])
    for row in progress.table.rows:
        moments = [cell for cell, column in zip(row, progress.table.columns, strict=True) if column.kind == "moment"]
        assert moments == ["2026-03-02T09:30:00Z"]


def test_missing_data_is_reported(client: TestClient, patient: dict[str, Any]) -> None:
    problem(client.get(f"/api/episodes/{uuid4()}/progress/rom"), 404, "not_found")
    url = f"/api/episodes/{patient['episode_id']}/progress"
    problem(client.get(f"{url}/mood"), 422, "invalid")
    problem(client.get(f"{url}/rom?columns=3"), 422, "invalid")
