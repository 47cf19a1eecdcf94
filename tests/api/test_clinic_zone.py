"""A clinic has one time zone for every day: on the page, in reports, statistics and exports, and for due dates."""

import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final
from uuid import UUID

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select

from kata.clinic.profile.computer_zone import computer_zone
from kata.clinic.sessions.tables import RunRow, SessionRow
from kata.database.engine import Database
from tests.support.audit_rows import audit_log
from tests.support.responses import problem
from tests.support.service import running
from tests.support.treatment import treat

pytestmark = pytest.mark.no_apparatus

SUNDAY_EVENING: Final = datetime(2026, 11, 22, 16, 30, tzinfo=UTC)
"""Sunday in UTC, and Monday of the next week in Tokyo."""


@pytest.fixture(autouse=True)
def _computer(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let a test change the computer's time zone."""
    yield
    monkeypatch.undo()
    time.tzset()


def move_computer(monkeypatch: pytest.MonkeyPatch, zone: str) -> None:
    monkeypatch.setenv("TZ", zone)
    time.tzset()


def treated(client: TestClient) -> tuple[UUID, UUID]:
    """Return episode and session of a treatment on Sunday evening in UTC."""
    app: Any = client.app
    database: Database = app.state.services.database
    with database.write() as session:
        made = treat(session, sessions=1, runs=1)
        row = session.get_one(SessionRow, made.session_ids[0])
        row.started_at = row.ended_at = SUNDAY_EVENING
        for run in session.scalars(select(RunRow).where(RunRow.session_id == row.id)):
            run.started_at = run.ended_at = SUNDAY_EVENING
        return made.episode_id, row.id


def days_of(client: TestClient, episode_id: UUID, session_id: UUID) -> dict[str, Any]:
    """Return the day or week of the session as each part of the service states it."""
    weeks = client.get(f"/api/episodes/{episode_id}/adherence").json()["weeks"]
    span = "since=2026-01-01T00:00:00Z&until=2027-01-01T00:00:00Z"
    usage = client.get(f"/api/statistics/usage?by=week&{span}").json()["rows"]
    report = client.get(f"/api/sessions/{session_id}/report.html")
    return {
        "page": client.get("/api/me").json()["time_zone"],
        "adherence": next(week["begins_on"] for week in weeks if week["sessions"]),
        "usage": next(row["begins_on"] for row in usage if row["sessions"]),
        "report": [day for day in ("22 Nov 2026", "23 Nov 2026") if day in report.text.replace("\u00a0", " ")],
        "backup": client.get("/api/backups").json()["next_at"][11:16],
    }


SUNDAY: Final = {"adherence": "2026-11-16", "usage": "2026-11-16", "report": ["22 Nov 2026"], "backup": "02:30"}
MONDAY: Final = {"adherence": "2026-11-23", "usage": "2026-11-23", "report": ["23 Nov 2026"], "backup": "17:30"}


# An unnamed zone whose days differ from those of UTC. test_the_variable_tz_names_the_computers_zone has the other names without a zone.
@pytest.mark.parametrize(
    "zone", [*(pytest.param(zone, marks=pytest.mark.campaign) for zone in ("UTC", "Etc/UTC")), "JST-9"]
)
def test_without_a_named_zone_every_day_is_of_utc(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, zone: str) -> None:
    move_computer(monkeypatch, zone)
    with running(tmp_path, simulate=False, clinic_time_zone="", shares_worker=False) as client:
        found = days_of(client, *treated(client))
        assert found == SUNDAY | {"page": ""}
        assert client.get("/api/clinic-profile").json()["time_zone"] == ""
        # The letterhead can be changed only together with a time zone.
        wanted = {"name": "Sakura Clinic", "address": "", "phone": "", "time_zone": ""}
        problem(client.put("/api/clinic-profile", json=wanted), 422, "no_time_zone")
        changed = client.put("/api/clinic-profile", json=wanted | {"time_zone": "Asia/Tokyo"})
        assert changed.json()["time_zone"] == "Asia/Tokyo"


@pytest.mark.campaign
def test_the_first_start_stores_the_computers_named_zone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    move_computer(monkeypatch, "Asia/Tokyo")
    with running(tmp_path, simulate=False, clinic_time_zone="", clinic_name="Midori Clinic") as client:
        ids = treated(client)
        found = days_of(client, *ids)
        assert found == MONDAY | {"page": "Asia/Tokyo"}
        assert len(audit_log(client, action="adopt_time_zone")) == 1
        profile = client.get("/api/clinic-profile").json()
        assert (profile["name"], profile["updated_at"], profile["updated_by"]) == ("Midori Clinic", None, "")
    # Another computer, or the same one in another zone, changes no day.
    move_computer(monkeypatch, "America/Chicago")
    with running(
        tmp_path, simulate=False, clinic_time_zone="", clinic_name="Aoba Clinic", shares_worker=False
    ) as client:
        assert days_of(client, *ids) == found
        assert client.get("/api/clinic-profile").json()["name"] == "Aoba Clinic", "the letterhead is still a setting"
        assert len(audit_log(client, action="adopt_time_zone")) == 1


def test_setting_and_administrator_come_before_the_computer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    move_computer(monkeypatch, "America/Chicago")
    with running(tmp_path, simulate=False, clinic_time_zone="") as client:
        assert client.get("/api/me").json()["time_zone"] == "America/Chicago"
    with running(tmp_path, simulate=False, clinic_time_zone="Asia/Tokyo") as client:
        found = days_of(client, *treated(client))
        assert found == MONDAY | {"page": "Asia/Tokyo"}
        wanted = {"name": "", "address": "", "phone": "", "time_zone": "UTC"}
        assert client.put("/api/clinic-profile", json=wanted).status_code == 200
        assert client.get("/api/me").json()["time_zone"] == "UTC"


@pytest.mark.parametrize(
    ("link", "name"),
    [
        ("/usr/share/zoneinfo/Asia/Tokyo", "Asia/Tokyo"),
        ("../usr/share/zoneinfo/America/Argentina/Ushuaia", "America/Argentina/Ushuaia"),
        ("/usr/share/zoneinfo/Etc/UTC", ""),
        ("/usr/share/zoneinfo/Mars/Olympus", ""),
        ("/etc/elsewhere", ""),
        (None, ""),
    ],
)
def test_the_computers_zone_is_the_name_of_its_local_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, link: str | None, name: str
) -> None:
    monkeypatch.delenv("TZ", raising=False)
    local_time = tmp_path / "localtime"
    if link is not None:
        local_time.symlink_to(link)
    assert computer_zone(local_time) == name


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ("Asia/Tokyo", "Asia/Tokyo"),
        (":Asia/Tokyo", "Asia/Tokyo"),
        ("Japan", "Japan"),
        ("UTC", ""),
        ("Etc/GMT-9", ""),
        ("JST-9", ""),
        ("../../etc/passwd", ""),
        ("", ""),
    ],
)
def test_the_variable_tz_names_the_computers_zone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: str, name: str
) -> None:
    monkeypatch.setenv("TZ", given)
    local_time = tmp_path / "localtime"
    local_time.symlink_to("/usr/share/zoneinfo/Europe/Paris")
    # An empty TZ means UTC.
    assert computer_zone(local_time) == name
