"""Weeks and days begin at the clinic's midnight before and after summer time begins and ends."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select

from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.database.engine import Database
from tests.support.service import running
from tests.support.treatment import treat

pytestmark = pytest.mark.no_apparatus

STARTS = (
    # In Berlin: Monday, 0:30, in summer time; Sunday, 23:30, in summer time; the same in winter time.
    datetime(2026, 10, 18, 22, 30, tzinfo=UTC),
    datetime(2026, 10, 18, 21, 30, tzinfo=UTC),
    datetime(2026, 10, 25, 23, 30, tzinfo=UTC),
    datetime(2026, 11, 1, 22, 30, tzinfo=UTC),
)
BERLIN = {"2026-10-12": 1, "2026-10-19": 1, "2026-10-26": 2}
"""Sessions by the Monday of their week."""


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with running(tmp_path_factory.mktemp("kata"), simulate=False, clinic_time_zone="Europe/Berlin") as made:
        yield made


@pytest.fixture(scope="module")
def episode_id(client: TestClient) -> str:
    database: Database = client.app.state.services.database  # type: ignore[attr-defined]
    with database.write() as session:
        made = treat(session, sessions=len(STARTS), runs=1)
        for session_id, at in zip(made.session_ids, STARTS, strict=True):
            row = session.get_one(SessionRow, session_id)
            row.started_at, row.ended_at = at, at + timedelta(minutes=20)
            for run in session.scalars(select(RunRow).where(RunRow.session_id == session_id)):
                run.started_at, run.ended_at = at, at + timedelta(minutes=10)
    return str(made.episode_id)


def test_a_session_belongs_to_its_own_local_week(client: TestClient, episode_id: str) -> None:
    weeks = client.get(f"/api/episodes/{episode_id}/adherence").json()["weeks"]
    assert {week["begins_on"]: week["sessions"] for week in weeks if week["sessions"]} == BERLIN


@pytest.mark.usefixtures("episode_id")
def test_a_session_belongs_to_its_own_local_day(client: TestClient) -> None:
    query = "since=2026-01-01T00:00:00Z&until=2027-01-01T00:00:00Z"
    days = client.get(f"/api/statistics/usage?by=day&{query}").json()["rows"]
    assert [row["begins_on"] for row in days] == [
        "2026-10-18",
        "2026-10-19",
        "2026-10-26",
        "2026-11-01",
    ]
    weeks = client.get(f"/api/statistics/usage?by=week&{query}").json()["rows"]
    assert {row["begins_on"]: row["sessions"] for row in weeks} == BERLIN
