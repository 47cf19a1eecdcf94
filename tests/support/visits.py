"""Programmes and waiting for stored results through the API."""

import time
from collections.abc import Callable
from typing import Any
from uuid import UUID, uuid4

from fastapi.testclient import TestClient

from kata.clinic.programmes.tables import ProgrammeItemRow, ProgrammeRow, ProgrammeVersionRow
from kata.database.base import utc_now
from tests.support.preflight import WHO

LIMIT_S = 30.0


def programme(client: TestClient, patient: dict[str, Any], *recording_ids: str) -> str:
    """Create a programme version with these recordings, twice each, at 150 % speed."""
    version_id = uuid4()
    episode_id = episode_of(client, patient)
    now = utc_now()
    with client.app.state.services.database.write() as session:  # type: ignore[attr-defined]
        row = ProgrammeRow(id=uuid4(), episode_id=episode_id, name="Weeks 3 to 6", created_at=now, updated_at=now)
        version = ProgrammeVersionRow(id=version_id, number=1, made_at=now, made_by=WHO, note="")
        row.versions = [version]
        session.add(row)
        session.flush()
        for position, recording_id in enumerate(recording_ids, start=1):
            session.add(
                ProgrammeItemRow(
                    version_id=version_id, position=position, recording_id=UUID(recording_id), speed_percent=150.0,
                    repetitions=2, pause_s=0.5, range_percent=100.0, resistance_level=25, method="smooth",
                )
            )  # fmt: skip
    return str(version_id)


def episode_of(client: TestClient, patient: dict[str, Any]) -> UUID:
    session = client.post("/api/sessions", json={"patient_id": patient["id"], "therapist": WHO}).json()
    return UUID(session["episode_id"])


def eventually(look: Callable[[], Any]) -> Any:
    """Wait for a result that a thread or the importer stores."""
    limit = time.monotonic() + LIMIT_S
    while not (found := look()):
        assert time.monotonic() < limit
    return found
